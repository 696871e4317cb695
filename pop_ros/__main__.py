"""The program `pop`: its command line, and a clean end for whoever stops it while it starts."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable

INTERRUPTED = 130  # as shells say it: 128 and the number of SIGINT


def main() -> None:
    """Run the command line; Ctrl-C ends it without a traceback, also while modules load."""
    try:
        _load()()
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)


def _load() -> Callable[[], None]:
    """Return the command line; until it is there Ctrl-C ends the program at once.

    An exception in the middle of an import may be swallowed there, and the program would go on.
    """
    usual = signal.getsignal(signal.SIGINT)
    if usual is not signal.SIG_IGN:  # of a job in the background
        signal.signal(signal.SIGINT, lambda *_: os._exit(INTERRUPTED))
    from pop_ros.cli import main as run

    signal.signal(signal.SIGINT, usual)
    return run


if __name__ == '__main__':
    main()
