"""`sidestep studio`."""

from __future__ import annotations

import html
import os
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sidestep.cli.limit_options import EffortLimitOption, VelocityLimitOption, by_joint
from sidestep.cli.output import console

if TYPE_CHECKING:
    from sidestep.scenario import Scenario
    from sidestep.studio.studio import Studio

LEAD = """<!doctype html>
<meta charset="utf-8"><meta http-equiv="refresh" content="0; url={address}"><title>Sidestep</title>
<a href="{address}">Studio</a>
"""


def studio(
    scenario: Annotated[
        str | None,
        typer.Argument(help="A scenario file (YAML), or a name from `sidestep scenarios`; or use --robot."),
    ] = None,
    robot: Annotated[str | None, typer.Option(help="A name from `sidestep robots` [default: fr3].")] = None,
    urdf: Annotated[Path | None, typer.Option(help="URDF, xacro or MJCF file of a robot.")] = None,
    package_dir: Annotated[
        list[Path] | None, typer.Option(help="Folder searched for package:// addresses; may be repeated.")
    ] = None,
    effort_limit: EffortLimitOption = None,
    velocity_limit: VelocityLimitOption = None,
    method: Annotated[
        str | None,
        typer.Option(
            help="How the arm is moved at first; the page lists the methods [default: as the scenario says; without "
            "one, controller]."
        ),
    ] = None,
    ellipsoids: Annotated[
        int | None,
        typer.Option(
            min=1, help="Ellipsoids per link of the covering body [default: as many as needed, but slower]."
        ),
    ] = None,
    host: Annotated[
        str,
        typer.Option(
            help="Where to listen; who can reach it and has the printed address, which goes over the network as it "
            "is, can move the arm."
        ),
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Where to listen; 0: any that is free.")] = 8890,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open a browser.")] = True,
    headless: Annotated[
        bool, typer.Option("--headless", help="Take pictures in a hidden browser (Chromium), then end.")
    ] = False,
    screenshot: Annotated[
        Path | None, typer.Option(help="With --headless: picture (.png) of the end.")
    ] = None,
    video: Annotated[
        Path | None,
        typer.Option(help="With --headless: animation (.gif, .webp) or video (.mp4, .webm) of the way."),
    ] = None,
    duration: Annotated[
        float, typer.Option(min=0.5, max=600.0, help="With --headless: for how long [s of simulated time].")
    ] = 8.0,
    size: Annotated[
        str, typer.Option(metavar="WIDTHxHEIGHT", help="With --headless: of the window [px].")
    ] = "1280x800",
) -> None:
    """Open the studio: the real loop in MuJoCo, in the browser, to see, push and tune.

    Without a scenario the arm goes to and fro; without a robot either, it is an FR3 at a table. Ends with Ctrl-C. A
    robot of a file is prepared in seconds, and its finer body takes over while it moves; the page says how far that is.
    """
    from sidestep.studio.gallery import with_following_ball
    from sidestep.studio.start import starting_scenario
    from sidestep.studio.systems import numbers_of

    chosen = starting_scenario(
        scenario,
        robot=robot,
        urdf=urdf,
        package_dirs=package_dir or (),
        effort_limits=by_joint(effort_limit, "--effort-limit"),
        velocity_limits=by_joint(velocity_limit, "--velocity-limit"),
    )
    if robot is not None or urdf is not None:
        chosen = with_following_ball(chosen)
    if method is None:
        method = numbers_of(chosen)[0]
    if not headless and (screenshot or video):
        raise ValueError("--screenshot and --video go with --headless")
    if headless:
        from sidestep.studio.headless import Window, take_pictures

        window = Window.from_text(size)
        take_pictures(
            chosen,
            to_and_fro=scenario is None,
            method=method,
            ellipsoids=ellipsoids,
            duration=duration,
            screenshot=screenshot,
            video=video,
            window=window,
        )
        return
    open_studio(
        chosen,
        to_and_fro=scenario is None,
        method=method,
        ellipsoids=ellipsoids,
        host=host,
        port=port,
        browser=browser,
    )


def open_studio(
    scenario: Scenario,
    *,
    to_and_fro: bool = False,
    method: str = "controller",
    ellipsoids: int | None = None,
    host: str = "127.0.0.1",
    port: int = 8890,
    browser: bool = True,
) -> None:
    """Runs a studio until it is interrupted."""
    from sidestep.studio.studio import Studio

    terminal = console()
    with Studio(
        scenario, to_and_fro=to_and_fro, method=method, host=host, port=port, ellipsoids=ellipsoids
    ) as running:
        terminal.print(f"Studio: {running.address}   (Ctrl-C ends it)", highlight=False, soft_wrap=True)
        with open_browser(running.address) if browser else nullcontext():
            _wait(running)


@contextmanager
def open_browser(address: str) -> Iterator[None]:
    """Opens an address by a file that leads there, which others cannot read and which is gone afterwards.

    The command line of a browser, where the address would be otherwise, can be read by all users of the machine.
    """
    import tempfile
    import webbrowser

    try:
        folder = Path.home()  # browsers in a sandbox read no hidden folder, and have another /tmp
        handle, name = tempfile.mkstemp(".html", "sidestep-studio-", folder)
    except (OSError, RuntimeError):
        handle, name = tempfile.mkstemp(".html", "sidestep-studio-")
    os.close(handle)
    file = Path(name)
    try:
        file.write_text(LEAD.format(address=html.escape(address)), encoding="utf-8")
        webbrowser.open(file.as_uri())
        yield
    finally:
        file.unlink(missing_ok=True)


def _wait(running: Studio) -> None:
    try:
        running.wait()
    except KeyboardInterrupt:
        return
    if running.error:
        raise RuntimeError(running.error)
