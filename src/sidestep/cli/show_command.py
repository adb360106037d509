"""`sidestep show`."""

from __future__ import annotations

from contextlib import nullcontext
from typing import Annotated

import typer

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
from sidestep.cli.output import JsonOption, console, write_json


def show(
    source: Annotated[
        str,
        typer.Argument(
            metavar="FILE",
            help="URDF, xacro or MJCF file, an .arm file, or a name: of `sidestep robots`, robot_descriptions or "
            "mujoco_menagerie.",
        ),
    ],
    package_dir: PackageDirOption = None,
    tip: TipOption = None,
    locked: LockedOption = None,
    effort_limit: EffortLimitOption = None,
    velocity_limit: VelocityLimitOption = None,
    acceleration_limit: AccelerationLimitOption = None,
    jerk_limit: JerkLimitOption = None,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Where to listen; 0: any that is free.")] = 8891,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open a browser.")] = True,
    json: JsonOption = None,
) -> None:
    """Show a robot as it is read, in the browser: move its joints, see its shapes, limits and warnings.

    Nothing is prepared for that. Ends with Ctrl-C. With --json it writes what was read, and which links touch in the
    middle of the joints, and shows nothing. Exit code: 0, or 2 when the robot cannot be read.
    """
    from sidestep.studio.show.reading import read

    given = reading_options(
        package_dir, tip, locked, effort_limit, velocity_limit, acceleration_limit, jerk_limit
    )
    reading = read(source, given)
    if json is not None:
        from sidestep.studio.show.document import document_with_touching

        write_json(document_with_touching(reading), json)
        return
    from sidestep.cli.studio_command import open_browser
    from sidestep.studio.show.show import Show

    terminal = console()
    with Show(reading, port=port) as running:
        for text in reading.warnings:
            terminal.print(f"warning: {text}", highlight=False, markup=False, soft_wrap=True)
        terminal.print(
            f"{reading.robot.name}: {running.address}   (Ctrl-C ends it)", highlight=False, soft_wrap=True
        )
        with open_browser(running.address) if browser else nullcontext():
            try:
                running.wait()
            except KeyboardInterrupt:
                return
