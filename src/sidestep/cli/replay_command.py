"""`sidestep replay` and `sidestep bench record`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sidestep.cli.bench_output import figures_table, with_bar
from sidestep.cli.output import JsonOption, QuietOption, console, write_json

if TYPE_CHECKING:
    from rich.console import Console

    from sidestep._core import ReplayResult


def replay(
    recordings: Annotated[
        list[Path],
        typer.Argument(exists=True, help="Recordings (.mcap; .step of 0.2), or folders with any below."),
    ],
    jobs: Annotated[int | None, typer.Option(min=1, help="Threads [default: one per processor].")] = None,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Replay recordings of a controller's steps, and compare the commands bit for bit.

    A recording holds its arm, its settings and every input of every step; `Controller.record` writes one, and the
    environment variable SIDESTEP_RECORD=FOLDER has every controller of a program recorded. Commands are the same on
    the same processor and with the same compiler.

    Exit code: 0 when all commands are equal, 1 when one differs or a file is damaged, 2 on bad input.
    """
    from sidestep.bench.parallel import default_jobs
    from sidestep.bench.recordings import replay_all

    terminal = console(quiet=quiet, to_stderr=json == "-")
    results = with_bar(
        terminal, "replay", lambda show: replay_all(recordings, jobs=jobs or default_jobs(), progress=show)
    )
    if len(results) == 1:
        _print_one(terminal, results[0][1])
    else:
        table = figures_table("recording", "steps", "", "first difference")
        below = Path(os.path.commonpath([path.parent for path, _ in results]))
        for path, result in results:
            verdict = "equal" if result.equal else "differs"
            table.add_row(str(path.relative_to(below)), f"{result.steps:,}", verdict, _trouble(result))
        terminal.print(table)
    equal = all(result.equal for _, result in results)
    steps = sum(result.steps for _, result in results)
    if len(results) > 1:
        terminal.print(
            f"{sum(result.equal for _, result in results)} of {len(results)} recordings equal, {steps:,} steps",
            highlight=False,
        )
    if json is not None:
        rows = [{"path": str(path), **_document(result)} for path, result in results]
        write_json({"equal": equal, "steps": steps, "recordings": rows}, json)
    raise typer.Exit(0 if equal else 1)


def record(
    folder: Annotated[Path, typer.Argument(help="Folder for the recordings; must not contain any.")],
    only: Annotated[
        list[str] | None, typer.Option(help="A case to record, may be repeated [default: all].")
    ] = None,
    quiet: QuietOption = False,
) -> None:
    """Record short motions of every kind, to compare a change of the code by `sidestep replay FOLDER`.

    Reach problems, poses, what moves, scenarios, velocities, twists, trajectories, all outputs, noisy and unusable
    states, held objects, and runs by the machine's clock. Not the same files every time: the runs by the clock differ.
    """
    from sidestep.bench.recordings import record_all

    terminal = console(quiet=quiet)
    paths, left_out = with_bar(
        terminal, "record", lambda show: record_all(folder, only=only or (), progress=show)
    )
    size = sum(path.stat().st_size for path in paths)
    for words in left_out:
        terminal.print(f"left out: {words}", highlight=False, markup=False)
    terminal.print(f"{len(paths)} recordings, {size / 1e6:.0f} MB: {folder}", highlight=False, soft_wrap=True)


def _trouble(result: ReplayResult) -> str:
    """What is wrong, in a few words; empty where nothing is."""
    found = result.difference
    if found is not None:
        return f"step {found.step:,}, {found.field}: {found.recorded}, now {found.replayed}"
    return result.damage


def _print_one(terminal: Console, result: ReplayResult) -> None:
    for note in result.notes:
        terminal.print(note, highlight=False, markup=False)
    end = "" if result.complete else "; the recording was not ended: its program stopped before"
    if result.lost:
        end += f"; {result.lost:,} steps after these were lost, as the disk was too slow"
    words = f"{result.steps:,} steps ({result.seconds:.3f} s) of '{result.arm}'{end}"
    terminal.print(words, highlight=False, markup=False, soft_wrap=True)
    if result.equal:
        terminal.print("[green]✓[/green] all commands are equal bit for bit", highlight=False)
        return
    terminal.print(f"[red]✗[/red] {'not equal' if result.difference else 'damaged'}", highlight=False)
    if (found := result.difference) is not None:
        terminal.print(f"first difference: step {found.step:,}, {found.field}", highlight=False, markup=False)
        terminal.print(f"  recorded {found.recorded}", highlight=False, markup=False)
        terminal.print(f"  replayed {found.replayed}", highlight=False, markup=False)
    else:
        terminal.print(result.damage, highlight=False, markup=False, soft_wrap=True)


def _document(result: ReplayResult) -> dict[str, Any]:
    found = result.difference
    return {
        "arm": result.arm,
        "steps": result.steps,
        "seconds": result.seconds,
        "equal": result.equal,
        "complete": result.complete,
        "lost": result.lost,
        "difference": None
        if found is None
        else {
            "step": found.step,
            "field": found.field,
            "recorded": found.recorded,
            "replayed": found.replayed,
        },
        "damage": result.damage or None,
        "notes": list(result.notes),
    }
