"""Calibration of the covariances of people who are followed."""

from __future__ import annotations

import numpy as np

from pop_core.fitting.uncertainty import Calibration

# Learned by `python -m benchmarks calibration tracks` from recordings of which none is in the
# tracking benchmark. Frames err together, so that the filter is surer than it should be; most of
# all of a limb that looks observed where no keypoint was.
TRACKED = Calibration(
    inflation=np.array([[1.93, 2.15, 2.12, 2.01, 2.22], [2.54, 1.74, 1.62, 1.56, 2.23]]),
    of_part=np.array([1.01, 0.99, 0.92]), rival_share=0.08, rival_cost=10.0,
    retrieved_share=(0.0, 0.0), roundness=0.21, floor_m=0.0059, per_misfit=17.5,
    per_strain=0.67, usual_misfit_m=0.042, usual_strain=2.55)
