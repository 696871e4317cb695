"""Arguments that several benchmarks take."""

from __future__ import annotations

import argparse


def positive(text: str) -> int:
    """Return a number of things, at least one.

    Raises:
        argparse.ArgumentTypeError: If the text is none.
    """
    if text.isascii() and text.isdigit() and int(text) > 0:
        return int(text)
    raise argparse.ArgumentTypeError(f'expected a number of at least 1, found {text!r}')
