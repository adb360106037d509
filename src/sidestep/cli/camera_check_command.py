"""`sidestep camera check`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

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
    from sidestep.perception import CameraCorrection, DepthCamera

APART = (
    100.0  # [s] between two images of a recording without times: the arm stands in each, no clock is measured
)


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
        import numpy as np

        np.savetxt(out, documents[0]["pose"], fmt="%.9f")
        terminal.print(f"Pose: {out}", highlight=False, markup=False, soft_wrap=True)
    if json is not None:
        write_json({"cameras": documents}, json)
    raise typer.Exit(0 if all(document["as_told"] for document in documents) else 1)


def _corrections(
    opened: OpenSource, arm: Arm, cameras: list[DepthCamera], terminal: Console
) -> list[CameraCorrection]:
    """What `CameraCheck` finds of each camera, from all images with a joint state."""
    from sidestep.perception import CameraCheck
    from sidestep.perception.playback import joint_order

    order = joint_order(opened.recording.joint_names, arm.robot.coordinate_names)
    checks = {camera.name: CameraCheck(arm, camera) for camera in cameras}
    timed, latest = opened.recording.times_known, -math.inf
    with counted(terminal, "reading", opened.recording) as tell:
        for number, frame in enumerate(opened.recording.frames(), start=1):
            tell(number)
            if frame.q is None:
                continue
            q, time = frame.q[order], frame.time if timed else APART * number
            for moment in (time,) if timed else (time - 0.25 * APART, time + 0.25 * APART):
                if moment > latest:  # two cameras may have one time
                    for one in checks.values():
                        one.add_state(q, time=moment)
                    latest = moment
            unit = frame.unit if frame.depth.dtype == "uint16" else None
            checks[frame.camera].add(frame.depth, time=time, unit=unit)
    return [checks[camera.name].solve() for camera in cameras]


def camera_document(camera: DepthCamera, found: CameraCorrection, *, times_known: bool) -> dict[str, Any]:
    """A correction as JSON has it, and whether it is within the errors that the camera was said to have.

    Args:
        camera: with the errors it is said to have.
        found: a `CameraCorrection`.
        times_known: whether the recording has times; the clock is not judged where it has none.
    """
    # Of a recording without times the core asks after the clock, in vain.
    question = found.question if times_known else ""
    clock = found.clock_offset if times_known and math.isfinite(found.clock_offset) else None
    repeats = found.translation_spread > 0.0  # else too few images to take half of them
    off = []
    if found.translation > camera.translation_error:
        off.append(
            f"{1e3 * found.translation:.1f} mm away, more than {1e3 * camera.translation_error:.1f} mm"
        )
    if found.rotation > camera.rotation_error:
        off.append(
            f"turned by {math.degrees(found.rotation):.2f}°, more than {math.degrees(camera.rotation_error):.2f}°"
        )
    if clock is not None and abs(clock) > camera.clock_error:
        off.append(f"its clock off by {1e3 * clock:.1f} ms, more than {1e3 * camera.clock_error:.1f} ms")
    return {
        "camera": camera.name,
        "as_told": not off and not question,
        "off": off,
        "question": question or None,
        "translation_m": found.translation,
        "translation_spread_m": found.translation_spread if repeats else None,
        "rotation_rad": found.rotation,
        "rotation_spread_rad": found.rotation_spread if repeats else None,
        "clock_offset_s": clock,
        "clock_spread_s": found.clock_spread if repeats and clock is not None else None,
        "rms_before_m": found.rms_before,
        "rms_after_m": found.rms_after,
        "overshoot_m": found.overshoot,
        "images": found.images,
        "points": found.points,
        "pose": found.pose.tolist(),
    }


def _print(document: dict[str, Any], terminal: Console) -> None:
    from rich.markup import escape

    def measured(name: str, spread: str, factor: float, form: str) -> str:
        if document[name] is None:
            return "not known"
        within = "" if document[spread] is None else f" ± {factor * document[spread]:{form}}"
        return f"{factor * document[name]:{form}}{within}"

    degree = math.degrees(1.0)
    table = figures_table(document["camera"], "")
    for name, value in (
        ("moved by [mm]", measured("translation_m", "translation_spread_m", 1e3, ".1f")),
        ("turned by [deg]", measured("rotation_rad", "rotation_spread_rad", degree, ".2f")),
        ("clock off by [ms]", measured("clock_offset_s", "clock_spread_s", 1e3, ".1f")),
        ("points to arm, rms, as told [mm]", f"{1e3 * document['rms_before_m']:.1f}"),
        ("points to arm, rms, corrected [mm]", f"{1e3 * document['rms_after_m']:.1f}"),
        ("cover beyond the arm, taken off [mm]", f"{1e3 * document['overshoot_m']:.1f}"),
        ("images, points", f"{document['images']}, {document['points']:,}"),
    ):
        table.add_row(escape(name), value)
    terminal.print(table)
    if document["question"]:
        terminal.print(document["question"], style="yellow", highlight=False, markup=False, soft_wrap=True)
    for words in document["off"]:
        terminal.print(
            f"the camera is {words}", style="yellow", highlight=False, markup=False, soft_wrap=True
        )
    if document["as_told"]:
        terminal.print("[green]✓[/green] the camera is where it is said to be", highlight=False)
