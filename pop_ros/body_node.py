"""The node `pop` itself: life cycle, inputs, worker, outputs, parameters, services, diagnostics.

Callbacks only store; a worker thread fits the newest pair and publishes, and has other processes
ask the keypoint source and find people meanwhile. The executor is single-threaded because rclpy's
multi-threaded one spends a core on waiting.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool, Trigger

from pop_core.config import PipelineConfig
from pop_core.errors import PopError
from pop_ros.frame_work import FrameWork
from pop_ros.health import NodeHealth
from pop_ros.inputs import RgbdInputs, RgbdMessages
from pop_ros.keypoint_sources import reasons
from pop_ros.node_arguments import NodeArguments
from pop_ros.node_config import NodeConfig
from pop_ros.node_outputs import NodeOutputs
from pop_ros.parameters import ConfigParameters
from pop_ros.qos import static_tf_qos
from pop_ros.static_frames import StaticFrames
from pop_ros.statistics import NodeStatistics
from pop_ros.tf_messages import tf2_msgs

POLL_S = 0.05
FOLLOW_S = 0.25
REPORT_S = 1.0
STOP_S = 5.0  # patience at shutdown with the frame in work


class PopNode(LifecycleNode):
    """Fits people to paired RGB-D images and publishes them.

    Unconfigured it has parameters only; configuring loads keypoint source, body and library;
    active it subscribes the camera and works for whoever listens.
    """

    def __init__(self, arguments: NodeArguments) -> None:
        """Declare parameters, topics and services.

        Raises:
            SettingError: If a parameter given at start does not fit.
        """
        super().__init__('pop')
        self.log = self.get_logger()  # type: ignore[no-untyped-call]
        self.refusal: PopError | None = None
        self._arguments = arguments
        self._work: FrameWork | None = None
        self._is_active = False
        self._settings = ConfigParameters(
            self, NodeConfig(), PipelineConfig(), self._on_settings)
        self._statistics = NodeStatistics()
        self._frames = StaticFrames()
        if tf2_msgs is not None:
            self.create_subscription(
                tf2_msgs.TFMessage, '/tf_static', self._on_static_frames, static_tf_qos())
        self._inputs = RgbdInputs(self, self.config.sync.slop_s, self._on_frame)
        self._outputs = NodeOutputs(self)
        self._health = NodeHealth(self, self._inputs, self._statistics)
        self.create_service(SetBool, '~/enable', self._on_enable)
        self.create_service(Trigger, '~/reset', self._on_reset)
        # In a group of its own: while it waits for the worker, timers and inputs go on.
        self.create_service(
            Trigger, '~/snapshot', self._on_snapshot, callback_group=ReentrantCallbackGroup())
        # Steady timers: a simulated clock that stands still must not silence the node.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(POLL_S, self._inputs.poll, clock=steady)
        self.create_timer(FOLLOW_S, self._follow, clock=steady)
        self.create_timer(REPORT_S, self._report, clock=steady)

    @property
    def config(self) -> NodeConfig:
        """Return the node's settings as they are now."""
        return self._settings.node_config

    @property
    def failure(self) -> Exception | None:
        """Return what makes it pointless to go on, or None."""
        return self._work.failure if self._work is not None else None

    def start(self) -> None:
        """Configure and activate, unless a manager of life cycles is to do it.

        Raises:
            PopError: If keypoint source, body or library cannot be read.
        """
        if not self.config.autostart:
            self.log.info('unconfigured: waiting for a manager of life cycles')
            return
        self.trigger_configure()  # type: ignore[no-untyped-call]
        if self.refusal is not None:
            raise self.refusal
        self.trigger_activate()  # type: ignore[no-untyped-call]

    def stop(self) -> bool:
        """End the worker; return whether the frame in work was finished in time."""
        work, self._work = self._work, None
        return True if work is None else work.stop(STOP_S)

    # Life cycle; rclpy takes an exception for an error and says nothing of it.

    def on_configure(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Check source, body and library, then load and compile in the worker's thread."""
        try:
            detector = self._arguments.sources.detector()
            self._arguments.models.check()
        except PopError as error:
            self.refusal = error
            self.log.error(f'not configured: {error}')
            return TransitionCallbackReturn.FAILURE
        self.refusal = None
        for text in (*reasons(detector), *self._outputs.missing):
            self.log.info(text)
        self._work = FrameWork(
            self, self._settings, self._arguments, self._frames, self._outputs, self._statistics)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Subscribe the camera as soon as somebody listens."""
        self._is_active = True
        self._follow()
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Unsubscribe, and remove the people that are shown."""
        self._is_active = False
        self._follow()
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Forget what was loaded."""
        return self._end_work()

    def on_shutdown(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """End the work; the process stays until it is told to end."""
        self._is_active = False
        return self._end_work()

    def _end_work(self) -> TransitionCallbackReturn:
        self._inputs.leave()
        if self.stop():
            return TransitionCallbackReturn.SUCCESS
        self.log.error(f'the frame in work did not end within {STOP_S:.0f} s')
        return TransitionCallbackReturn.ERROR

    # Services and parameters

    def _on_settings(self) -> None:
        if self._work is not None:
            self._work.configure()
        if round(self.config.sync.slop_s * 1e9) != self._inputs.pairer.slop_ns:
            self._inputs.reset(self.config.sync.slop_s)
        self._follow()

    def _on_enable(
        self, request: SetBool.Request, response: SetBool.Response
    ) -> SetBool.Response:
        wish = Parameter('enabled', value=request.data)  # type: ignore[no-untyped-call]
        result, = self.set_parameters([wish])
        response.success, response.message = result.successful, result.reason
        return response

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._inputs.reset(self.config.sync.slop_s)
        if self._work is not None:
            self._work.reset()
        response.success, response.message = True, 'pending images dropped, ids start anew'
        return response

    async def _on_snapshot(
        self, _: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        if self._work is None:
            response.success, response.message = False, 'the node is not configured'
            return response
        written = self._work.snapshot(Path(self.config.snapshot.folder))
        response.success, response.message = await written
        return response

    # Timers and inputs

    def _follow(self) -> None:
        """Subscribe while the worker is ready and somebody listens."""
        if self._work is None:
            return
        self._work.run(self._is_active and self.config.enabled)
        if self._work.is_ready and self._is_wanted():
            self._inputs.follow(self.config.input.reliability)
        else:
            self._inputs.leave()

    def _is_wanted(self) -> bool:
        is_on = self._is_active and self.config.enabled
        return is_on and (not self.config.lazy or bool(self._outputs.wanted(self.config)))

    def _on_static_frames(self, message: Any) -> None:
        for text in self._frames.add_message(message):
            self.log.warning(text)

    def _on_frame(self, messages: RgbdMessages) -> None:
        if self._work is not None:
            self._work.put(messages)

    def _report(self) -> None:
        doing = '' if self._work is None else self._work.doing
        waits = self._work is not None and self._work.is_ready and self._is_wanted()
        _, state = self._state_machine.current_state
        looking_s = 0.0 if self._work is None else self._work.looking_s
        self._health.report(
            self.config.diagnostics, state=state, doing=doing, waits=waits, looking_s=looking_s)
