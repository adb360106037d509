"""A bar that counts images of a recording, of which perhaps nobody knows how many there are."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from sidestep.cli.output import lines_without_terminal

if TYPE_CHECKING:
    from rich.console import Console


@contextmanager
def counted(terminal: Console, title: str, images: object) -> Iterator[Callable[[int], None]]:
    """Gives a function to call with the number of images so far; their number is `len(images)` where that is known."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    total = len(images) if hasattr(images, "__len__") else None
    columns = (TextColumn("{task.description}"), BarColumn(bar_width=24), MofNCompleteColumn())
    told = lines_without_terminal(terminal)
    with Progress(*columns, TimeRemainingColumn(), console=terminal, transient=True) as bar:
        task = bar.add_task(title, total=total)

        def tell(number: int) -> None:
            bar.update(task, completed=number)
            told(f"{title}: {number}" + ("" if total is None else f" of {total}") + " images")

        yield tell
