"""Calibration of the covariances of single frames."""

from __future__ import annotations

import numpy as np

from pop_core.fitting.uncertainty import Calibration

# Learned as `python -m benchmarks calibration frames` does, of people none of whom is in the
# accuracy benchmark; of what it prints, joints behind the own body are widened by 11 % and those
# behind the scene by 4 %, so that the 95 % ellipsoids of either hold 90. A limb that no keypoint
# names is anywhere the hypotheses put it: how well its surface fits where the winner has it says
# little.
SINGLE_FRAME = Calibration(
    inflation=np.array([[0.748, 0.839, 0.685, 0.814, 0.735], [0.937, 0.813, 0.866, 0.905, 0.689]]),
    of_part=np.array([1.210, 1.163, 0.999]), compression=0.140, rival_share=0.858,
    rival_cost=13.86, retrieved_share=(0.137, 0.840), roundness=0.503, floor_m=0.005,
    per_misfit=24.587, per_strain=0.185, usual_misfit_m=0.038, usual_strain=2.5)
