"""`sidestep bench`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from sidestep.bench.method import Method
from sidestep.cli.bench_camera_command import camera_mask, camera_recording
from sidestep.cli.bench_camera_loop_command import camera_moving, camera_scenes
from sidestep.cli.bench_camera_times_command import camera_times
from sidestep.cli.bench_encounters_command import drives, faults, moving
from sidestep.cli.bench_kills_command import kills
from sidestep.cli.bench_output import (
    DurationOption,
    FailuresOption,
    FinerOption,
    JobsOption,
    OwnMethodOption,
    PeriodOption,
    SeedOption,
    TorqueOption,
    figures_table,
    method_or_file,
    with_bar,
)
from sidestep.cli.bench_scenes_command import dynamic, motion_bench_maker
from sidestep.cli.bench_step_command import compare, peers, points, qp, realtime, step
from sidestep.cli.bench_two_programs_command import two_programs
from sidestep.cli.limit_options import (
    AccelerationLimitOption,
    EffortLimitOption,
    JerkLimitOption,
    LockedOption,
    PackageDirOption,
    TipOption,
    VelocityLimitOption,
    reading_options,
)
from sidestep.cli.output import JsonOption, QuietOption, console, write_json
from sidestep.cli.replay_command import record

app = typer.Typer(help="Benchmarks on random and on published problems.", no_args_is_help=True)
app.command("motionbenchmaker")(motion_bench_maker)
app.command("dynamic")(dynamic)
app.command("drives")(drives)
app.command("moving")(moving)
app.command("faults")(faults)
app.command("two-programs")(two_programs)
app.command()(kills)
app.command("camera-mask")(camera_mask)
app.command("camera-recording")(camera_recording)
app.command("camera-scenes")(camera_scenes)
app.command("camera-moving")(camera_moving)
app.command("step")(step)
app.command("compare")(compare)
app.command("peers")(peers)
app.command("qp")(qp)
app.command("points")(points)
app.command("realtime")(realtime)
app.command("camera-times")(camera_times)
app.command("record")(record)


@app.command("reach")
def reach(
    robot: Annotated[
        str,
        typer.Option(
            help="A name from `sidestep robots`, robot_descriptions or mujoco_menagerie, or a URDF, xacro or MJCF file."
        ),
    ] = "fr3",
    package_dir: PackageDirOption = None,
    tip: TipOption = None,
    locked: LockedOption = None,
    effort_limit: EffortLimitOption = None,
    velocity_limit: VelocityLimitOption = None,
    acceleration_limit: AccelerationLimitOption = None,
    jerk_limit: JerkLimitOption = None,
    draft: Annotated[
        bool,
        typer.Option("--draft", help="With the body that is prepared in seconds, see `sidestep prepare`."),
    ] = False,
    finer: FinerOption = False,
    obstacles: Annotated[int, typer.Option(min=0, help="Balls per problem.")] = 10,
    problems: Annotated[int, typer.Option(min=1, help="Number of problems.")] = 100,
    seed: SeedOption = 0,
    method: OwnMethodOption = Method.controller.value,
    moving: Annotated[
        float, typer.Option(min=0.0, metavar="SPEED", help="Balls drift at up to this speed [m/s].")
    ] = 0.0,
    torque: TorqueOption = False,
    poses: Annotated[
        bool,
        typer.Option("--poses", help="Goals are poses of the tip, within 1 mm and 0.5°, in any posture."),
    ] = False,
    duration: DurationOption = 30.0,
    period: PeriodOption = 0.001,
    jobs: JobsOption = None,
    problems_file: Annotated[
        Path | None, typer.Option(help="Run the problems of this file, written by --export.")
    ] = None,
    export: Annotated[Path | None, typer.Option(help="Write the problems to this file (JSON).")] = None,
    failures: FailuresOption = False,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Random reach problems: balls of 5-10 cm radius in the reachable shell, a random start, a random goal.

    Of a robot from a file the balls have 5-10 % of its reach, and are where its links get to, along rails as well.

    Collisions are judged on exact meshes between samples, until arrival or the end of the time. The same seed
    gives the same problems and outcomes, with any number of processes. Exit code: 0 when nothing was touched
    and no limit broken, 1 when not, 2 on bad input.
    """
    from sidestep.bench import (
        BenchSettings,
        MotionSettings,
        ProblemSettings,
        default_jobs,
        read_problems,
        run_bench,
        write_problems,
    )

    options = reading_options(
        package_dir, tip, locked, effort_limit, velocity_limit, acceleration_limit, jerk_limit
    )
    given = None if problems_file is None else read_problems(problems_file)
    settings = BenchSettings(
        problems=ProblemSettings(
            robot=robot if given is None else given[0].robot,
            obstacles=obstacles,
            seed=seed,
            moving=moving,
            options=options,
        ),
        count=problems,
        method=method_or_file(method),
        motion=MotionSettings(period=period, duration=duration, torque=torque, poses=poses),
        jobs=jobs or default_jobs(),
        draft=draft,
        finer=finer,
    )
    terminal = console(quiet=quiet, to_stderr=json == "-")
    title = f"{Path(settings.problems.robot).name} {method}"
    result = with_bar(terminal, title, lambda show: run_bench(settings, problems=given, progress=show))
    document = result.to_document(failures=failures)
    if export is not None:
        write_problems(export, result.problems)
    if not quiet:
        terminal.print(_table(document))
        for item in document.get("failures", ()):
            terminal.print(f"{item['index']:5d}  {'; '.join(item['reasons'])}", highlight=False, markup=False)
    if json is not None:
        write_json(document, json)
    clean = not (document["collision"] or document["self_collision"] or document["limit_violations"])
    raise typer.Exit(0 if clean else 1)


def _table(document: dict[str, Any]) -> object:
    from rich.markup import escape

    table = figures_table("", "", show_header=False)
    table.columns[0].no_wrap = False
    count = document["problems"]
    for key in ("success", "collision", "self_collision", "stuck", "under_way", "limit_violations"):
        share = f"{100.0 * document[key] / count:.1f} %"
        table.add_row(key.replace("_", " "), f"{document[key]} of {count}  ({share})")
    for name, found in document["limits_broken"].items():
        table.add_row(f"  {name}", f"{found['problems']}, worst excess {found['worst_excess']:.3g}")
    table.add_row("straight line blocked", f"{document['straight_line_blocked']} of {count}")
    for key in ("min_clearance_m", "min_self_clearance_m"):
        value = document[key]
        table.add_row(
            key.removesuffix("_m").replace("_", " "), "-" if value is None else f"{1e3 * value:.1f} mm"
        )
    times = "  ".join(f"{name} {value}" for name, value in document["step_us"].items())
    table.add_row("steps", f"{document['steps']}")
    table.add_row(escape("step [us]"), times)
    return table
