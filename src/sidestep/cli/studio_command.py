"""`sidestep studio`."""

from __future__ import annotations

import html
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sidestep.cli.limit_options import EffortLimitOption, VelocityLimitOption, by_joint
from sidestep.cli.output import console

if TYPE_CHECKING:
    from sidestep.scenario import Scenario
    from sidestep.studio.studio import Studio

LOCAL = "127.0.0.1"  # where to listen, unless told otherwise
LEAD = """<!doctype html>
<meta charset="utf-8"><meta http-equiv="refresh" content="0; url={address}"><title>Sidestep</title>
<a href="{address}">Studio</a>
"""


def studio(
    scenario: Annotated[
        str | None,
        typer.Argument(
            help="A scenario file (YAML), or a name from `sidestep scenarios`; or use --robot. A recording (.mcap) is "
            "played."
        ),
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
    attach: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Show and lead an arm that `sidestep serve` serves there; --robot says what it looks like.",
        ),
    ] = None,
    token: Annotated[
        Path | None,
        typer.Option(
            help="File with the token of the server of --attach [default: the one that it has left for this user]."
        ),
    ] = None,
    host: Annotated[
        str,
        typer.Option(
            help="Where to listen; who can reach it and has the printed address, which goes over the network as it "
            "is, can move the arm."
        ),
    ] = LOCAL,
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
    from sidestep._core import recording_suffix

    if scenario is not None and scenario.endswith(recording_suffix):
        if headless:
            raise ValueError("--headless takes no recording; `sidestep report FILE -o FILE.png` draws one")
        refuse(
            "a recording is played as it is, on this machine",
            {
                "--robot": robot,
                "--urdf": urdf,
                "--package-dir": package_dir,
                "--effort-limit": effort_limit,
                "--velocity-limit": velocity_limit,
                "--method": method,
                "--ellipsoids": ellipsoids,
                "--attach": attach,
                "--token": token,
                "--host": None if host == LOCAL else host,
                "--screenshot": screenshot,
                "--video": video,
            },
        )
        play_recording(Path(scenario), port=port, browser=browser)
        return
    from sidestep.studio.gallery import with_following_ball
    from sidestep.studio.start import starting_scenario
    from sidestep.studio.systems import numbers_of

    if attach is not None:
        moved = {"--method": method, "--ellipsoids": ellipsoids}
        refuse("the arm of --attach is moved by the program that serves it", moved)
    elif token is not None:
        raise ValueError("--token goes with --attach")
    chosen = starting_scenario(
        scenario,
        robot=robot,
        urdf=urdf,
        package_dirs=package_dir or (),
        effort_limits=by_joint(effort_limit, "--effort-limit"),
        velocity_limits=by_joint(velocity_limit, "--velocity-limit"),
    )
    if attach is not None and headless:
        raise ValueError(
            "--attach shows the present, --headless takes pictures of a simulation: give one of them"
        )
    if (robot is not None or urdf is not None) and attach is None:
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
        to_and_fro=scenario is None and attach is None,
        method=method,
        ellipsoids=ellipsoids,
        host=host,
        port=port,
        browser=browser,
        attach=attach,
        token=None if token is None else token.read_text(encoding="utf-8").strip(),
    )


def refuse(why: str, options: Mapping[str, object]) -> None:
    """Raises ValueError that names those options that were given, and why they are of no use."""
    given = [name for name, value in options.items() if value is not None]
    if given:
        raise ValueError(f"{why}: it takes no {', '.join(given)}")


def open_studio(
    scenario: Scenario,
    *,
    to_and_fro: bool = False,
    method: str = "controller",
    ellipsoids: int | None = None,
    host: str = LOCAL,
    port: int = 8890,
    browser: bool = True,
    attach: str | None = None,
    token: str | None = None,
) -> None:
    """Runs a studio until it is interrupted.

    attach: address of a served arm, in place of a simulation; token: of its server, see `sidestep.connect`.
    """
    from sidestep.studio.session_process import Served
    from sidestep.studio.studio import Studio

    terminal = console()
    with Studio(
        scenario,
        to_and_fro=to_and_fro,
        method=method,
        host=host,
        port=port,
        ellipsoids=ellipsoids,
        served=None if attach is None else Served(attach, token),
    ) as running:
        terminal.print(f"Studio: {running.address}   (Ctrl-C ends it)", highlight=False, soft_wrap=True)
        with open_browser(running.address) if browser else nullcontext():
            _wait(running)


def play_recording(path: Path, *, port: int = 8890, browser: bool = True) -> None:
    """Plays a recording on a page of this machine until it is interrupted."""
    from sidestep.report import load_recording
    from sidestep.studio.recording_view import RecordingView

    terminal = console()
    with RecordingView(load_recording(path, scenes=True), port=port) as page:
        terminal.print(f"Recording: {page.address}   (Ctrl-C ends it)", highlight=False, soft_wrap=True)
        with open_browser(page.address) if browser else nullcontext():
            try:
                page.wait()
            except KeyboardInterrupt:
                return


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
