"""`sidestep run` and `sidestep demo`."""

from __future__ import annotations

import dataclasses
import importlib.util
import math
import os
import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from sidestep.cli.output import JsonOption, QuietOption, console, write_json

if TYPE_CHECKING:
    from sidestep.scenario import Scenario
    from sidestep.scenario.result import ScenarioResult
    from sidestep.scenario.scenario import SwitchConfig, SwitchType

DEMO_SCENARIO = "thesis-6.2.3"


class MethodChoice(StrEnum):
    """How the arm is moved."""

    custom = "custom"
    barrier = "barrier"
    reactive = "reactive"
    controller = "controller"


class ModeChoice(StrEnum):
    """How a run is simulated."""

    torque = "torque"
    kinematic = "kinematic"


SWITCH_FORMS = {  # how --switch is written, and what its numbers are
    "none": (),
    "harmonic_only": (),
    "geodesic_only": (),
    "binary": ("threshold",),
    "sigmoid": ("threshold", "slope"),
}


def parse_switch(text: str) -> SwitchConfig:
    """A switch as the command line writes it, such as "none" or "sigmoid:0.5:10" (threshold, slope).

    Raises:
        typer.BadParameter: naming the text and the allowed forms.
    """
    from sidestep.scenario.scenario import SwitchConfig

    kind, *numbers = text.split(":")
    names = SWITCH_FORMS.get(kind)
    try:
        if names is None or len(numbers) != len(names):
            raise ValueError
        values = dict(zip(names, map(float, numbers), strict=True))
        if not all(math.isfinite(value) for value in values.values()) or values.get("slope", 1.0) <= 0.0:
            raise ValueError
    except ValueError:
        forms = ", ".join(":".join((form, *map(str.upper, of))) for form, of in SWITCH_FORMS.items())
        raise typer.BadParameter(f"{text!r} is not one of: {forms} (finite numbers, SLOPE > 0)") from None
    return SwitchConfig(
        cast("SwitchType", kind), threshold=values.get("threshold"), slope=values.get("slope")
    )


def run(
    scenario: Annotated[
        str, typer.Argument(help="A scenario file (YAML), or a name from `sidestep scenarios`.")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Report folder [default: sidestep-report-NAME].")
    ] = None,
    method: Annotated[
        MethodChoice | None,
        typer.Option(
            help="Instead of the scenario's: custom (as the file says), or the controller (barrier: without planner; "
            "reactive: also without look ahead and sub-goals)."
        ),
    ] = None,
    mode: Annotated[ModeChoice | None, typer.Option(help="Instead of the scenario's mode.")] = None,
    switch: Annotated[
        str | None,
        typer.Option(
            metavar="none|harmonic_only|geodesic_only|binary:THRESHOLD|sigmoid:THRESHOLD:SLOPE",
            help="Instead of the scenario's switch (a distance switch: in the file).",
        ),
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(min=1e-3, max=600.0, help="Longest simulated time [s], instead of the scenario's."),
    ] = None,
    draft: Annotated[
        bool,
        typer.Option(
            "--draft",
            help="Of an arm that is not prepared, a body in seconds, with larger ellipsoids; as body.draft.",
        ),
    ] = False,
    json: JsonOption = None,
    report: Annotated[bool, typer.Option("--report/--no-report", help="Write the report folder.")] = True,
    quiet: QuietOption = False,
) -> None:
    """Run a scenario, judge it, and write a report folder.

    Exit code: 0 when the goal was reached without contact and within every limit, 1 when not, 2 on bad input.
    """
    from sidestep.scenario import Scenario

    chosen = Scenario.load(scenario)
    simulation = chosen.simulation
    if mode is not None:
        simulation = dataclasses.replace(simulation, mode=mode.value)
    if duration is not None:
        simulation = dataclasses.replace(simulation, duration=duration)
    if method is not None:
        chosen = dataclasses.replace(chosen, method=method.value)
    if draft:
        if chosen.method == "custom":
            raise ValueError("--draft goes with the controller; the method custom has no covering body")
        chosen = dataclasses.replace(chosen, body=dataclasses.replace(chosen.body, draft=True))
    system = chosen.system
    if switch is not None:
        system = dataclasses.replace(system, switch=parse_switch(switch))
    chosen = dataclasses.replace(chosen, simulation=simulation, system=system)
    folder = (out or Path(f"sidestep-report-{chosen.name}")) if report or out is not None else None
    result = run_and_show(chosen, folder=folder, json=json, quiet=quiet)
    raise typer.Exit(0 if result.success else 1)


