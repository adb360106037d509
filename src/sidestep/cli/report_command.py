"""`sidestep report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sidestep.cli.output import JsonOption, QuietOption, console, write_json

MOST_EVENTS = 12  # lines printed; the page has them all


def report(
    recordings: Annotated[
        list[Path],
        typer.Argument(
            exists=True,
            help="A recording (.mcap); or the files of one black box, or a folder with its newest.",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="The page, or a picture (.png) [default: beside the file]."),
    ] = None,
    csv: Annotated[Path | None, typer.Option(help="One row per step, for spreadsheets and pandas.")] = None,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Report on a run of one's own: clearance by link, torque and velocity against limits, status, and why.

    Reads what `Controller.record`, the variable SIDESTEP_RECORD or a black box wrote, also where the program was
    killed.

    Exit code: 0 when the page is written, 1 when the file is damaged (the page shows what is before), 2 on bad input.
    """
    from sidestep.report import load_recording
    from sidestep.report.recorded_page import sentence, summary

    terminal = console(quiet=quiet, to_stderr=json == "-")
    run = load_recording(recordings if len(recordings) > 1 else recordings[0])
    target = run.plot(output or _beside(recordings[0]))
    if csv is not None:
        run.save_csv(csv)
    for name, value in summary(run):
        terminal.print(f"{name}: {value}", highlight=False, markup=False, soft_wrap=True)
    for event in run.events[:MOST_EVENTS]:
        line = f"{event.time:10.3f} s  {event.kind}: {event.words}"
        terminal.print(line, highlight=False, markup=False, soft_wrap=True)
    if len(run.events) > MOST_EVENTS:
        terminal.print(f"             and {len(run.events) - MOST_EVENTS} more", highlight=False)
    terminal.print(sentence(run), highlight=False, markup=False, soft_wrap=True)
    terminal.print(
        f"{target}{'' if csv is None else f', {csv}'}", highlight=False, markup=False, soft_wrap=True
    )
    if json is not None:
        events = [{"time": e.time, "step": e.step, "kind": e.kind, "words": e.words} for e in run.events]
        write_json(
            {
                "arm": run.arm.name,
                "steps": len(run),
                "seconds": run.duration,
                "complete": run.complete,
                "lost": run.lost,
                "damage": run.damage or None,
                "summary": dict(summary(run)),
                "events": events,
            },
            json,
        )
    raise typer.Exit(1 if run.damage else 0)


def _beside(path: Path) -> Path:
    return path / "report.html" if path.is_dir() else path.with_suffix(".html")
