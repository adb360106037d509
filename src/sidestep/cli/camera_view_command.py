"""`sidestep camera view`."""

from __future__ import annotations

import time as clock
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sidestep.cli.camera_options import (
    AngleErrorOption,
    ClockErrorOption,
    DraftOption,
    FarOption,
    LinkOption,
    OpenSource,
    PoseErrorOption,
    PoseOption,
    RateOption,
    RealSenseOption,
    RobotOption,
    SerialOption,
    SourceArgument,
    StandsOption,
    camera_errors,
    load_arm,
    open_source,
    standing_q,
)
from sidestep.cli.output import JsonOption, QuietOption, console, write_json
from sidestep.cli.progress_count import counted

if TYPE_CHECKING:
    from rich.console import Console

    from sidestep.perception.playback import Playback, PlayedFrame

SHOWN_FOR = 1.0  # [s] for each image of a recording without times
LONGEST_WAIT = 2.0  # [s] between two images: a longer pause of a recording is not waited for
SUFFIXES = (".png", ".jpg", ".pdf", ".svg")


def view(
    source: SourceArgument = None,
    realsense: RealSenseOption = False,
    serial: SerialOption = None,
    robot: RobotOption = None,
    draft: DraftOption = False,
    pose: PoseOption = None,
    link: LinkOption = None,
    q: StandsOption = None,
    pose_error_mm: PoseErrorOption = None,
    pose_error_deg: AngleErrorOption = None,
    clock_error_ms: ClockErrorOption = None,
    far: FarOption = None,
    rate: RateOption = 30.0,
    unseen_closed: Annotated[
        bool, typer.Option("--unseen-closed", help="What nobody has seen counts as occupied, and is shown.")
    ] = False,
    picture: Annotated[
        Path | None, typer.Option(help="Write a picture (.png) of one image, stage by stage, and end.")
    ] = None,
    image: Annotated[
        int | None,
        typer.Option(min=0, help="With --picture: which image, from 0 on [default: the last; live: 30]."),
    ] = None,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Where to listen; 0: any that is free.")] = 8892,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open a browser.")] = True,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Show what cameras see: images, what is taken out of them as arm, and what is seen, remembered and hidden.

    Plays a recording, or a live camera, through perception with its joint states, on a page in the browser; ends with
    Ctrl-C. With --picture it writes a picture and ends; without --robot that shows the depth alone.

    Exit code: 0, or 2 on bad input.
    """
    if picture is not None and picture.suffix.lower() not in SUFFIXES:
        raise ValueError(f"--picture is {picture}; allowed: a file that ends with {', '.join(SUFFIXES)}")
    if picture is None and (json is not None or image is not None):
        raise ValueError("--json and --image go with --picture")
    if picture is None and robot is None:
        raise ValueError("give --robot NAME, or --picture FILE for the depth alone")
    terminal = console(quiet=quiet, to_stderr=json == "-")
    opened = open_source(source, realsense=realsense, serial=serial, pose=pose, rate=rate)
    if robot is None:
        assert picture is not None
        document = _picture_of_depth(opened, picture, image=image, far=far)
    else:
        from sidestep.perception import PerceptionSettings
        from sidestep.perception.playback import Playback

        arm = load_arm(robot, terminal, draft=draft)
        playback = Playback(
            opened.recording,
            arm,
            q=standing_q(q, arm),
            records=opened.records(link),
            settings=PerceptionSettings(unseen_is_free=not unseen_closed),
            camera_options=camera_errors(pose_error_mm, pose_error_deg, clock_error_ms) | {"far": far},
        )
        if picture is None:
            _serve(playback, opened, terminal, port=port, browser=browser)
            return
        document = _picture_of_stages(playback, opened, terminal, picture, image)
    terminal.print(f"Picture: {picture}", highlight=False, markup=False, soft_wrap=True)
    if json is not None:
        write_json(document, json)


def _picture_of_depth(
    opened: OpenSource, path: Path, *, image: int | None, far: float | None
) -> dict[str, Any]:
    from sidestep.perception.pictures import DPI, depth_figure

    frame = None
    with opened.stream:
        for number, frame in enumerate(opened.recording.frames()):  # noqa: B007 - the last one counts
            if number == _last(opened, image):
                break
    if frame is None:
        raise ValueError(f"{opened.name} has no images")
    _check_number(opened, image, number)
    depth_figure(frame, **({} if far is None else {"far": far})).savefig(path, dpi=DPI)
    return {"camera": frame.camera, "time_s": frame.time, "image": number, "pixels": None, "cells": None}


def _picture_of_stages(
    playback: Playback, opened: OpenSource, terminal: Console, path: Path, image: int | None
) -> dict[str, Any]:
    from sidestep.perception.pictures import write_stages

    played = None
    with opened.stream, counted(terminal, "playing", opened.recording) as tell:
        for number, played in enumerate(playback.play()):  # noqa: B007
            tell(number + 1)
            if number == _last(opened, image):
                break
    if played is None:
        raise ValueError(f"{opened.name} has no image with a joint state; skipped: {playback.skipped}")
    _check_number(opened, image, number)
    stages = playback.stages(played.frame.camera)
    write_stages(stages, path)
    if played.report.question:
        terminal.print(played.report.question, style="yellow", highlight=False, markup=False)
    return _document(played, number) | {"pixels": stages.pixels(), "cells": stages.cells()}


def _document(played: PlayedFrame, number: int) -> dict[str, Any]:
    """Figures of an image."""
    report = played.report
    stages = ("depth", "mask", "map", "unseen", "obstacles", "total")
    return {
        "camera": played.frame.camera,
        "time_s": played.frame.time,
        "image": number,
        "used": report.used,
        "through_share": report.arm.through_share,
        "depth_error_m": report.arm.depth_error if report.arm.on_arm else None,
        "question": report.question or None,
        "stages_s": {name: getattr(report, f"{name}_time") for name in stages},
    }


def _check_number(opened: OpenSource, image: int | None, last: int) -> None:
    if image is not None and last < image:
        raise ValueError(f"--image is {image}; allowed: 0 to {last}, {opened.name} has no more")


def _last(opened: OpenSource, image: int | None) -> int | None:
    """Number of the image after which to end; None: the last of the recording."""
    return 30 if image is None and opened.is_live else image


def _serve(playback: Playback, opened: OpenSource, terminal: Console, *, port: int, browser: bool) -> None:
    """Plays on a page until it is interrupted."""
    from sidestep.cli.studio_command import open_browser
    from sidestep.studio.camera_view import CameraView

    with CameraView(playback.arm, port=port) as page:
        terminal.print(f"Camera: {page.address}   (Ctrl-C ends it)", highlight=False, soft_wrap=True)
        with open_browser(page.address) if browser else nullcontext():
            try:
                with opened.stream:
                    shown: PlayedFrame | None = None
                    begin = clock.monotonic()
                    for played in playback.play():
                        if shown is not None and not opened.is_live:
                            page.wait(_pause(opened, shown, played, spent=clock.monotonic() - begin))
                        while page.paused and not page.wait(0.1):
                            pass
                        begin = clock.monotonic()
                        page.show(playback.stages(played.frame.camera), played.report, played.q)
                        shown = played
                page.wait()
            except KeyboardInterrupt:
                return


def _pause(opened: OpenSource, shown: PlayedFrame, played: PlayedFrame, *, spent: float) -> float:
    """How long to wait [s] before an image, where `spent` [s] went by since the one before."""
    between = played.frame.time - shown.frame.time if opened.recording.times_known else SHOWN_FOR
    return max(0.0, min(between, LONGEST_WAIT) - spent)
