"""`sidestep bench camera-times`."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from sidestep.cli.bench_output import RobotOption, SeedOption, figures_table, with_status
from sidestep.cli.output import JsonOption, QuietOption, console, write_json

STAGES = ("depth", "mask", "map", "unseen", "obstacles", "total")


def camera_times(
    robot: RobotOption = "fr3",
    images: Annotated[
        int,
        typer.Option(
            min=1,
            help="Images of one swing of the arm, at 30 Hz; with more than 30 the room is known when times are taken.",
        ),
    ] = 60,
    width: Annotated[int, typer.Option(min=16, help="Of an image [pixel].")] = 848,
    height: Annotated[int, typer.Option(min=16, help="Of an image [pixel].")] = 480,
    rounds: Annotated[int, typer.Option(min=1, help="Rounds in which the rows take turns.")] = 5,
    seconds: Annotated[
        float, typer.Option(min=0.0, help="Of each loop of 1 kHz in each round [s]; 0: no loops.")
    ] = 5.0,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """From a depth image to obstacles: the time of each stage, and images lost beside a loop of 1 kHz.

    Simulated images of a D435 in a room with a moving arm, rendered once, through `Perception.update` and through the
    recipe of 0.2. Wall times are of images during which the core was kept, where there are any; processor time is what
    counts on a machine that others use. With two cores or more perception has one that the loop does not use. Exit
    code 0: times are figures, not errors.
    """
    from sidestep.bench import CameraTimesSettings, run_camera_times

    settings = CameraTimesSettings(
        robot=robot, images=images, width=width, height=height, rounds=rounds, seconds=seconds, seed=seed
    )
    terminal = console(quiet=quiet, to_stderr=json == "-")
    document = with_status(terminal, lambda show: run_camera_times(settings, progress=show))
    terminal.print(_stages(document))
    over = ", ".join(f"{value:.1f} ({name})" for name, value in document["stages"]["recipe_over"].items())
    terminal.print(f"Processor time of the recipe of 0.2 over that of a row: {over}.", highlight=False)
    if document["beside"]:
        terminal.print(_beside(document))
    load = document["load"]["before"]
    terminal.print(
        f"Load of the machine: {'not known' if load is None else load[0]}, {document['cores']} cores."
    )
    if json is not None:
        write_json(document, json)


def _stages(document: dict[str, Any]) -> object:
    columns = ("", "depth", "mask", "map", "unseen", "set", "total", "CPU")
    table = figures_table(
        "one image [ms]", *columns, title=f"{document['cpu']}, {document['instruction_set']}"
    )
    table.columns[0].no_wrap = False  # narrow terminals wrap the names, never a number
    for column in table.columns[1:]:
        column.no_wrap = True
    for row in document["stages"]["results"]:
        times = row["undisturbed_ms"] or row["wall_ms"]
        for name, which in ((f"{row['name']}: {row['voxels']:,}", "p50"), ("", "p99")):
            stages = [f"{times[stage][which]:.2f}" if stage in times else "" for stage in STAGES]
            table.add_row(name, which, *stages, f"{row['thread_ms'][which]:.2f}")
    return table


def _beside(document: dict[str, Any]) -> object:
    columns = ("step p50", "p99", "max us", "missed", "images", "replaced", "late", "free core")
    table = figures_table("beside the loop", *columns)
    table.columns[0].no_wrap = False
    for row in document["beside"]:
        step, frames, free = row["step_us"], row["frames"], row["frames_on_a_free_core"]
        counts = [""] * 4
        if frames is not None:
            counts = [f"{frames[name]:,}" for name in ("images", "replaced", "late")]
            counts.append(f"{free['lost_share']:.1%}")
        steps = [f"{step[name]:.0f}" for name in ("median", "p99", "max")]
        table.add_row(f"{row['beside']}, {row['case']}", *steps, str(row["missed"]), *counts)
    return table
