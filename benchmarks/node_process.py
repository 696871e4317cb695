"""The node as a process that is watched: memory, processor time, and how it ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

TICKS = os.sysconf('SC_CLK_TCK')
STOP_S = 30.0


class WatchedNode:
    """A node whose use of memory and processor Linux tells."""

    def __init__(self, source: str, folder: Path, *ros_arguments: str) -> None:
        """Start it.

        Args:
            source: Where keypoints come from, as `--keypoints` names it.
            folder: Files of the film's keypoints, for the source `json`.
            ros_arguments: What follows `--ros-args`.
        """
        files = ['--keypoints-dir', str(folder)] if source == 'json' else []
        command = [sys.executable, '-m', 'pop_ros.node', '--keypoints', source, *files,
                   '--ros-args', *ros_arguments]
        self.started_s = time.monotonic()
        self._process = subprocess.Popen(command)

    def check(self) -> None:
        """Raise if it has ended."""
        if self._process.poll() is not None:
            raise RuntimeError(f'the node ended with {self._process.returncode}')

    @property
    def memory_mb(self) -> float:
        """Return the memory of the node and of the processes that it starts [MB].

        Pages that they share are counted once (Linux's proportional set size).
        """
        return sum(_proportional_kb(files) for files in self._files()) / 1e3

    @property
    def cpu_s(self) -> float:
        """Return the processor time that all have used so far [s]."""
        used = 0
        for files in self._files():
            fields = (files / 'stat').read_text().rsplit(')', 1)[1].split()
            used += int(fields[11]) + int(fields[12])
        return used / TICKS

    def _files(self) -> list[Path]:
        node = Path('/proc') / str(self._process.pid)
        # Any of the node's threads may have started the other processes.
        started = [(task / 'children').read_text().split() for task in node.glob('task/*')]
        return [node, *(node.parent / pid for pids in started for pid in pids)]

    def stop(self) -> tuple[int, float]:
        """End it as Ctrl-C does; return its exit code and how long that took [s]."""
        started_s = time.monotonic()
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
        try:
            code = self._process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            code = self._process.wait()
        return code, time.monotonic() - started_s


def _proportional_kb(process: Path) -> int:
    lines = (process / 'smaps_rollup').read_text().splitlines()
    # A process that ends has no memory left to tell of.
    return sum(int(line.split()[1]) for line in lines if line.startswith('Pss:'))
