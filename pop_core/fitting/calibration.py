"""Calibration of the covariances of single frames."""

from __future__ import annotations

import numpy as np

from pop_core.fitting.uncertainty import Calibration

# Learned as `python -m benchmarks calibration frames` does, from fits of an earlier commit, of
# people none of whom is in the accuracy benchmark. A limb that no keypoint names is anywhere the
# hypotheses put it: how well its surface fits where the winner has it says little.
SINGLE_FRAME = Calibration(
    inflation=np.array([[0.772, 0.787, 0.720, 0.766, 0.785], [0.982, 0.841, 0.731, 0.721, 0.701]]),
    of_part=np.array([1.117, 1.261, 1.010]), compression=0.207, rival_share=0.701,
    rival_cost=22.3, retrieved_share=(0.280, 0.736), roundness=0.526, floor_m=0.005,
    per_misfit=12.4, per_strain=0.681, usual_misfit_m=0.038, usual_strain=2.5)
