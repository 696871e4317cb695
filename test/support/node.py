"""The node in a process of its own, as a user starts it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


class RunningNode:
    """A node process whose output is kept."""

    def __init__(self, *arguments: str, module: str = 'pop_ros.node') -> None:
        env = {**os.environ, 'PYTHONPATH': os.pathsep.join(
            [str(ROOT), *filter(None, [os.environ.get('PYTHONPATH')])])}
        self.process = subprocess.Popen(
            [sys.executable, '-m', module, *arguments], env=env, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self._lines: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def output(self) -> str:
        return ''.join(self._lines)

    def wait_for(self, text: str, timeout_s: float = 120.0) -> None:
        end_s = time.monotonic() + timeout_s
        while text not in self.output:
            assert time.monotonic() < end_s, f'no {text!r} in:\n{self.output}'
            assert self.process.poll() is None or text in self.output, self.output
            time.sleep(0.02)

    def end(self, number: signal.Signals = signal.SIGINT) -> int:
        """Send a signal and return the exit code."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        code = self.wait()
        self._reader.join(5)
        return code

    def wait(self, timeout_s: float = 30.0) -> int:
        try:
            return self.process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._lines.append(line)
