"""`sidestep camera check`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from sidestep.cli.bench_output import figures_table
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
    RecordingArgument,
    camera_errors,
    load_arm,
    open_source,
)
from sidestep.cli.output import JsonOption, QuietOption, console, write_json
from sidestep.cli.progress_count import counted

if TYPE_CHECKING:
    from rich.console import Console

    from sidestep import Arm
    from sidestep.perception import DepthCamera


def check(
    source: RecordingArgument,
    robot: Annotated[
        str,
        typer.Option(
            help="The arm: a name from `sidestep robots`, a URDF, xacro or MJCF file, or an .arm file."
        ),
    ],
    draft: DraftOption = False,
    pose: PoseOption = None,
    link: LinkOption = None,
    pose_error_mm: PoseErrorOption = None,
    pose_error_deg: AngleErrorOption = None,
    clock_error_ms: ClockErrorOption = None,
    far: FarOption = None,
    rate: RateOption = 30.0,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="File for the corrected pose, as --pose takes it.")
    ] = None,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Measure where a camera is, and by how much its clock is off, from the arm's own motion in its images.

    The arm should move slowly through several poses in view. Exit code: 0 when the camera is where it is said to be, by
    --pose-error-mm, --pose-error-deg and --clock-error-ms, 1 when it is not or that cannot be told, 2 on bad input.
    """
    terminal = console(quiet=quiet, to_stderr=json == "-")
    opened = open_source(source, pose=pose, rate=rate)
    records = opened.records(link)
    if out is not None and len(records) > 1:
        raise ValueError(f"--out is for the pose of one camera, the recording has {len(records)}")
    errors = camera_errors(pose_error_mm, pose_error_deg, clock_error_ms)
    options = {name: value for name, value in (errors | {"far": far}).items() if value is not None}
    cameras = [record.camera(**options) for record in records]
    arm = load_arm(robot, terminal, draft=draft)
    documents = [
        camera_document(camera, found, times_known=opened.recording.times_known)
        for camera, found in zip(cameras, _corrections(opened, arm, cameras, terminal), strict=True)
    ]
    for document in documents:
        _print(document, terminal)
    if out is not None:
        np.savetxt(out, documents[0]["pose"], fmt="%.9f")
        terminal.print(f"Pose: {out}", highlight=False, markup=False, soft_wrap=True)
    if json is not None:
        write_json({"cameras": documents}, json)
    raise typer.Exit(0 if all(document["as_told"] for document in documents) else 1)


def _corrections(opened: OpenSource, arm: Arm, cameras: list[DepthCamera], terminal: Console) -> list[Any]:
    """What `CameraCheck` finds of each camera, from all images with a joint state."""
    from sidestep.perception import CameraCheck  # type: ignore[attr-defined]
    from sidestep.perception.playback import joint_order

    order = joint_order(opened.recording.joint_names, arm.robot.coordinate_names)
    checks = {camera.name: CameraCheck(arm, camera) for camera in cameras}
    with counted(terminal, "reading", opened.recording) as tell:
        for number, frame in enumerate(opened.recording.frames(), start=1):
            if frame.q is not None:
                for one in checks.values():
                    one.add_state(frame.q[order], time=frame.time)
                checks[frame.camera].add(frame.depth, time=frame.time, unit=frame.unit)
            tell(number)
    return [checks[camera.name].solve() for camera in cameras]


def camera_document(camera: DepthCamera, found: Any, *, times_known: bool) -> dict[str, Any]:
    """A correction as JSON has it, and whether it is within the errors that the camera was said to have.

    Args:
        camera: with the errors it is said to have.
        found: a `CameraCorrection`.
        times_known: whether the recording has times; the clock is not judged where it has none.
    """
    off = []
    if found.translation > camera.translation_error:
        off.append(
            f"{1e3 * found.translation:.1f} mm away, more than {1e3 * camera.translation_error:.1f} mm"
        )
    if found.rotation > camera.rotation_error:
        off.append(
            f"turned by {np.rad2deg(found.rotation):.2f}°, more than {np.rad2deg(camera.rotation_error):.2f}°"
        )
    if times_known and abs(found.clock_offset) > camera.clock_error:
        off.append(
            f"its clock off by {1e3 * found.clock_offset:.1f} ms, more than {1e3 * camera.clock_error:.1f} ms"
        )
    return {
        "camera": camera.name,
        "as_told": not off and not found.question,
        "off": off,
        "question": found.question or None,
        "translation_m": float(found.translation),
        "rotation_rad": float(found.rotation),
        "clock_offset_s": float(found.clock_offset) if times_known else None,
        "rms_before_m": float(found.rms_before),
        "rms_after_m": float(found.rms_after),
        "cover_offset_m": float(found.offset),
        "images": int(found.frames),
        "points": int(found.points),
        "pose": np.asarray(found.pose).tolist(),
    }


def _print(document: dict[str, Any], terminal: Console) -> None:
    clock = document["clock_offset_s"]
    table = figures_table(document["camera"], "")
    for name, value in (
        ("moved by", f"{1e3 * document['translation_m']:.1f} mm"),
        ("turned by", f"{np.rad2deg(document['rotation_rad']):.2f}°"),
        (
            "clock off by",
            "not known: the recording has no times" if clock is None else f"{1e3 * clock:.1f} ms",
        ),
        ("distance to the arm, rms, as told", f"{1e3 * document['rms_before_m']:.1f} mm"),
        ("distance to the arm, rms, corrected", f"{1e3 * document['rms_after_m']:.1f} mm"),
        ("reach of the cover beyond the arm", f"{1e3 * document['cover_offset_m']:.1f} mm"),
        ("images, points", f"{document['images']}, {document['points']:,}"),
    ):
        table.add_row(name, value)
    terminal.print(table)
    if document["question"]:
        terminal.print(document["question"], style="yellow", highlight=False, markup=False, soft_wrap=True)
    for words in document["off"]:
        terminal.print(
            f"the camera is {words}", style="yellow", highlight=False, markup=False, soft_wrap=True
        )
    if document["as_told"]:
        terminal.print("[green]✓[/green] the camera is where it is said to be", highlight=False)
