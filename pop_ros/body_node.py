"""The node `pop` itself: inputs, worker, outputs, parameters, services, diagnostics.

Callbacks only store; one worker thread fits the newest pair and publishes. The executor is
single-threaded because rclpy's multi-threaded one spends a core on waiting.
"""

from __future__ import annotations

import threading
import time

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos_overriding_options import QoSOverridingOptions
from std_srvs.srv import SetBool, Trigger

from pop_core.body.model import BodyModel
from pop_core.config import PipelineConfig
from pop_core.errors import PopError
from pop_ros.body_messages import OUTPUT_TYPES, TF
from pop_ros.diagnostics import diagnostic_array
from pop_ros.explanation import explain_missing_pairs
from pop_ros.frame_fitter import FrameFitter
from pop_ros.from_messages import stamp_ns
from pop_ros.inputs import RgbdInputs, RgbdMessages
from pop_ros.node_arguments import SourceArguments
from pop_ros.node_config import NodeConfig
from pop_ros.parameters import ConfigParameters
from pop_ros.pop_messages import model_message, pop_msgs
from pop_ros.qos import output_qos, static_tf_qos
from pop_ros.static_frames import StaticFrames
from pop_ros.statistics import NodeStatistics, Snapshot, drop_reason
from pop_ros.tf_messages import tf2_msgs
from pop_ros.to_messages import make_header
from pop_ros.worker import Worker

POLL_S = 0.05
FOLLOW_S = 0.25
REPORT_S = 1.0
SILENCE_S = 5.0
PROGRESS_STEP = 0.1
STOP_S = 5.0  # patience with the frame in work at shutdown
REPLACED = 'replaced by a newer pair'


