"""The node in a process of its own, for replays."""

from __future__ import annotations

import signal
import subprocess
import sys

from pop_core.errors import PopError
from pop_ros.node_arguments import NodeArguments
from pop_ros.replay_settings import SLOP, ReplaySettings

STOP_S = 15.0


class ReplayError(PopError):
    """A node that does not come up, or ends while a bag is played."""


class NodeProcess:
    """The node in a process of its own."""

    def __init__(
        self, arguments: NodeArguments, settings: ReplaySettings, slop_s: float, *,
        use_sim_time: bool = False,
    ) -> None:
        """Start it; it inherits the environment, so both sides share domain and RMW."""
        command = [
            sys.executable, '-m', 'pop_ros.node', *arguments.as_flags(), '--ros-args',
            *settings.as_ros_arguments(), '-p', f'{SLOP}:={slop_s:.9f}']
        if use_sim_time:
            command += ['-p', 'use_sim_time:=true']
        # A group of its own: Ctrl-C ends the replay, which lets the node finish its frame.
        self._process = subprocess.Popen(command, start_new_session=True)

    def check(self) -> None:
        """Raise ReplayError if it has ended."""
        code = self._process.poll()
        if code is not None:
            raise ReplayError(f'replay: expected the node to run, found that it ended with {code}')

    def stop(self) -> int:
        """Ask it to end as Ctrl-C does; return its exit code."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
        try:
            return self._process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            return self._process.wait()
