"""`sidestep bench drives`, `sidestep bench moving` and `sidestep bench faults`."""

from __future__ import annotations

from typing import Annotated

import typer

from sidestep.cli.bench_campaign import (
    FileOption,
    RobotsOption,
    Row,
    ShardOption,
    campaign_rows,
    end_with,
    given_options,
)
from sidestep.cli.bench_output import JobsOption, SeedOption, TorqueOption, figures_table
from sidestep.cli.output import JsonOption, QuietOption

# Columns of the faults: title, part of the table, limit, and the factor of what is shown.
FAULT_COLUMNS = (
    ("q cmd", "beyond", "commanded position", 1e3),
    ("q", "beyond", "position", 1e3),
    ("v free", "beyond_free", "velocity", 1.0),
    ("v near", "beyond_near", "velocity", 1.0),
    ("torque", "beyond", "torque", 1.0),
    ("rate free", "beyond_free", "torque rate", 1.0),
    ("rate near", "beyond_near", "torque rate", 1.0),
)


def drives(
    robot: RobotsOption = None,
    count: Annotated[int, typer.Option(min=1, help="Drives of each robot.")] = 12,
    moving: Annotated[
        float, typer.Option(min=0.0, metavar="SPEED", help="Speed of half of the balls [m/s].")
    ] = 0.0,
    torque: Annotated[bool, typer.Option("--torque", help="Torque output, not acceleration.")] = False,
    seed: SeedOption = 0,
    file: FileOption = None,
    shard: ShardOption = "1/1",
    jobs: JobsOption = None,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Random velocity drives of 3 s among 25 balls; half of them may move.

    Contacts are checked on the exact meshes, also between samples. Steps beyond limits count before the first contact.
    Exit code: 0 if no contact had a way out, and velocity, position and torque limits are kept; else 1.
    """
    from sidestep.bench import DriveSettings, drive_table, run_drives

    settings = DriveSettings(
        **given_options(robots=robot), torque=torque, moving=moving, count=count, seed=seed
    )
    rows = campaign_rows("drives", run_drives, settings, file, shard, jobs, json, quiet)
    table = drive_table(rows)
    shown = figures_table(
        "robot", "drives", "contacts", "way out", "speeds [rad/s]", "self", "jerk", "acceleration", "others"
    )
    for name, cell in table.items():
        beyond = cell["beyond"]
        others = sum(beyond[key] for key in ("position", "velocity", "torque", "torque rate"))
        shown.add_row(
            name,
            *(str(cell[key]) for key in ("drives", "contacts", "with_way_out")),
            ", ".join(f"{speed:g}" for speed in cell["contact_speeds"]),
            *(
                str(value)
                for value in (cell["self_contacts"], beyond["jerk"], beyond["acceleration"], others)
            ),
        )
    bad = any(
        cell["with_way_out"]
        or cell["self_contacts"]
        or any(cell["beyond"][key] for key in ("position", "velocity", "torque", "torque rate"))
        for cell in table.values()
    )
    end_with(shown, {"bench": "drives", "table": table, "rows": rows}, json, quiet, bad=bad)


def moving(
    robot: RobotsOption = None,
    told: Annotated[
        list[str] | None, typer.Option(help="One column; may be repeated [default: all].")
    ] = None,
    speed: Annotated[
        list[float] | None, typer.Option(help="Speed of the obstacle [m/s]; may be repeated.")
    ] = None,
    runs: Annotated[int, typer.Option(min=1, help="Runs in each cell.")] = 4,
    torque: TorqueOption = False,
    seed: SeedOption = 0,
    file: FileOption = None,
    shard: ShardOption = "1/1",
    jobs: JobsOption = None,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """A ball or a capsule comes at an arm that holds still or moves, and the controller knows more or less of it.

    Told at 30 Hz: exact; wrong, with a velocity 30 % off; untold, without velocity; late, 50 to 100 ms old without a
    stamp. With stamps: late_stamped, of capture; arrival, of arrival; lost30, 30 % of the sets are lost. A tracker
    that fails: frozen, old data with new stamps; vanished, empty for 1 s; dead, nothing any more; vanished_untold and
    dead_untold without velocities; in each the obstacle stands still from then on, or goes on. FR3 and UR10 run every
    cell, other arms exact and untold unless they are named by --robot. Judged on exact meshes between samples; for
    each contact a way out is searched. Exit code: 0 when nothing was touched from which there was a way out, nothing
    that stands while its tracker fails, and no arm moves in contact later than it has to stand after that; else 1.
    """
    from sidestep.bench import MovingSettings, Told, moving_table, run_moving
    from sidestep.bench.moving import is_kept

    for item in told or ():
        if item not in list(Told):
            raise ValueError(f"--told is {item!r}; allowed: {', '.join(Told)}")
    given = given_options(robots=robot, told=[Told(item) for item in told or ()], speeds=speed)
    settings = MovingSettings(**given, runs=runs, torque=torque, seed=seed)
    rows = campaign_rows("moving", run_moving, settings, file, shard, jobs, json, quiet)
    table = moving_table(rows)
    columns = list(dict.fromkeys(name for cells in table.values() for name in cells))
    shown = figures_table("contacts (way out or late)/runs", *table)
    for column in columns:
        shown.add_row(
            column,
            *(_contacts(column, cells[column]) if column in cells else "-" for cells in table.values()),
        )
    bad = not all(is_kept(column, cell) for cells in table.values() for column, cell in cells.items())
    end_with(shown, {"bench": "moving", "table": table, "rows": rows}, json, quiet, bad=bad)


def faults(
    robot: RobotsOption = None,
    case: Annotated[list[str] | None, typer.Option(help="One fault; may be repeated [default: all].")] = None,
    runs: Annotated[int, typer.Option(min=1, help="Runs of each fault and robot.")] = 2,
    acceleration: Annotated[
        bool, typer.Option("--acceleration", help="Acceleration output, carried out exactly, not torque.")
    ] = False,
    seed: SeedOption = 0,
    file: FileOption = None,
    shard: ShardOption = "1/1",
    jobs: JobsOption = None,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Joint goals among 25 solids for 6 s, while something is wrong with the cloud, the measured state or the arm.

    In MuJoCo under torque. Judged on exact meshes between samples; limits count before the first contact: the worst
    ratio, of positions q, commanded and measured, the way beyond [mrad]. Free: more than 0.1 m from everything. Silent:
    the status was ok or limited 50 ms before. slow125Hz is called at 125 Hz and told 1 kHz, told125Hz is told so. Exit
    code: 0 when nothing was touched, and when faults of the state break no limit: positions by at most 2 mrad, in free
    space velocity by 5 % and the torque rate not at all; else 1.
    """
    from sidestep.bench import FaultSettings, fault_table, run_faults
    from sidestep.bench.faults import broken_promises

    given = given_options(robots=robot, cases=case)
    settings = FaultSettings(**given, runs=runs, torque=not acceleration, seed=seed)
    rows = campaign_rows("faults", run_faults, settings, file, shard, jobs, json, quiet)
    table = fault_table(rows)
    shown = figures_table("fault", "runs", "hit (silent)", "self", *(title for title, *_ in FAULT_COLUMNS))
    for name, cell in table.items():
        shown.add_row(
            name,
            str(cell["runs"]),
            f"{cell['contacts']}({cell['silent']})",
            str(cell["self_contacts"]),
            *(_worst(cell[part].get(limit), scale) for _, part, limit, scale in FAULT_COLUMNS),
        )
    bad = any(broken_promises(name, cell) for name, cell in table.items())
    end_with(shown, {"bench": "faults", "table": table, "rows": rows}, json, quiet, bad=bad)


def _contacts(column: str, cell: Row) -> str:
    """Of a cell of `moving_table`; in brackets those with a way out, where the obstacle goes on those that are late."""
    bad = cell["late_contacts" if " goes_on " in column else "with_way_out"]
    return f"{cell['contacts']}({bad})/{cell['runs']}"


def _worst(broken: tuple[int, float] | None, scale: float) -> str:
    """The worst of the steps beyond a limit."""
    return "-" if broken is None else f"{scale * broken[1]:.3g}"
