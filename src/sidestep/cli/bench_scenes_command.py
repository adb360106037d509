"""`sidestep bench motionbenchmaker` and `sidestep bench dynamic`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from sidestep.bench.method import Method
from sidestep.bench.points import POINT_RADIUS, SPACING
from sidestep.cli.bench_output import (
    DurationOption,
    FailuresOption,
    FinerOption,
    JobsOption,
    MethodOption,
    PeriodOption,
    PointRadiusOption,
    RobotOption,
    SeedOption,
    SpacingOption,
    ToleranceOption,
    TorqueOption,
    figures_table,
    with_bar,
)
from sidestep.cli.output import JsonOption, QuietOption, console, write_json

if TYPE_CHECKING:
    from sidestep.bench import SceneResult, SceneSettings
    from sidestep.bench.motion_bench_maker import MotionBenchMakerProblem

COLUMNS = (  # title, key of the figures, decimals, which quantiles
    ("first path [ms]", "first_path_ms", 2, ("median", "p95", "p99")),
    ("planning [ms]", "planning_ms", 2, ("median", "p95", "p99")),
    ("first motion [ms]", "first_motion_ms", 2, ("median", "p95", "p99")),
    ("path [rad | m]", "path_length_rad", 2, ("median", "p95", "p99")),
    ("motion [s]", "motion_s", 2, ("median", "p95", "p99")),
    ("over TOPP-RA", "time_ratio", 2, ("median", "p95", "p99")),
    ("over optimum", "jerk_time_ratio", 2, ("median", "p95", "p99")),
    ("clearance [mm]", "min_clearance_mm", 1, ("min", "p5", "median")),
)


def motion_bench_maker(
    folder: Annotated[
        Path, typer.Argument(help="Folder of sets, or one set: sceneNNNN.yaml, requestNNNN.yaml.")
    ],
    robot: Annotated[str, typer.Option(help="A name from `sidestep robots`, or a URDF file.")] = "panda",
    method: MethodOption = Method.controller,
    torque: TorqueOption = False,
    problems: Annotated[
        int | None, typer.Option(min=1, help="Only so many of each set, the first ones.")
    ] = None,
    only: Annotated[list[str] | None, typer.Option(help="Only this set; may be repeated.")] = None,
    finer: FinerOption = False,
    clearances: Annotated[
        bool, typer.Option("--clearances", help="Measure starts and goals only, move nothing.")
    ] = False,
    optimum: Annotated[
        bool, typer.Option("--optimum", help="Also the time over the shortest one with a jerk limit; slow.")
    ] = False,
    spacing: SpacingOption = SPACING,
    point_radius: PointRadiusOption = POINT_RADIUS,
    duration: DurationOption = 30.0,
    tolerance: ToleranceOption = 0.05,
    period: PeriodOption = 0.001,
    jobs: JobsOption = None,
    failures: FailuresOption = False,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """The published problems of MotionBenchMaker, in closed loop: shelves, boxes, cages, tables.

    The controller sees points on the surfaces; contacts are judged on exact meshes and solids between samples.
    Solved: arrived, nothing touched, no limit broken. Joints that are not planned, such as fingers, stand where
    the request puts them. Exit code: 0 when nothing was touched and no limit broken, 1 when not, 2 on bad input.

    Over TOPP-RA: time of a motion over that of the time-optimal one along the path it took, from rest to rest,
    within the same velocity and acceleration limits and without a limit of jerk. Needs the `bench` extra.

    Over optimum (`--optimum`): the same with the limit of jerk too, by a nonlinear program; takes seconds a motion.
    """
    from sidestep.bench import read_motion_bench_maker, run_scenes

    found = read_motion_bench_maker(folder)
    sets = list(dict.fromkeys(item.set for item in found))
    unknown = [name for name in only or () if name not in sets]
    if unknown:
        raise ValueError(f"--only {unknown[0]!r} is no set of {folder}; its sets are: {', '.join(sets)}")
    chosen = _first_of_sets(found, only or sets, problems)
    motion = {"period": period, "duration": duration, "tolerance": tolerance, "torque": torque}
    points = {"spacing": spacing, "point_radius": point_radius}
    ratios = {"time_ratio": True, "jerk_time_ratio": optimum}
    settings = _settings(
        robot, method, jobs, motion, **points, **ratios, only_clearances=clearances, finer=finer
    )
    run_and_report(
        settings,
        lambda show: run_scenes(settings, chosen, progress=show),
        failures=failures,
        json=json,
        quiet=quiet,
    )


def dynamic(
    robot: RobotOption = "fr3",
    problems: Annotated[int, typer.Option(min=0, help="Random problems of each kind.")] = 10,
    obstacles: Annotated[int, typer.Option(min=0, help="Static balls in each problem.")] = 5,
    seed: SeedOption = 0,
    scenes: Annotated[
        Path | None, typer.Option(help="A folder of MotionBenchMaker: also in its scenes.")
    ] = None,
    scene_problems: Annotated[int, typer.Option(min=1, help="Problems of each of its sets.")] = 1,
    method: MethodOption = Method.controller,
    torque: TorqueOption = False,
    spacing: SpacingOption = SPACING,
    point_radius: PointRadiusOption = POINT_RADIUS,
    duration: DurationOption = 20.0,
    tolerance: ToleranceOption = 0.05,
    period: PeriodOption = 0.001,
    jobs: JobsOption = None,
    failures: FailuresOption = False,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """A ball that comes or goes while the arm moves: suddenly there, drifting through, in the goal, leaving it.

    The same seed gives the same problems. Solved: nothing touched, no limit broken, and arrived where the goal is
    or becomes free; where it stays blocked, not arrived. At a goal that the ball is in at first, arrived is within 0.01
    rad or m. Exit code as for motionbenchmaker.
    """
    from sidestep.bench import read_motion_bench_maker, run_dynamic

    published = () if scenes is None else read_motion_bench_maker(scenes)
    chosen = _first_of_sets(published, dict.fromkeys(item.set for item in published), scene_problems)
    motion = {"period": period, "duration": duration, "tolerance": tolerance, "torque": torque}
    settings = _settings(robot, method, jobs, motion, spacing=spacing, point_radius=point_radius)
    run_and_report(
        settings,
        lambda show: run_dynamic(
            settings, count=problems, seed=seed, obstacles=obstacles, scenes=chosen, progress=show
        ),
        failures=failures,
        json=json,
        quiet=quiet,
        extra={"seed": seed, "obstacles": obstacles},
    )


def _settings(
    robot: str, method: Method, jobs: int | None, motion: dict[str, Any], **more: Any
) -> SceneSettings:
    from sidestep.bench import MotionSettings, SceneSettings, default_jobs

    return SceneSettings(
        robot=robot, method=method, motion=MotionSettings(**motion), jobs=jobs or default_jobs(), **more
    )


def _first_of_sets(
    problems: Sequence[MotionBenchMakerProblem], sets: Iterable[str], count: int | None
) -> list[MotionBenchMakerProblem]:
    return [item for name in sets for item in [p for p in problems if p.set == name][:count]]


def run_and_report(
    settings: SceneSettings,
    run: Callable[[Callable[[int, int, str], None]], SceneResult],
    *,
    failures: bool,
    json: str | None,
    quiet: bool,
    extra: dict[str, Any] | None = None,
) -> NoReturn:
    """Runs with a bar, prints the tables, writes the JSON, and ends the command with its exit code."""
    terminal = console(quiet=quiet, to_stderr=json == "-")
    result = with_bar(terminal, f"{settings.robot} {settings.method.value}", run)
    document = result.to_document(failures=failures)
    document["settings"] |= extra or {}
    if not quiet:
        terminal.print(_ends(document))
        if not settings.only_clearances:
            terminal.print(_motions(document, optimum=settings.jerk_time_ratio))
            unsolved = document["all"]["jerk_time_ratio_unsolved"]
            if unsolved:
                terminal.print(
                    f"no optimum found for {unsolved} of the motions, which are not in 'over optimum'"
                )
        for item in document.get("failures", ()):
            line = f"{item['set']} {item['index']}  {'; '.join(item['reasons'])}"
            terminal.print(line, highlight=False, markup=False)
    if json is not None:
        write_json(document, json)
    bad = ("collision", "self_collision", "limit_violations")
    raise typer.Exit(1 if any(document["all"].get(key) for key in bad) else 0)


def _rows(document: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    return [*document["sets"].items(), ("all", document["all"])]


def _motions(document: dict[str, Any], *, optimum: bool) -> object:
    columns = [column for column in COLUMNS if optimum or column[1] != "jerk_time_ratio"]
    caption = "median, 95 %, 99 % of solved; clearance: min, 5 %, median"
    titles = (title for title, *_ in columns)
    table = figures_table("set", "solved", "touched", "limits", *titles, caption=caption)
    for name, figures in _rows(document):
        cells = [f"{figures['solved']} of {figures['problems']}"]
        cells += [str(figures["collision"] + figures["self_collision"]), str(figures["limit_violations"])]
        for _, key, decimals, which in columns:
            values = figures[key]
            cells.append("-" if values is None else "  ".join(f"{values[q]:.{decimals}f}" for q in which))
        table.add_row(name, *cells)
    return table


def _ends(document: dict[str, Any]) -> object:
    columns = (
        "start [mm]",
        "goal [mm]",
        "goal of body [mm]",
        "goals inside body",
        "beyond limits",
        "beyond effort",
    )
    table = figures_table("set", *columns, caption="clearance at the ends: min, 5 %, median")
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
            str(figures["goal_beyond_effort"]),
        ]
        table.add_row(name, *cells)
    return table
