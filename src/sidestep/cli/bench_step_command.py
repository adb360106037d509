"""`sidestep bench step` and `sidestep bench compare`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sidestep.cli.output import console, write_json


def step(
    steps: Annotated[
        int, typer.Option(min=1, help="Steps per row, unless the time is over before.")
    ] = 1_000_000,
    seconds: Annotated[float, typer.Option(min=0.001, help="Longest time per row [s].")] = 10.0,
    robot: Annotated[str, typer.Option(help="A name from `sidestep robots`.")] = "fr3",
    points: Annotated[
        str, typer.Option(metavar="N,N,...", help="Numbers of points around the whole arm.")
    ] = "1,100,1000,10000,100000",
    seed: Annotated[int, typer.Option(min=0, help="Seed of states, goals and points.")] = 0,
    json: Annotated[
        str | None,
        typer.Option("--json", metavar="FILE|-", help="Write figures as JSON; '-' for stdout."),
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Times one control step: Table 6.1 of the thesis, and the whole arm among clouds of points.

    Every row on one core, from C++ (around each step of a motion) and from Python. Motions go between places with
    3 cm of clearance, as far as there are any. The filter holds limits and clearances by a quadratic program.
    """
    from rich import box
    from rich.table import Table

    from sidestep.bench import StepSettings, run_step_bench

    try:
        numbers = tuple(int(n) for n in points.split(","))
    except ValueError:
        raise ValueError(f"--points is '{points}', must be numbers with commas between") from None
    settings = StepSettings(steps=steps, seconds=seconds, robot=robot, points=numbers, seed=seed)
    terminal = console(quiet=quiet, to_stderr=json == "-")
    with terminal.status("") as status:
        document = run_step_bench(
            settings, progress=lambda done, in_all, name: status.update(f"{done + 1} of {in_all}: {name}")
        )
    table = Table(box=box.SIMPLE, pad_edge=False, title=f"{document['cpu']}, {document['instruction_set']}")
    table.add_column("one step [us]", no_wrap=True)
    for name in ("", "median", "p99", "p99.9", "max", "steps/s"):
        table.add_column(name, justify="right")
    for row in document["results"]:
        times = [f"{row[f'{name}_us']:.2f}" for name in ("median", "p99", "p99.9", "max")]
        table.add_row(row["name"], row["language"], *times, f"{row['steps_per_s']:,.0f}")
    terminal.print(table)
    if json is not None:
        write_json(document, json)


def compare(
    before: Annotated[Path, typer.Argument(exists=True, dir_okay=False, help="Result of `bench step`.")],
    after: Annotated[Path, typer.Argument(exists=True, dir_okay=False, help="Result of `bench step`.")],
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Compares the medians of two results of `sidestep bench step`, row by row."""
    from json import loads

    from rich import box
    from rich.table import Table

    from sidestep.bench import compare_steps

    rows = compare_steps(loads(before.read_text("utf-8")), loads(after.read_text("utf-8")))
    table = Table(box=box.SIMPLE, pad_edge=False)
    table.add_column("median of one step [us]", no_wrap=True)
    for name in ("", "before", "after", "after/before"):
        table.add_column(name, justify="right")
    for row in rows:
        table.add_row(
            row["name"],
            row["language"],
            f"{row['before_us']:.2f}",
            f"{row['after_us']:.2f}",
            f"{row['ratio']:.2f}",
        )
    console(quiet=quiet).print(table)
