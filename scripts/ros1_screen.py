"""A ROS 1 graph with rviz on a screen of its own, from Debian's packages."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

PROGRAMS = ('roscore', 'rosbag', 'rostopic', 'rviz', 'Xvfb', 'import')
PACKAGES = 'rviz ros-core python3-rosbag xvfb imagemagick libgl1-mesa-dri'


def missing_programs() -> list[str]:
    """Return the programs that are needed and not installed."""
    return [name for name in PROGRAMS if shutil.which(name) is None]


@dataclass
class Ros1Screen:
    """A ROS master and an X server, both this test's own.

    Args:
        environment: For every program that is to see both.
        log: File that the programs write to.
        size: Width and height of the screen.
    """

    environment: dict[str, str]
    log: Path
    size: tuple[int, int]
    _running: list[subprocess.Popen[bytes]] = field(default_factory=list)

    def start(self, *command: object) -> subprocess.Popen[bytes]:
        """Start a program; it ends with the screen."""
        with self.log.open('ab') as log:
            process = subprocess.Popen(
                list(map(str, command)), env=self.environment, stdout=log, stderr=log,
                start_new_session=True)
        self._running.append(process)
        return process

    def ask(self, *command: object) -> str:
        """Return what a program says, whatever its exit code."""
        return subprocess.run(
            list(map(str, command)), env=self.environment, capture_output=True, text=True,
            timeout=30, check=False).stdout

    def wait_for(self, done: Callable[[], bool], what: str, timeout_s: float = 60.0) -> None:
        """Wait until something is done; fail with the programs' last words."""
        end_s = time.monotonic() + timeout_s
        while not done():
            told = self.log.read_text(errors='replace')[-3000:]
            assert time.monotonic() < end_s, f'no {what} within {timeout_s} s:\n{told}'
            time.sleep(0.25)

    def photograph(self, path: Path) -> np.ndarray:
        """Return the screen as RGB."""
        subprocess.run(
            ['import', '-window', 'root', str(path)], env=self.environment, check=True, timeout=60)
        return cv2.cvtColor(cv2.imread(str(path)), cv2.COLOR_BGR2RGB)

    def stop(self) -> None:
        """End all programs."""
        for process in reversed(self._running):  # the X server last
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGINT)
            try:
                process.wait(8)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait(8)


@contextmanager
def ros1_screen(folder: Path, size: tuple[int, int]) -> Iterator[Ros1Screen]:
    """Run a ROS master and an X server on addresses that nobody else uses."""
    port = _free_port()
    # ROS 2 and virtual environments of the caller must not reach into Debian's Python.
    plain = {k: v for k, v in os.environ.items()
             if not k.startswith(('PYTHON', 'ROS_', 'AMENT_', 'VIRTUAL_ENV', 'LD_LIBRARY'))}
    screen = Ros1Screen(
        {**plain, 'ROS_MASTER_URI': f'http://localhost:{port}', 'ROS_HOSTNAME': 'localhost',
         'HOME': str(folder), 'LIBGL_ALWAYS_SOFTWARE': '1', 'QT_X11_NO_MITSHM': '1',
         'PATH': os.pathsep.join(['/usr/bin', '/bin', '/usr/local/bin'])},
        folder / 'programs.log', size)
    screen.log.touch()
    try:
        screen.environment['DISPLAY'] = _start_x(screen, folder)
        screen.start('roscore', '-p', port)
        screen.wait_for(lambda: '/rosout' in screen.ask('rostopic', 'list'), 'ROS master')
        yield screen
    finally:
        screen.stop()


def _start_x(screen: Ros1Screen, folder: Path) -> str:
    """Start an X server on a display that it chooses itself; return its name."""
    chosen = folder / 'display'
    with chosen.open('wb') as file:
        process = subprocess.Popen(
            ['Xvfb', '-displayfd', '1', '-screen', '0', '{}x{}x24'.format(*screen.size)],
            stdout=file, stderr=subprocess.DEVNULL, env=screen.environment,
            start_new_session=True)
    screen._running.append(process)
    screen.wait_for(lambda: chosen.read_text().endswith('\n'), 'X server')
    return f':{chosen.read_text().strip()}'


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(('localhost', 0))
        return int(probe.getsockname()[1])
