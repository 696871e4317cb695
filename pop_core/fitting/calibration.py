"""Calibration of the covariances of single frames."""

from __future__ import annotations

import numpy as np

from pop_core.fitting.uncertainty import Calibration

# Learned by `python -m benchmarks calibration frames` from people of whom none is in the accuracy
# benchmark. A limb that no keypoint names is anywhere the hypotheses put it: how well its surface
# fits where the winner has it says little.
SINGLE_FRAME = Calibration(
    inflation=np.array([[0.914, 0.907, 0.820, 0.900, 0.928], [0.792, 0.728, 0.609, 0.581, 0.609]]),
    of_part=np.array([1.067, 1.202, 0.974]), rival_share=0.845, rival_cost=23.2,
    retrieved_share=(0.228, 1.275), roundness=0.53, floor_m=0.006, per_misfit=13.0,
    per_strain=0.758, usual_misfit_m=0.038, usual_strain=2.5)
