"""Progress bars on the terminal; a pipe or a log file gets none."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import Progress


def terminal_progress() -> Progress:
    """Return a progress display on standard error that leaves nothing behind."""
    console = Console(stderr=True)
    return Progress(console=console, transient=True, disable=not console.is_terminal)


@contextmanager
def first_use_progress() -> Iterator[Callable[[float, str], None]]:
    """Show a bar from the first report on: what is read from the cache reports nothing."""
    with terminal_progress() as display:
        task = display.add_task('', total=1.0, visible=False)

        def told(share: float, sentence: str) -> None:
            display.update(task, completed=share, description=sentence, visible=True)

        yield told
