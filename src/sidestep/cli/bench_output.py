"""What the commands of `sidestep bench` share: options, a bar that counts problems, tables of figures."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, TypeVar

import typer

from sidestep.bench.method import Method
from sidestep.cli.output import lines_without_terminal

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

Result = TypeVar("Result")

RobotOption: TypeAlias = Annotated[str, typer.Option(help="A name from `sidestep robots`.")]
SizeOption: TypeAlias = Annotated[str, typer.Option(help="Of the images: 848x480 or 424x240.")]
SeedOption: TypeAlias = Annotated[int, typer.Option(min=0, help="Seed of all that is random.")]
MethodOption: TypeAlias = Annotated[Method, typer.Option(help="How the arm is moved.")]
FinerOption: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--finer",
        help="If the arm does not arrive and touches nothing, run again with finer covers of links.",
    ),
]
OwnMethodOption: TypeAlias = Annotated[
    str,
    typer.Option(
        metavar="NAME|FILE",
        help=f"How the arm is moved: {', '.join(Method)}, or a Python file that defines method(robot, problem).",
    ),
]
TorqueOption: TypeAlias = Annotated[
    bool, typer.Option("--torque", help="Under torque control in MuJoCo, not integrated.")
]
SpacingOption: TypeAlias = Annotated[
    float, typer.Option(min=1e-4, help="Distance between points on surfaces [m].")
]
PointRadiusOption: TypeAlias = Annotated[float, typer.Option(min=0.0, help="Radius of those points [m].")]
DurationOption: TypeAlias = Annotated[float, typer.Option(min=0.01, help="Longest time per problem [s].")]
ToleranceOption: TypeAlias = Annotated[
    float,
    typer.Option(
        min=1e-6, help="Largest joint error at arrival [rad]; of prismatic joints a tenth of it [m]."
    ),
]
PeriodOption: TypeAlias = Annotated[float, typer.Option(min=1e-5, help="Control period [s].")]
JobsOption: TypeAlias = Annotated[
    int | None, typer.Option(min=1, help="Processes [default: one per processor].")
]
FailuresOption: TypeAlias = Annotated[
    bool, typer.Option("--failures", help="List the problems that were not solved, and why.")
]
RowSecondsOption: TypeAlias = Annotated[float, typer.Option(min=0.001, help="Longest time per row [s].")]


def method_or_file(text: str) -> Method | Path:
    """A method by its name, or the path of a Python file.

    Raises:
        ValueError: it is neither.
        FileNotFoundError: there is no such file.
    """
    if text in list(Method):
        return Method(text)
    if text.endswith(".py"):
        if not Path(text).is_file():
            raise FileNotFoundError(f"--method: there is no file '{text}'")
        return Path(text)
    raise ValueError(f"--method is {text!r}; allowed: {', '.join(Method)}, or a Python file (.py)")


def with_bar(
    terminal: Console, title: str, run: Callable[[Callable[[int, int, str], None]], Result]
) -> Result:
    """What `run` returns; it is given a function to call with how many are done, of all, and a word.

    Where the output is no terminal, the words are lines, one a second at most.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("[dim]{task.fields[last]}"),
        console=terminal,
        transient=True,
    )
    told = lines_without_terminal(terminal)
    with bar:
        task = bar.add_task(title, total=None, last="")

        def show(done: int, in_all: int, last: str) -> None:
            bar.update(task, completed=done, total=in_all, last=last)
            told(f"{title}: {done} of {in_all}, {last}")

        return run(show)


def with_status(terminal: Console, run: Callable[[Callable[..., None]], Result]) -> Result:
    """What `run` returns; it is given a function to call with a word, or with how many are done, of all, and a word."""
    with terminal.status("") as status:

        def show(*told: Any) -> None:
            status.update(told[0] if len(told) == 1 else f"{told[0] + 1} of {told[1]}: {told[2]}")

        return run(show)


def figures_table(first: str, *figures: str, **options: Any) -> Table:
    """A table with a column of names, which is not wrapped, and columns of figures; units in brackets are printed."""
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=box.SIMPLE, pad_edge=False, **options)
    table.add_column(escape(first), no_wrap=True)
    for name in figures:
        table.add_column(escape(name), justify="right")
    return table
