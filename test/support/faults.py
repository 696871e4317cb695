"""Work that fails, wherever it is done."""

import time
from typing import NoReturn


def divide_by_zero(*_: object) -> NoReturn:
    """Raise an error that nobody expects."""
    raise ZeroDivisionError('division by zero')


def take_for_ever(*_: object) -> None:
    """Take longer than anybody waits."""
    time.sleep(600.0)
