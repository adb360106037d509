"""`sidestep bench two-programs`."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated, Any

import typer

from sidestep.cli.bench_campaign import FileOption, ShardOption, campaign_rows, end_with
from sidestep.cli.bench_output import JobsOption, SeedOption, figures_table
from sidestep.cli.limit_options import by_name
from sidestep.cli.output import JsonOption, QuietOption
from sidestep.cli.simulate_command import DelayOption, JitterOption, LossOption, delay_of

LIMITS = ("position", "velocity", "torque", "torque rate", "acceleration", "jerk")
FIGURES = (
    *("runs", "arrived", "time, s", "contact points", "runs that touch", "clearance, mm"),
    *(f"beyond the {name}" for name in LIMITS),
    "torque leaps",
)


def two_programs(
    problems: Annotated[int, typer.Option(min=0, help="Reach problems, beside the scenarios.")] = 50,
    robot: Annotated[str, typer.Option(help="Of the reach problems; a name from `sidestep robots`.")] = "fr3",
    delay: DelayOption = "1:5",
    jitter: JitterOption = 0.5,
    loss: LossOption = 0.1,
    speed: Annotated[
        float,
        typer.Option(min=0.0, help="Of the simulator: 0, as fast as it is asked; 1, the machine's clock."),
    ] = 0.0,
    leap: Annotated[
        bool,
        typer.Option("--leap", help="Torques leap as they are told, not at most by their rate limits."),
    ] = False,
    duration: Annotated[float, typer.Option(min=0.1, help="Longest time of a run [s].")] = 30.0,
    setting: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=NUMBER", help="Of the controller, such as limit_margin=0.1; may be repeated."
        ),
    ] = None,
    seed: SeedOption = 0,
    file: FileOption = None,
    shard: ShardOption = "1/1",
    jobs: JobsOption = None,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """The thesis's scenarios and random reach problems under torque, with controller and simulator as two programs.

    Their connection is late, jitters and loses messages; beside each run, the same in one process. Contacts are those
    of MuJoCo and of the exact meshes, also between samples; limits are counted by the simulator, cycle by cycle. Exit
    code: 0 if the two programs touched nothing and kept position, velocity, torque and its rate, else 1.
    """
    from sidestep.bench import TwoProgramsSettings, is_clean, run_two_programs, two_programs_table
    from sidestep.simulation.link import Link

    settings = TwoProgramsSettings(
        link=Link(delay=delay_of(delay), jitter=1e-3 * jitter, loss=loss, seed=seed),
        problems=problems,
        robot=robot,
        seed=seed,
        duration=duration,
        speed=speed,
        leap=leap,
        controller=tuple(by_name(setting, "--setting", "NAME=NUMBER", "limit_margin=0.1").items()),
    )
    rows = campaign_rows("two programs", run_two_programs, settings, file, shard, jobs, json, quiet)
    table = two_programs_table(rows)
    shown = figures_table("", *table)
    for line in zip(FIGURES, *(_figures_of(cell) for cell in table.values()), strict=True):
        shown.add_row(*line)
    document = {"bench": "two-programs", "settings": asdict(settings), "table": table, "rows": rows}
    bad = not all(is_clean(row) for row in rows if row["name"].endswith("two programs"))
    end_with(shown, document, json, quiet, bad=bad)


def _figures_of(cell: dict[str, Any]) -> list[str]:
    """What `FIGURES` names; of a limit the runs that exceeded it, and the largest share of it that was used."""
    clearance, time = cell["min_clearance_m"], cell["median_time_s"]
    limits = [
        f"{found['runs']}" + (f" ({100.0 * found['largest']:.0f} %)" if found["largest"] else "")
        for found in (cell["limits"][name] for name in LIMITS)
    ]
    return [
        str(cell["runs"]),
        str(cell["arrived"]),
        "-" if time is None else f"{time:.2f}",
        str(cell["contacts"]),
        str(cell["touched"]),
        "-" if clearance is None else f"{1e3 * clearance:.1f}",
        *limits,
        str(cell["torque_leaps"]),
    ]