class PopNode(Node):
    """Fits people to paired RGB-D images and publishes them."""

    def __init__(self, arguments: SourceArguments) -> None:
        """Declare parameters and publishers; inputs are subscribed once the worker is ready.

        Raises:
            SettingError: If a parameter given at start does not fit.
        """
        super().__init__('pop')
        self.log = self.get_logger()  # type: ignore[no-untyped-call]
        self.failure: Exception | None = None
        self._arguments = arguments
        self._changed, self._restart = threading.Event(), threading.Event()
        self._settings = ConfigParameters(
            self, NodeConfig(), PipelineConfig(), self._on_settings)
        self._statistics = NodeStatistics()
        self._previous: Snapshot | None = None
        self._trouble = ''
        self._said_share = 0.0
        self._fitter: FrameFitter | None = None
        self._frames = StaticFrames()
        if tf2_msgs is not None:
            self.create_subscription(
                tf2_msgs.TFMessage, '/tf_static', self._frames.add_message, static_tf_qos())
        self._inputs = RgbdInputs(self, self._config.sync.slop_s, self._on_frame)
        self._outputs = {
            name: self.create_publisher(
                kind, '/tf' if name == TF else f'~/{name}', output_qos(),
                qos_overriding_options=QoSOverridingOptions.with_default_policies())
            for name, kind in OUTPUT_TYPES.items()
        }
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self.create_service(SetBool, '~/enable', self._on_enable)
        self.create_service(Trigger, '~/reset', self._on_reset)
        self._worker: Worker[RgbdMessages] = Worker(self._fit, self._on_error, self._prepare)
        self._worker.start()
        self._warn_of_missing_tf()
        # Steady timers: a simulated clock that stands still must not silence the node.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(POLL_S, self._inputs.poll, clock=steady)
        self.create_timer(FOLLOW_S, self._follow, clock=steady)
        self.create_timer(REPORT_S, self._report, clock=steady)

    def stop(self) -> bool:
        """End the worker; return whether the frame in work was finished in time."""
        return self._worker.stop(STOP_S)

    @property
    def _config(self) -> NodeConfig:
        return self._settings.node_config

    # Executor thread

    def _on_settings(self) -> None:
        self._changed.set()
        self._warn_of_missing_tf()
        if round(self._config.sync.slop_s * 1e9) != self._inputs.pairer.slop_ns:
            self._inputs.reset(self._config.sync.slop_s)

    def _warn_of_missing_tf(self) -> None:
        if self._config.tf.frames != 'off' and TF not in self._outputs:
            self.log.warning('tf.frames: tf2_msgs is not installed, nothing goes to /tf')

    def _on_enable(
        self, request: SetBool.Request, response: SetBool.Response
    ) -> SetBool.Response:
        wish = Parameter('enabled', value=request.data)  # type: ignore[no-untyped-call]
        result, = self.set_parameters([wish])
        response.success, response.message = result.successful, result.reason
        return response

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._inputs.reset(self._config.sync.slop_s)
        self._restart.set()
        response.success, response.message = True, 'pending images dropped, ids start anew'
        return response

    def _follow(self) -> None:
        """Subscribe while the worker is ready and somebody listens."""
        if self._fitter is None:
            return
        if self._is_wanted():
            self._inputs.follow(self._config.input.reliability)
        else:
            self._inputs.leave()

    def _is_wanted(self) -> bool:
        return self._config.enabled and (not self._config.lazy or bool(self._wanted()))

    def _wanted(self) -> list[str]:
        tf_off = {TF} if self._config.tf.frames == 'off' else set()
        return [
            name for name, publisher in self._outputs.items() if name not in tf_off
            and (not self._config.lazy or publisher.get_subscription_count())]

    def _on_frame(self, messages: RgbdMessages) -> None:
        self._statistics.add_pair()
        if self._worker.mailbox.put(messages):
            self._statistics.add_drop(REPLACED, 'the worker was busy with an older pair')

    def _report(self) -> None:
        reports = self._inputs.reports()
        silence_s = time.monotonic() - self._inputs.last_frame_s
        waits = self._fitter is not None and self._is_wanted() and silence_s > SILENCE_S
        trouble = (
            explain_missing_pairs(reports, self._inputs.pairer, silence_s) if waits else '')
        if trouble and not self._trouble:
            self.log.warning(trouble)
        self._trouble = trouble
        snapshot = self._statistics.snapshot()
        self._diagnostics.publish(diagnostic_array(
            make_header(self.get_clock().now().nanoseconds, ''),
            self.get_fully_qualified_name(), snapshot, previous=self._previous,
            pairer=self._inputs.pairer, reports=reports, trouble=trouble))
        self._previous = snapshot

    # Worker thread

    def _prepare(self) -> None:
        started_s = time.monotonic()
        self.log.info(
            f'preparing (keypoints: {self._arguments.keypoints}); the first start generates the '
            'pose library and compiles kernels, later ones read them from the cache')
        fitter = FrameFitter(
            self._arguments, self._settings.pipeline_config, self._config,
            self._say_progress, self._frames)
        self._fitter = fitter
        self._publish_model(fitter.model)
        self.log.info(f'ready after {time.monotonic() - started_s:.1f} s')

    def _publish_model(self, model: BodyModel) -> None:
        """Latch what a receiver of ~/bodies needs to know, where pop_msgs is installed."""
        if pop_msgs is None:
            self.log.info('pop_msgs is not installed: no ~/bodies and no ~/body_model')
            return
        header = make_header(self.get_clock().now().nanoseconds, '')
        publisher = self.create_publisher(
            pop_msgs.BodyModel, '~/body_model', output_qos(latched=True))
        publisher.publish(model_message(model, header))

    def _say_progress(self, share: float, sentence: str) -> None:
        if share >= self._said_share + PROGRESS_STEP:
            self._said_share = share
            self.log.info(f'{share:.0%} {sentence}')

    def _fit(self, messages: RgbdMessages) -> None:
        assert self._fitter is not None
        if self._changed.is_set():
            self._changed.clear()
            self._fitter.configure(self._settings.pipeline_config, self._config)
        if self._restart.is_set():
            self._restart.clear()
            self._fitter.reset()
        fitted = self._fitter.fit(
            messages.color, messages.depth, messages.info, messages.depth_info,
            wanted=self._wanted())
        for name, message in fitted.outputs:
            self._outputs[name].publish(message)
        latency_ms = (time.monotonic() - messages.arrival_s) * 1e3
        age_ms = (self.get_clock().now().nanoseconds - stamp_ns(messages.color.header)) / 1e6
        result = fitted.result
        self._statistics.add_frame(len(result.bodies), latency_ms, age_ms, result.times_ms)

    def _on_error(self, error: Exception) -> None:
        if self._fitter is None:
            self.failure = error
            return
        reason = drop_reason(error)
        if self._statistics.add_drop(reason, str(error)):
            say = self.log.warning if isinstance(error, PopError) else self.log.error
            say(f'frame dropped ({reason}): {error}')
