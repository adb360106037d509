"""`sidestep robots`, `sidestep scenarios` and `sidestep schema`."""

from __future__ import annotations

from dataclasses import asdict

from sidestep.cli.output import JsonOption, console, write_json


def robots(json: JsonOption = None) -> None:
    """List the robots that go by a name; any other is loaded by the path of its URDF or MJCF.

    Each moves without any other package; meshes come with the package of its robot.
    """
    from sidestep.robot import robots as known_robots
    from sidestep.shipped_arms import shipped_file

    entries = known_robots()
    if json is not None:
        write_json([asdict(entry) for entry in entries], json)
        return
    from rich import box
    from rich.table import Table

    table = Table("robot", "joints", "what it is", "moves", "meshes", box=box.SIMPLE, pad_edge=False)
    for entry in entries:
        loads = entry.available or shipped_file(entry.name) is not None
        yes, no = "[green]yes[/green]", "[yellow]no[/yellow]"
        table.add_row(
            f"[bold]{entry.name}[/bold]",
            str(entry.num_coordinates),
            entry.description,
            yes if loads else no,
            yes if entry.available else no,
        )
    terminal = console()
    terminal.print(table)
    terminal.print(
        "moves: Arm.load takes the name; meshes: for pictures, simulation, exact distances", highlight=False
    )
    for entry in entries:
        if not entry.available:
            terminal.print(f"meshes of {entry.name}: {entry.reason}", highlight=False, markup=False)


def scenarios(json: JsonOption = None) -> None:
    """List the scenarios that come with the package."""
    from sidestep.scenario import Scenario, shipped_scenarios

    loaded = [Scenario.load(name) for name in shipped_scenarios()]
    if json is not None:
        write_json([scenario.to_document() for scenario in loaded], json)
        return
    from rich import box
    from rich.table import Table

    table = Table(
        "scenario", "robot", "mode", "what happens", box=box.SIMPLE, pad_edge=False, show_lines=True
    )
    for scenario in loaded:
        robot = scenario.robot.name or str(scenario.robot.urdf)
        table.add_row(f"[bold]{scenario.name}[/bold]", robot, scenario.simulation.mode, scenario.description)
    console().print(table)


def schema() -> None:
    """Print the JSON schema of scenario files."""
    from sidestep.scenario import schema_text

    print(schema_text(), end="")
