"""`sidestep bench step`, `compare`, `peers`, `qp`, `points` and `realtime`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sidestep.cli.bench_output import (
    RobotOption,
    RowSecondsOption,
    SeedOption,
    SizeOption,
    figures_table,
    with_status,
)
from sidestep.cli.output import JsonOption, QuietOption, console, write_json


def step(
    steps: Annotated[
        int, typer.Option(min=1, help="Steps per row, unless the time is over before.")
    ] = 1_000_000,
    seconds: RowSecondsOption = 10.0,
    robot: RobotOption = "fr3",
    points: Annotated[
        str, typer.Option(metavar="N,N,...", help="Numbers of points around the whole arm.")
    ] = "1,100,1000,10000,100000",
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Times one control step: Table 6.1 of the thesis, the whole arm and the whole controller among clouds of points.

    Every row on one core, from C++ (around each step of a motion) and from Python. Motions go between places with
    3 cm of clearance, as far as there are any. The controller, which holds limits and clearances by a quadratic
    program, does in its step all but planner and look-ahead, which have threads of their own (`bench realtime`).
    Kept is the longest step of the motions during which the core was kept: given to no other program. Last, the kernel
    that leaves no point out, as a share of what a core does that only multiplies and adds.
    """
    from sidestep.bench import StepSettings, run_step_bench

    try:
        numbers = tuple(int(n) for n in points.split(","))
    except ValueError:
        raise ValueError(f"--points is '{points}', must be numbers with commas between") from None
    settings = StepSettings(steps=steps, seconds=seconds, robot=robot, points=numbers, seed=seed)
    terminal = console(quiet=quiet, to_stderr=json == "-")
    document = with_status(terminal, lambda show: run_step_bench(settings, progress=show))
    title = f"{document['cpu']}, {document['instruction_set']}"
    columns = ("", "median", "p95", "p99", "p99.9", "max", "kept", "steps/s")
    table = figures_table("one step [us]", *columns, title=title)
    for column in table.columns:
        column.no_wrap = column is not table.columns[0]  # narrow terminals wrap the names, never a number
    table.columns[0].min_width = 18
    for row in document["results"]:
        names = ("median", "p95", "p99", "p99.9", "max", "undisturbed_max")
        times = [_microseconds(row[f"{name}_us"]) for name in names]
        table.add_row(row["name"], row["language"], *times, f"{row['steps_per_s']:,.0f}")
    terminal.print(table)
    dense = document["dense"]
    terminal.print(
        f"Densities of {dense['gaussians']} Gaussians at {dense['points']:,} points: {dense['pair_ns']:.2f} ns each, "
        f"{1e-9 * dense['operations_per_s']:.1f} Gflop/s, {dense['share_of_peak']:.0%} of the "
        f"{1e-9 * dense['multiply_add_per_s']:.1f} that a core does which only multiplies and adds."
    )
    idle = document["idle"]
    terminal.print(
        f"A loop that only reads the clock is held up for {1e-3 * idle['longest_us']:.2f} ms at most in "
        f"{idle['seconds']:.1f} s, {idle['above_1ms']} times for more than 1 ms: so is any step on this machine."
    )
    if json is not None:
        write_json(document, json)


def _microseconds(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.2f}" if value < 100.0 else f"{value:,.0f}"


def compare(
    before: Annotated[Path, typer.Argument(exists=True, dir_okay=False, help="Result of `bench step`.")],
    after: Annotated[Path, typer.Argument(exists=True, dir_okay=False, help="Result of `bench step`.")],
    quiet: QuietOption = False,
) -> None:
    """Compares the medians of two results of `sidestep bench step`, row by row."""
    from json import loads

    from sidestep.bench import compare_steps

    rows = compare_steps(loads(before.read_text("utf-8")), loads(after.read_text("utf-8")))
    table = figures_table("median of one step [us]", "", "before", "after", "after/before")
    for row in rows:
        table.add_row(
            row["name"],
            row["language"],
            f"{row['before_us']:.2f}",
            f"{row['after_us']:.2f}",
            f"{row['ratio']:.2f}",
        )
    console(quiet=quiet).print(table)


