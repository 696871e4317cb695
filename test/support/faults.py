"""Work that fails, wherever it is done."""

import time
from typing import NoReturn


def divide_by_zero(*_: object) -> NoReturn:
    """Raise an error that nobody expects."""
    raise ZeroDivisionError('division by zero')


def take_for_ever(*_: object) -> None:
    """Take longer than anybody waits."""
    time.sleep(600.0)


class TwoPartsError(Exception):
    """An error that pickle cannot make again: it keeps its text, and wants its parts."""

    def __init__(self, one: str, other: str) -> None:
        super().__init__(f'of {one} and {other}')


def fail_in_two_parts(*_: object) -> NoReturn:
    """Raise an error that does not survive being sent."""
    raise TwoPartsError('this', 'that')
