"""Options of commands that fit people with files of the user's."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

BodyFile = Annotated[Path | None, typer.Option(
    '--body', metavar='FILE', help='Body model made by "pop body import".')]
LibraryFile = Annotated[Path | None, typer.Option(
    '--library', metavar='FILE', help='Pose library made by "pop library build".')]
