"""The program `pop`: its command line, and a clean end for whoever stops it while it starts."""

from __future__ import annotations

import sys

INTERRUPTED = 130  # as shells say it: 128 and the number of SIGINT


def main() -> None:
    """Run the command line; Ctrl-C ends it without a traceback, also while modules load."""
    try:
        from pop_ros.cli import main as run
        run()
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)


if __name__ == '__main__':
    main()
