"""Pictures that explain a fit: energies over its steps, and errors where the truth is known."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from pop_core.estimate import FrameResult
from pop_core.fitting.fit_trace import TracedStep, TracedSteps
from pop_core.pipeline import BodyPipeline
from pop_core.rendering.heat_map import MeasuredSurface, heat_map
from pop_core.rendering.line_chart import Line, line_chart
from pop_core.rendering.palette import INK, person_color
from pop_core.rgbd import RgbdFrame, undistort_frame
from pop_ros.result_folder import write_png

CHART_SIZE = (900, 300)
CM = 100.0


class FitExplainer:
    """Watches a pipeline and writes what it saw beside the results."""

    def __init__(self, pipeline: BodyPipeline) -> None:
        """Begin to watch; the pipeline becomes slower and its results stay the same."""
        self._pipeline = pipeline
        self._steps = TracedSteps(pipeline.fitter.steps)
        pipeline.fitter.steps = self._steps

    def write(self, folder: Path, source: Path, frame: RgbdFrame, result: FrameResult) -> None:
        """Write `energies_K.png` of every fit and, if there is a `truth.npz`, `errors.png`.

        Fits are numbered as they were made: one that was refused in the end has a picture too.

        Args:
            folder: Folder of the frame's results.
            source: Folder of the frame.
            frame: The frame.
            result: Its result, the last of the pipeline.
        """
        for number, steps in enumerate(self._steps.take_traces()):
            write_png(folder / f'energies_{number}.png', energy_chart(steps))
        truth = source / 'truth.npz'
        if truth.is_file() and result.bodies:
            seen = undistort_frame(frame)
            with np.load(truth, allow_pickle=False) as known:
                people = measured_surfaces(
                    result, known['joints'], known['vertices'].astype(np.float64))
            if people:
                picture = heat_map(seen.rgb, people, self._pipeline.model.f, seen.camera)
                write_png(folder / 'errors.png', picture)


def measured_surfaces(
    result: FrameResult, true_joints: np.ndarray, true_vertices: np.ndarray
) -> list[MeasuredSurface]:
    """Return the people of a result with the errors of their vertices [m].

    Each is compared with the true person whose pelvis is nearest; a mesh of other vertices than
    the truth's cannot be compared and is left out.
    """
    people = []
    for body in result.bodies:
        if not len(true_joints) or body.vertices.shape != true_vertices.shape[1:]:
            continue
        nearest = np.linalg.norm(true_joints[:, 0] - body.joints[0], axis=1).argmin()
        error_m = np.linalg.norm(body.vertices - true_vertices[nearest], axis=1)
        people.append(MeasuredSurface(body.vertices, error_m))
    return people


def energy_chart(steps: Sequence[TracedStep]) -> np.ndarray:
    """Return both energies over the steps of every hypothesis, the winner's in bold."""
    winner = steps[-1].hypothesis
    numbers = sorted({step.hypothesis for step in steps}, key=lambda n: n == winner)
    own = {n: [step for step in steps if step.hypothesis == n] for n in numbers}
    charts = []
    for title, scale, name in (
        ('E_depth [cm], mean over the pixels of the person', CM, 'depth'),
        ('E_J3D (Eq. 2), no unit', 1.0, 'joints'),
    ):
        lines = [
            Line(np.arange(len(own[n]), dtype=np.float64),
                 scale * np.array([getattr(step, name) for step in own[n]]),
                 INK if n == winner else person_color(n), 3 if n == winner else 1)
            for n in numbers]
        charts.append(line_chart(title, lines, _borders(own[winner]), CHART_SIZE))
    return np.concatenate(charts)


def _borders(steps: Sequence[TracedStep]) -> list[tuple[float, str]]:
    """Return where each stage of the winner begins."""
    first = [(0.0, steps[0].stage)]
    later = [(float(i + 1), b.stage)
             for i, (a, b) in enumerate(pairwise(steps)) if a.stage != b.stage]
    return first + later
