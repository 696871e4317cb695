"""Calibration of the covariances of single frames."""

from __future__ import annotations

import numpy as np

from pop_core.fitting.uncertainty import Calibration

# Learned as `python -m benchmarks calibration frames` does, of people none of whom is in the
# accuracy benchmark. A limb that no keypoint names is anywhere the hypotheses put it: how well its
# surface fits where the winner has it says little.
SINGLE_FRAME = Calibration(
    inflation=np.array([[0.788, 0.893, 0.768, 0.922, 0.817], [0.996, 0.827, 0.842, 0.885, 0.872]]),
    of_part=np.array([1.506, 1.493, 1.290]), compression=-0.279, rival_share=0.522,
    rival_cost=10.00, retrieved_share=(0.195, 0.312), roundness=0.248, floor_m=0.006,
    per_misfit=21.480, per_strain=0.139, usual_misfit_m=0.038, usual_strain=2.5)
