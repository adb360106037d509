"""`sidestep reproduce`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sidestep.cli.output import JsonOption, QuietOption, console, write_json


def reproduce(
    out: Annotated[Path, typer.Option("--out", "-o", help="Report folder.")] = Path(
        "sidestep-report-reproduce"
    ),
    only: Annotated[
        list[str] | None,
        typer.Option(help="A figure, table, section or chapter: 5.1, table-6.1, A.1, 5. May be repeated."),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Fewer samples and runs: about a minute instead of several.")
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of everything that is drawn.")] = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Run the experiments of the thesis with the correct equations, and write them as a web page.

    Figures are PNG and SVG, data CSV or NPZ, all beside index.html, which holds everything itself.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from sidestep.thesis.reproduce import Part, Settings
    from sidestep.thesis.reproduce import reproduce as run
    from sidestep.thesis.reproduce.registry import select

    parts = select(only or [])
    terminal = console(quiet=quiet, to_stderr=json == "-")
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("[dim]{task.fields[doing]}"),
        console=terminal,
        transient=True,
    )
    with bar:
        task = bar.add_task("reproducing", total=len(parts), doing="")

        def on_part(part: Part, done: int, total: int) -> None:
            bar.update(task, completed=done, total=total, doing=f"{part.key} {part.title}")

        outcome = run(
            out,
            only=only or [],
            settings=Settings(quick=quick, seed=seed, notify=lambda text: bar.update(task, doing=text)),
            on_part=on_part,
        )
    seconds = sum(outcome.seconds.values())
    terminal.print(
        f"[green]✓[/green] {len(outcome.items)} figures and tables in {seconds:.0f} s", highlight=False
    )
    terminal.print(f"Report: {outcome.page}", highlight=False, soft_wrap=True)
    if json is not None:
        write_json(
            {
                "page": str(outcome.page),
                "items": {name: item.title for name, item in outcome.items.items()},
                "seconds": outcome.seconds,
            },
            json,
        )
