"""A bar that counts the problems of a benchmark."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

if TYPE_CHECKING:
    from rich.console import Console

Result = TypeVar("Result")


def with_bar(
    terminal: Console, title: str, run: Callable[[Callable[[int, int, str], None]], Result]
) -> Result:
    """What `run` returns; it is given a function to call with how many are done, of all, and a word."""
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("[dim]{task.fields[last]}"),
        console=terminal,
        transient=True,
    )
    with bar:
        task = bar.add_task(title, total=None, last="")

        def show(done: int, in_all: int, last: str) -> None:
            bar.update(task, completed=done, total=in_all, last=last)

        return run(show)
