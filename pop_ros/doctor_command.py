"""`pop doctor`: what the node depends on, how it is, and what to do."""

from __future__ import annotations

import typer


def doctor() -> None:
    """Check middleware, shared memory, caches, message packages and cameras; say what to do."""
    from pop_ros.doctor import Verdict, examine

    bad = 0
    for finding in examine():
        typer.echo(f'{finding.verdict.value:5} {finding.subject}: {finding.text}')
        if finding.advice:
            typer.echo(f'      -> {finding.advice}')
        bad += finding.verdict is Verdict.BAD
    if bad:
        raise typer.Exit(1)
