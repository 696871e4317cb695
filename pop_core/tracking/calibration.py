"""Calibration of the covariances of people who are followed."""

from __future__ import annotations

import numpy as np

from pop_core.fitting.uncertainty import Calibration

# Learned as `python -m benchmarks calibration tracks` does, from four recordings of each kind by
# all sensors; what that command films, and the tracking benchmark, are other people. Frames err
# together, so that the filter is surer than it should be; most of all of a limb that looks
# observed where no keypoint was.
TRACKED = Calibration(
    inflation=np.array([[1.86, 1.95, 2.00, 1.82, 2.06], [2.48, 1.73, 1.76, 1.66, 2.25]]),
    of_part=np.array([0.95, 0.94, 0.81]), compression=0.13, rival_share=0.09, rival_cost=10.0,
    retrieved_share=(0.0, 0.0), roundness=0.32, floor_m=0.004, per_misfit=16.9,
    per_strain=0.56, usual_misfit_m=0.042, usual_strain=2.55)
