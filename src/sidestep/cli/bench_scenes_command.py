"""`sidestep bench motionbenchmaker`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from sidestep.bench.method import Method
from sidestep.cli.output import console, write_json

COLUMNS = (  # title, key of the figures, decimals, which quantiles
    ("planning [ms]", "planning_ms", 2, ("median", "p95", "p99")),
    ("first motion [ms]", "first_motion_ms", 2, ("median", "p95", "p99")),
    ("path [rad]", "path_length_rad", 2, ("median", "p95", "p99")),
    ("motion [s]", "motion_s", 2, ("median", "p95", "p99")),
    ("clearance [mm]", "min_clearance_mm", 1, ("min", "p5", "median")),
)


def motion_bench_maker(
    folder: Annotated[
        Path, typer.Argument(help="Folder of sets, or one set: sceneNNNN.yaml, requestNNNN.yaml.")
    ],
    robot: Annotated[str, typer.Option(help="A name from `sidestep robots`, or a URDF file.")] = "panda",
    method: Annotated[Method, typer.Option(help="How the arm is moved.")] = Method.barrier,
    torque: Annotated[
        bool, typer.Option("--torque", help="Under torque control in MuJoCo, not integrated.")
    ] = False,
    problems: Annotated[
        int | None, typer.Option(min=1, help="Only so many of each set, the first ones.")
    ] = None,
    only: Annotated[list[str] | None, typer.Option(help="Only this set; may be repeated.")] = None,
    clearances: Annotated[
        bool, typer.Option("--clearances", help="Measure starts and goals only, move nothing.")
    ] = False,
    spacing: Annotated[float, typer.Option(min=1e-4, help="Of the points on surfaces [m].")] = 0.005,
    point_radius: Annotated[float, typer.Option(min=0.0, help="Of those points [m].")] = 0.001,
    duration: Annotated[float, typer.Option(min=0.01, help="Longest time per problem [s].")] = 30.0,
    tolerance: Annotated[
        float, typer.Option(min=1e-6, help="Arrived when every joint is this near [rad].")
    ] = 0.05,
    period: Annotated[float, typer.Option(min=1e-5, help="Control period [s].")] = 0.001,
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes [default: one per processor].")] = None,
    failures: Annotated[
        bool, typer.Option("--failures", help="List the problems that were not solved, and why.")
    ] = False,
    json: Annotated[
        str | None, typer.Option("--json", metavar="FILE|-", help="Write figures as JSON; '-' for stdout.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """The published problems of MotionBenchMaker, in closed loop: shelves, boxes, cages, tables.

    The controller sees points on the surfaces; contacts are judged on exact meshes and solids between samples.
    Solved: arrived, nothing touched, no limit broken. Joints that are not planned, such as fingers, stand where
    the request puts them. Exit code: 0 when nothing was touched and no limit broken, 1 when not, 2 on bad input.
    """
    from sidestep.bench import (
        MotionSettings,
        SceneSettings,
        default_jobs,
        read_motion_bench_maker,
        run_scenes,
    )
    from sidestep.cli.bench_progress import with_bar

    found = read_motion_bench_maker(folder)
    sets = list(dict.fromkeys(item.set for item in found))
    unknown = [name for name in only or () if name not in sets]
    if unknown:
        raise ValueError(f"--only {unknown[0]!r} is no set of {folder}; its sets are: {', '.join(sets)}")
    chosen = [
        item
        for name in only or sets
        for item in [problem for problem in found if problem.set == name][:problems]
    ]
    settings = SceneSettings(
        robot=robot,
        method=method,
        motion=MotionSettings(
            period=period, duration=duration, tolerance=tolerance, torque=torque, safe=method.safe
        ),
        jobs=jobs or default_jobs(),
        spacing=spacing,
        point_radius=point_radius,
        only_clearances=clearances,
    )
    terminal = console(quiet=quiet, to_stderr=json == "-")
    result = with_bar(
        terminal, f"{robot} {method.value}", lambda show: run_scenes(settings, chosen, progress=show)
    )
    document = result.to_document(failures=failures)
    if not quiet:
        terminal.print(_ends(document))
        if not clearances:
            terminal.print(_motions(document))
        for item in document.get("failures", ()):
            line = f"{item['set']} {item['index']}  {'; '.join(item['reasons'])}"
            terminal.print(line, highlight=False, markup=False)
    if json is not None:
        write_json(document, json)
    bad = ("collision", "self_collision", "limit_violations")
    raise typer.Exit(1 if any(document["all"].get(key) for key in bad) else 0)


def _rows(document: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    return [*document["sets"].items(), ("all", document["all"])]


def _motions(document: dict[str, Any]) -> object:
    from rich import box
    from rich.table import Table

    table = Table(
        box=box.SIMPLE, pad_edge=False, caption="median, 95 %, 99 % of solved; clearance: min, 5 %, median"
    )
    table.add_column("set", style="dim")
    for title in ("solved", "touched", "limits"):
        table.add_column(title, justify="right")
    for title, *_ in COLUMNS:
        table.add_column(title, justify="right")
    for name, figures in _rows(document):
        cells = [f"{figures['solved']} of {figures['problems']}"]
        cells += [str(figures["collision"] + figures["self_collision"]), str(figures["limit_violations"])]
        for _, key, decimals, which in COLUMNS:
            values = figures[key]
            cells.append("-" if values is None else "  ".join(f"{values[q]:.{decimals}f}" for q in which))
        table.add_row(name, *cells)
    return table


def _ends(document: dict[str, Any]) -> object:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE, pad_edge=False, caption="clearance at the ends: min, 5 %, median")
    table.add_column("set", style="dim")
    for title in ("start [mm]", "goal [mm]", "goal of body [mm]", "goals inside body", "beyond limits"):
        table.add_column(title, justify="right")
    for name, figures in _rows(document):
        cells = []
        for key in ("start_clearance_mm", "goal_clearance_mm", "goal_clearance_of_body_mm"):
            values = figures[key]
            cells.append(
                "-" if values is None else "  ".join(f"{values[q]:.1f}" for q in ("min", "p5", "median"))
            )
        cells += [
            f"{figures['goal_inside_body']} of {figures['problems']}",
            str(figures["goal_beyond_limits"]),
        ]
        table.add_row(name, *cells)
    return table