def demo(
    studio: Annotated[
        bool | None,
        typer.Option(
            "--studio/--no-studio",
            help="In the browser, or as a report [default: the browser where stdin and stdout are a terminal].",
        ),
    ] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="Report folder.")] = Path("sidestep-report-demo"),
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Show what Sidestep does: a Franka Research 3 under torque control passes a cluster of balls.

    At a terminal it opens the studio, where the balls can be dragged. Without one (in a script, in CI), with --json, or
    with --no-studio it runs once and writes a report; the exit code is then 0 when the goal was reached without contact
    and within every limit, 1 when not.
    """
    from sidestep.scenario import Scenario

    if studio and json is not None:
        raise typer.BadParameter("--json goes with --no-studio: the studio has no figures to write")
    scenario = dataclasses.replace(Scenario.load(DEMO_SCENARIO), method="controller")
    if studio if studio is not None else json is None and _can_open_studio():
        from sidestep.cli.studio_command import open_studio

        open_studio(scenario, method="controller")
        return
    result = run_and_show(scenario, folder=out, json=json, quiet=quiet)
    raise typer.Exit(0 if result.success else 1)


def _can_open_studio() -> bool:
    """Whether somebody sits at a terminal, outside of CI, and the studio is installed."""
    at_terminal = sys.stdin.isatty() and sys.stdout.isatty() and not os.environ.get("CI")
    return at_terminal and importlib.util.find_spec("viser") is not None


def run_and_show(scenario: Scenario, *, folder: Path | None, json: str | None, quiet: bool) -> ScenarioResult:
    """Runs a scenario with live progress, then prints a table and a sentence.

    Args:
        scenario: what to run.
        folder: of the report, or None for none.
        json: file for the figures, "-" for stdout, None for none.
        quiet: print nothing.
    """
    terminal = console(quiet=quiet, to_stderr=json == "-")
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)  # found out now, not after the run
    terminal.print(f"[bold]{scenario.name}[/bold]  {_facts(scenario)}", highlight=False)
    from sidestep.cli.progress import run_with_progress

    result = run_with_progress(scenario, terminal)
    if folder is not None:
        with terminal.status("writing the report"):
            from sidestep.report import write_report

            page = write_report(result, folder)[0]
    terminal.print(_table(result))
    mark = "[green]✓[/green]" if result.success else "[red]✗[/red]"
    terminal.print(f"{mark} {result.sentence()}", highlight=False)
    if folder is not None:
        terminal.print(f"Report: {page}", highlight=False, soft_wrap=True)
    if json is not None:
        write_json(result.to_document(), json)
    return result


def _facts(scenario: Scenario) -> str:
    robot = scenario.robot.name or scenario.robot.urdf
    count = len(scenario.obstacles)
    obstacles = "no obstacle" if count == 0 else f"{count} obstacle{'s' if count > 1 else ''}"
    from sidestep.scenario.summary import method_in_words

    return f"{robot}, {obstacles}, {method_in_words(scenario)}, {scenario.simulation.mode} mode"


def _table(result: ScenarioResult) -> object:
    from rich import box
    from rich.table import Table

    from sidestep.scenario.summary import summary_rows

    table = Table(box=box.SIMPLE, show_header=False, pad_edge=False)
    table.add_column(style="dim")
    table.add_column(justify="right")
    table.add_column(style="dim", overflow="fold")
    for row in summary_rows(result):
        table.add_row(*row)
    return table
