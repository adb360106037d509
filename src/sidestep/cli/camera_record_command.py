"""`sidestep camera record`."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from sidestep.cli.camera_options import (
    LinkOption,
    OpenSource,
    PoseOption,
    RateOption,
    RealSenseOption,
    SerialOption,
    open_source,
)
from sidestep.cli.output import JsonOption, QuietOption, console, write_json
from sidestep.cli.progress_count import counted

if TYPE_CHECKING:
    from sidestep.perception import BagWriter, CameraRecord, FolderWriter, Frame


class RecordingFormat(StrEnum):
    """What a recording is written as."""

    folder = "folder"
    mcap = "mcap"
    sqlite3 = "sqlite3"


def record(
    paths: Annotated[
        list[Path],
        typer.Argument(
            metavar="[SOURCE] DEST", help="A recording; and the folder to write, which must be new."
        ),
    ],
    realsense: RealSenseOption = False,
    serial: SerialOption = None,
    kind: Annotated[
        RecordingFormat,
        typer.Option("--format", help="Images and tables in a folder, or a ROS 2 bag as MCAP or SQLite."),
    ] = RecordingFormat.folder,
    seconds: Annotated[
        float | None,
        typer.Option(min=0.0, help="End after this time [s] [default: all; live: until Ctrl-C]."),
    ] = None,
    images: Annotated[int | None, typer.Option(min=1, help="End after so many images.")] = None,
    pose: PoseOption = None,
    link: LinkOption = None,
    rate: RateOption = 30.0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Record a RealSense camera: record --realsense DEST; or write another recording anew: record SOURCE DEST.

    Depth, capture times, intrinsics, poses and joint states are kept bit by bit; colour and the pose of each image only
    by the format folder, and depth of a unit other than 1 mm is rounded to metres of single precision in a bag. A live
    camera ends with Ctrl-C. Exit code: 0 when something is written, 2 on bad input.
    """
    if len(paths) != (1 if realsense else 2):
        raise ValueError("give SOURCE DEST, or --realsense DEST")
    terminal = console(quiet=quiet, to_stderr=json == "-")
    opened = open_source(
        None if realsense else paths[0], realsense=realsense, serial=serial, pose=pose, rate=rate, colour=True
    )
    target, number, first, last = paths[-1], 0, 0.0, 0.0
    with opened.stream, _writer(target, kind, opened, opened.records(link)) as writer:
        with counted(terminal, "recording", opened.recording) as tell:
            try:
                for frame in _limited(opened, seconds=seconds, images=images):
                    writer.add(frame)
                    first, last = (frame.time if number == 0 else first), frame.time
                    number += 1
                    tell(number)
            except KeyboardInterrupt:
                pass
    if number == 0:
        raise ValueError(f"{opened.name} gave no images")
    lost = getattr(opened.recording, "lost", 0)
    words = f"{number} images ({last - first:.2f} s{f', {lost} lost' if lost else ''}): {target}"
    terminal.print(words, highlight=False, markup=False, soft_wrap=True)
    if not opened.recording.times_known:
        note = (
            f"note: {opened.name} has no times; those written are the image's number / {rate:g} Hz (--rate)"
        )
        terminal.print(note, style="yellow", highlight=False, markup=False, soft_wrap=True)
    if json is not None:
        document = {
            "images": number,
            "duration_s": last - first,
            "lost": lost,
            "joints": list(opened.recording.joint_names),
            "path": str(target),
        }
        write_json(document, json)


def _limited(opened: OpenSource, *, seconds: float | None, images: int | None) -> Iterator[Frame]:
    """The images until a time [s] after the first, or a number of them."""
    begin: float | None = None
    started = clock.monotonic()
    for number, frame in enumerate(opened.recording.frames()):
        begin = frame.time if begin is None else begin
        passed = clock.monotonic() - started if opened.is_live else frame.time - begin
        if (images is not None and number >= images) or (seconds is not None and passed > seconds):
            return
        yield frame


def _writer(
    target: Path, kind: RecordingFormat, opened: OpenSource, cameras: list[CameraRecord]
) -> FolderWriter | BagWriter:
    from sidestep.perception import BagWriter, FolderWriter

    joints = opened.recording.joint_names
    if kind is RecordingFormat.folder:
        return FolderWriter(target, cameras, joint_names=joints)
    storage: Literal["mcap", "sqlite3"] = "mcap" if kind is RecordingFormat.mcap else "sqlite3"
    return BagWriter(target, cameras, joint_names=joints, storage=storage)
