"""What the worker thread does: prepare once, then fit the newest pair and publish."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import Any

from rclpy.node import Node
from rclpy.task import Future

from pop_core.config import PipelineConfig
from pop_core.errors import PopError
from pop_ros.finding_process import FindingProcess
from pop_ros.fitting import Fitting
from pop_ros.frame_fitter import FittedFrame, FrameFitter
from pop_ros.from_messages import stamp_ns
from pop_ros.inputs import RgbdMessages
from pop_ros.looking import LOOKING_NICENESS, DistantDetector, Looking
from pop_ros.node_arguments import NodeArguments
from pop_ros.node_config import NodeConfig
from pop_ros.node_outputs import NodeOutputs
from pop_ros.parameters import ConfigParameters
from pop_ros.snapshot import save_snapshot
from pop_ros.static_frames import StaticFrames
from pop_ros.statistics import NodeStatistics, drop_reason
from pop_ros.worker import Worker

Settings = ConfigParameters[NodeConfig, PipelineConfig]
PROGRESS_STEP = 0.1
AFTERWARDS_S = 1.0
REPLACED, STOPPED = 'replaced by a newer pair', 'stopped before it was fitted'
NO_FRAME = 'no frame has been fitted yet: somebody must subscribe an output, and images arrive'


class FrameWork:
    """A worker, and what only its thread touches.

    Attributes:
        failure: What ended the preparation, or None.
        doing: What the preparation does, in words; '' when it is over.
    """

    def __init__(
        self, node: Node, settings: Settings, arguments: NodeArguments, frames: StaticFrames,
        outputs: NodeOutputs, statistics: NodeStatistics,
    ) -> None:
        """Start to prepare: load the library and compile kernels, in the worker's thread."""
        self.failure: Exception | None = None
        self.doing = 'loading'
        self._settings, self._outputs, self._statistics = settings, outputs, statistics
        self._log, self._clock = node.get_logger(), node.get_clock()  # type: ignore[no-untyped-call]
        self._running = threading.Event()
        self._fitter: FrameFitter | None = None
        self._latest: FittedFrame | None = None
        self._last_number = 0
        self._said_share = -1.0
        self._models = arguments.models
        self._finding = FindingProcess(Fitting(arguments.models))
        self._searching = FindingProcess(Fitting(arguments.models))
        self._looking = FindingProcess(Looking(arguments.sources), LOOKING_NICENESS)
        self._worker: Worker[RgbdMessages] = Worker(
            self._fit, self._on_error, lambda: self._prepare(frames))
        self._worker.start()

    # Executor thread

    @property
    def is_ready(self) -> bool:
        """Return whether frames can be fitted."""
        return self._fitter is not None

    @property
    def looking_s(self) -> float:
        """Return for how long an answer of the keypoint source is waited for [s]."""
        return self._looking.busy_s

    def put(self, messages: RgbdMessages) -> None:
        """Have a pair fitted unless a newer one comes first."""
        self._statistics.add_pair()
        if self._worker.mailbox.put(messages):
            self._statistics.add_drop(REPLACED)

    def run(self, running: bool) -> None:
        """Fit what comes, or stop and remove the people that are shown."""
        if running == self._running.is_set():
            return
        if running:
            self._running.set()
        else:
            self._running.clear()
            self._worker.call(self._clear)

    def configure(self) -> None:
        """Take over changed settings before the next frame."""
        self._worker.call(self._configure)

    def reset(self) -> None:
        """Start the ids of people anew with the next frame."""
        self._worker.call(self._reset)

    def snapshot(self, folder: Path) -> Any:
        """Write the latest frame below `folder`; await success, and where it is or why not."""
        answer: Any = Future()  # type: ignore[no-untyped-call]
        if self._latest is None:
            answer.set_result((False, NO_FRAME))
        else:
            self._worker.call(lambda: answer.set_result(self._snapshot(folder)))
        return answer

    def stop(self, timeout_s: float) -> bool:
        """End thread and processes; return whether the frame in work was finished in time."""
        self.run(False)
        if self._worker.mailbox.clear():
            self._statistics.add_drop(STOPPED)
        finished = self._worker.stop(timeout_s)
        for process in (self._finding, self._searching, self._looking):
            process.stop()
        # A frame that waited for one of them ends now.
        return finished or self._worker.stop(AFTERWARDS_S)

    # Worker thread

    def _prepare(self, frames: StaticFrames) -> None:
        started_s = time.monotonic()
        self._looking.configure(self._settings.pipeline_config)
        source = self._looking.start()
        self._log.info(
            'preparing; the first start generates the pose library and compiles kernels, later '
            'ones read them from the cache')
        fitter = FrameFitter(
            DistantDetector(self._looking), self._settings.pipeline_config,
            self._settings.node_config, self._say_progress, frames, models=self._models,
            finding=self._finding, looking=self._looking, searching=self._searching)
        self._outputs.publish_model(fitter.model)
        self._configure_finding()
        source.result()
        self._fitter = fitter
        self.doing = ''
        self._log.info(f'ready after {time.monotonic() - started_s:.1f} s')

    def _say_progress(self, share: float, sentence: str) -> None:
        self.doing = f'{share:.0%} {sentence}'
        # A smaller share is that of the next step.
        if not self._said_share <= share < self._said_share + PROGRESS_STEP:
            self._said_share = share
            self._log.info(self.doing)

    def _fit(self, messages: RgbdMessages) -> None:
        if self._fitter is None or not self._running.is_set():
            self._statistics.add_drop(STOPPED)
            return
        skipped = max(messages.number - self._last_number - 1, 0)
        self._last_number = messages.number
        self._latest = fitted = self._fitter.fit(
            messages.color, messages.depth, messages.info, messages.depth_info,
            wanted=self._outputs.wanted(self._settings.node_config), skipped=skipped)
        self._outputs.publish(fitted.outputs)
        latency_ms = (time.monotonic() - messages.arrival_s) * 1e3
        age_ms = (self._clock.now().nanoseconds - stamp_ns(messages.color.header)) / 1e6
        result = fitted.result
        self._statistics.add_frame(
            len(result.bodies), latency_ms, age_ms, result.times_ms, result.statuses)

    def _clear(self) -> None:
        if self._fitter is not None:
            wanted = self._outputs.wanted(self._settings.node_config)
            self._outputs.publish(self._fitter.clear(wanted))

    def _configure(self) -> None:
        if self._fitter is not None:
            self._fitter.configure(self._settings.pipeline_config, self._settings.node_config)
            self._configure_finding()

    def _configure_finding(self) -> None:
        self._looking.configure(self._settings.pipeline_config)
        for process in (self._finding, self._searching):
            process.configure(self._settings.pipeline_config)
            if self._settings.node_config.tracking.enabled:
                process.start()

    def _reset(self) -> None:
        if self._fitter is not None:
            self._fitter.reset()

    def _snapshot(self, folder: Path) -> tuple[bool, str]:
        if self._fitter is None or self._latest is None:
            return False, NO_FRAME
        frame, result = self._latest.frame, self._latest.result
        try:
            written = save_snapshot(
                folder, frame, self._fitter.detect(frame), result, self._fitter.model)
        except Exception as error:  # noqa: BLE001 - whoever asked waits for an answer
            return False, str(error) or type(error).__name__
        return True, str(written)

    def _on_error(self, error: Exception) -> None:
        if self._fitter is None:
            self.failure = error
            return
        reason = drop_reason(error)
        is_fault = not isinstance(error, PopError)
        if not self._statistics.add_refusal(reason, str(error), is_fault=is_fault):
            return
        # rclpy refuses a second severity at one place of the code.
        if is_fault:
            self._log.error(f'frame failed ({reason}): {error}')
        else:
            self._log.warning(f'frame dropped ({reason}): {error}')
