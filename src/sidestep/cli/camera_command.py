"""`sidestep camera`: see what cameras see, record it, report on it, and check where they are."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sidestep.cli.camera_check_command import check
from sidestep.cli.camera_options import (
    AngleErrorOption,
    ClockErrorOption,
    DraftOption,
    FarOption,
    LinkOption,
    PoseErrorOption,
    PoseOption,
    RateOption,
    RecordingArgument,
    RobotOption,
    StandsOption,
    camera_errors,
    load_arm,
    open_source,
    standing_q,
)
from sidestep.cli.camera_record_command import record
from sidestep.cli.camera_view_command import view
from sidestep.cli.output import JsonOption, QuietOption, console, write_json
from sidestep.cli.progress_count import counted

app = typer.Typer(
    help="Depth cameras: see what they see, record it, report on it, and check where they are.",
    no_args_is_help=True,
)
app.command("view")(view)
app.command("record")(record)
app.command("check")(check)


@app.command("report")
def report(
    source: RecordingArgument,
    out: Annotated[Path, typer.Option("--out", "-o", help="Page to write (.html).")],
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
    pictures: Annotated[
        int, typer.Option(min=0, help="Number of images of each camera that are shown stage by stage.")
    ] = 3,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Write a page about a recording: rates, lost images, holes, and with --robot what perception makes of it.

    With an arm and joint states: times of each stage, the arm taken out, whether it is where it should be, and the map
    of cells. Times are those of this machine. Exit code: 0 when the page is written, 2 on bad input.
    """
    if out.suffix.lower() not in (".html", ".htm"):
        raise ValueError(f"--out is {out}; a page ends with .html")
    if not out.absolute().parent.is_dir():
        raise ValueError(f"--out is {out}; there is no folder {out.parent}")
    from sidestep.perception.playback import Playback
    from sidestep.report.camera_page import report_images, report_played

    terminal = console(quiet=quiet, to_stderr=json == "-")
    opened = open_source(source, pose=pose, rate=rate)
    if robot is None:
        with counted(terminal, "reading", opened.recording) as tell:
            result = report_images(opened.recording, opened.name, progress=tell)
    else:
        arm = load_arm(robot, terminal, draft=draft)
        playback = Playback(
            opened.recording,
            arm,
            q=standing_q(q, arm),
            records=opened.records(link),
            camera_options=camera_errors(pose_error_mm, pose_error_deg, clock_error_ms) | {"far": far},
        )
        with counted(terminal, "playing", opened.recording) as tell:
            result = report_played(playback, opened.name, pictures=pictures, progress=tell)
    with terminal.status("drawing"):
        result.write(out)
    document = result.document()
    terminal.print(f"{document['images']} images: {out}", highlight=False, markup=False, soft_wrap=True)
    if json is not None:
        write_json(document, json)
