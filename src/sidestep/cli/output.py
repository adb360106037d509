"""Where the commands write: a rich console for people, JSON for programs."""

from __future__ import annotations

import json
import sys
import time as clock
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

if TYPE_CHECKING:
    from rich.console import Console


LINE_EVERY = 1.0  # [s] between two lines of progress where the output is no terminal


def _writable(target: str | None) -> str | None:
    """The file of --json, if its folder exists: found out now, not after the run."""
    if target is not None and target != "-" and not Path(target).absolute().parent.is_dir():
        raise typer.BadParameter(f"there is no folder {Path(target).parent}")
    return target


JsonOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--json", metavar="FILE|-", callback=_writable, help="Write figures as JSON; '-' for stdout."
    ),
]
QuietOption: TypeAlias = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]


def console(*, quiet: bool = False, to_stderr: bool = False) -> Console:
    """The console of a command; on stderr where stdout carries JSON."""
    from rich.console import Console

    return Console(quiet=quiet, stderr=to_stderr)


def lines_without_terminal(terminal: Console) -> Callable[[str], None]:
    """Prints what it is told as a line, now and then; nothing at a terminal, where bars show it."""
    last = float("-inf")

    def tell(line: str) -> None:
        nonlocal last
        if not terminal.is_terminal and clock.monotonic() - last >= LINE_EVERY:
            terminal.print(line, highlight=False, markup=False, soft_wrap=True)
            last = clock.monotonic()

    return tell


def write_json(document: dict[str, Any] | list[Any], target: str) -> None:
    """Writes a document as JSON to a file, or to stdout for "-"."""
    text = json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    if target == "-":
        sys.stdout.write(text)
    else:
        Path(target).write_text(text, encoding="utf-8")
