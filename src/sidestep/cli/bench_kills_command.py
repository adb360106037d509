"""`sidestep bench kills`."""

from __future__ import annotations

from typing import Annotated

import typer

from sidestep.cli.bench_output import figures_table, with_bar
from sidestep.cli.output import JsonOption, QuietOption, console, write_json


def kills(
    case: Annotated[
        list[str] | None,
        typer.Option(
            help="client, server, simulator, supervisor, camera, clock-back, clock-ahead, network or ctrl-c; "
            "may be repeated [default: all]."
        ),
    ] = None,
    runs: Annotated[int, typer.Option(min=1, help="Of each case.")] = 10,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Kill the programs around a moving arm, one at a time, and see that it stops, says why and goes on.

    A simulated FR3, its server with a supervisor, and clients are programs of their own. The arm must come to rest
    within its limits of position and velocity, somebody must say why, the arm must be led to its goal afterwards, and
    at most the last second of the recording may be lost. A case begins anew, at most twice, where a busy machine had
    stopped the arm first; its row says how often (`busy`). `network` needs the right to make a network of its own. Exit
    code: 0 where all of that holds in every run, else 1.
    """
    from sidestep.bench.kills import CASES, run_kills

    unknown = [name for name in case or () if name not in CASES]
    if unknown:
        raise ValueError(f"case is {unknown[0]!r}; there are {', '.join(CASES)}")
    terminal = console(quiet=quiet, to_stderr=json == "-")
    rows = with_bar(terminal, "kills", lambda show: run_kills(list(case or CASES), runs, progress=show))
    table = figures_table("case", "passed", "rest [s]", "moved [rad]", "lost [s]", "says")
    for name in dict.fromkeys(row["case"] for row in rows):
        own = [row for row in rows if row["case"] == name]
        rests = [row["rest"] for row in own if row["rest"] is not None]
        lost = [row["lost"] for row in own if row["lost"] is not None]
        table.add_row(
            name,
            f"{sum(row['passed'] for row in own)} of {len(own)}",
            f"{max(rests):.2f}" if rests else "",
            f"{max(row['moved'] for row in own):.2f}",
            f"{max(lost):.2f}" if lost else "",
            own[0]["why"][-60:],
        )
    terminal.print(table)
    for row in rows:
        if not row["passed"]:
            terminal.print(f"{row['case']} {row['number']}: {row}", highlight=False, markup=False)
    if json is not None:
        write_json({"bench": "kills", "rows": rows}, json)
    raise typer.Exit(0 if all(row["passed"] for row in rows) else 1)