def peers(
    seconds: RowSecondsOption = 3.0,
    fabrics: Annotated[
        str | None,
        typer.Option(
            metavar="PYTHON", help="An interpreter with `fabrics`, which needs an environment of its own."
        ),
    ] = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Times of other software for the work nearest to one control step, on one core, in one run.

    The thesis's equations by dense tensors in NumPy, by torch.autograd and by JAX; and among ten balls CBFpy's filter,
    fabrics and a distance query of Coal. The report names what is not installed, and leaves it out.
    """
    from sidestep.bench import PeerSettings, run_peers

    settings = PeerSettings(seconds=seconds, seed=seed, fabrics=fabrics)
    terminal = console(quiet=quiet, to_stderr=json == "-")
    document = with_status(terminal, lambda show: run_peers(settings, progress=show))
    for group in document["groups"]:
        title = f"{group['name']}: {document['cpu']}"
        table = figures_table("", "median us", "p99 us", "times slower", title=title)
        table.add_column("work")
        for row in group["rows"]:
            if "missing" in row:
                table.add_row(row["name"], "-", "-", "-", row["missing"])
            else:
                times = (f"{row['median_us']:,.2f}", f"{row['p99_us']:,.2f}", f"{row['times_slower']:,.1f}")
                table.add_row(row["name"], *times, row["work"])
        terminal.print(table)
    if json is not None:
        write_json(document, json)


def qp(
    robot: RobotOption = "fr3",
    programs: Annotated[int, typer.Option(min=1, help="Programs, from motions of the robot.")] = 5_000,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Times of solvers for the quadratic programs of a step, and whether they find the same minimisers.

    The core's, DAQP, PIQP and ProxQP, each from scratch, by the time that they measure themselves. Programs are those
    of the filter above a table; most have no active constraint. What is not installed is left out, and named.
    """
    from sidestep.bench import QuadraticProgramSettings, run_quadratic_programs

    settings = QuadraticProgramSettings(programs=programs, robot=robot, seed=seed)
    terminal = console(quiet=quiet, to_stderr=json == "-")
    document = with_status(terminal, lambda show: run_quadratic_programs(settings, progress=show))
    title = f"{document['programs']:,} programs, {document['constrained']:,} constrained: {document['cpu']}"
    columns = ("all: median", "p99", "constrained: median", "p99", "max", "wrong")
    table = figures_table("one program [us]", *columns, title=title)
    for row in document["rows"]:
        if "missing" in row:
            table.add_row(row["name"], row["missing"])
            continue
        whole, part = row["all"], row["constrained"]
        times = (whole["median_us"], whole["p99_us"], part["median_us"], part["p99_us"], part["max_us"])
        table.add_row(row["name"], *(f"{value:.2f}" for value in times), str(row["wrong"]))
    terminal.print(table)
    if json is not None:
        write_json(document, json)


def points(
    robot: RobotOption = "fr3",
    most: Annotated[int, typer.Option(min=10, help="Points; 10, 100, ... up to so many.")] = 1_000_000,
    seconds: RowSecondsOption = 1.0,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw a picture, as .png, .svg or .pdf.")
    ] = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """What a step costs against the number of points: 0.5 m and more out of reach, and 5 to 10 cm from the body."""
    from sidestep.bench import CloudSizeSettings, draw_cloud_sizes, run_cloud_size_bench

    settings = CloudSizeSettings(robot=robot, most=most, seconds=seconds, seed=seed)
    terminal = console(quiet=quiet, to_stderr=json == "-")
    document = with_status(terminal, lambda show: run_cloud_size_bench(settings, progress=show))
    title = f"{document['cpu']}, {document['instruction_set']}"
    table = figures_table("where", "points", "median us", "p99 us", "p99.9 us", "max us", title=title)
    for row in document["results"]:
        times = [f"{row[f'{name}_us']:,.1f}" for name in ("median", "p99", "p99.9", "max")]
        table.add_row(row["where"], f"{row['points']:,}", *times)
    terminal.print(table)
    if plot is not None:
        draw_cloud_sizes(document, plot)
    if json is not None:
        write_json(document, json)


def realtime(
    robot: RobotOption = "fr3",
    points: Annotated[int, typer.Option(min=1, help="Points in the cloud of a table with objects.")] = 10_000,
    seconds: RowSecondsOption = 60.0,
    refresh: Annotated[float, typer.Option(min=0.001, help="Clouds per second.")] = 60.0,
    camera: Annotated[
        bool, typer.Option(help="A depth camera beside the recorder, which needs the meshes of the arm.")
    ] = True,
    size: SizeOption = "848x480",
    row: Annotated[
        list[str] | None,
        typer.Option(help="clock, goals, clouds or recorder; may be repeated [default: all]."),
    ] = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """The controller, everything on, at 1 kHz by the machine's clock: how late it is, and what it misses.

    Beside it another thread sets goals, then goals and clouds of points, then goals and images of a depth camera while
    every step is recorded and replayed afterwards; first a thread without a controller only reads the clock. A step is
    late by the time from when it is due to when it begins; it misses its deadline if it ends after the next one is due.
    Real-time scheduling is used where the machine allows it. Exit code: 1 where the replay is not equal bit for bit or
    steps were not recorded, else 0; misses are figures, not errors.
    """
    from sidestep.bench import RealTimeBenchSettings, run_real_time_bench
    from sidestep.bench.real_time import CLOCK, ROWS

    settings = RealTimeBenchSettings(
        robot=robot,
        points=points,
        seconds=seconds,
        refresh=refresh,
        camera=camera,
        size=size,
        seed=seed,
        rows=tuple(row or ROWS),
    )
    terminal = console(quiet=quiet, to_stderr=json == "-")
    document = with_status(terminal, lambda show: run_real_time_bench(settings, progress=show))
    rows = document["results"]
    scheduled = "real-time scheduling" if rows[-1]["real_time_scheduling"] else "no real-time scheduling"
    columns = ("steps", "missed", "us", "median", "p99", "p99.9", "max")
    table = figures_table("beside", *columns, title=f"{document['cpu']}, {scheduled}")
    for found in rows:
        for what, times in (("late", found["late_us"]), ("step", found["step_us"])):
            first = (
                (found["beside"], f"{found['steps']:,}", str(found["missed"]))
                if what == "late"
                else ("",) * 3
            )
            if what == "late" or found["beside"] != CLOCK:
                table.add_row(
                    *first, what, *(f"{times[name]:.1f}" for name in ("median", "p99", "p99.9", "max"))
                )
    terminal.print(table)
    record = rows[-1].get("record")
    if record is not None:
        terminal.print(
            f"recorded {record['steps']:,} steps, {record['bytes_a_minute'] / 1e6:.1f} MB a minute, "
            f"{record['lost']} lost; replay {'equal bit for bit' if record['replay_equal'] else 'NOT equal'}, "
            f"{record['replay_speed']:.1f} times as fast as the motion",
            highlight=False,
        )
    beside = (found["beside"] for found in rows)
    histogram = figures_table("up to, us", *beside, title="steps by how late they began")
    edges = [*(str(edge) for edge in rows[0]["late_histogram"]["edges_us"]), "more"]
    for edge, *counts in zip(edges, *(found["late_histogram"]["counts"] for found in rows), strict=True):
        histogram.add_row(edge, *(f"{count:,}" for count in counts))
    terminal.print(histogram)
    if json is not None:
        write_json(document, json)
    raise typer.Exit(0 if record is None or (record["replay_equal"] and not record["lost"]) else 1)
