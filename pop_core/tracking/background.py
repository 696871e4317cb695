"""Work beside the following of people."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Protocol, TypeVar, runtime_checkable

AnswerT = TypeVar('AnswerT')


@runtime_checkable
class Background(Protocol):
    """Whoever works meanwhile, one thing after the other, with a pipeline of the same settings."""

    def submit(self, work: Callable[..., AnswerT], *inputs: Any) -> Future[AnswerT]:
        """Begin `work(pipeline, *inputs)`."""
        ...
