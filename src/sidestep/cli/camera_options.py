"""What the commands of `sidestep camera` share: where images come from, with which arm, how wrong poses may be."""

from __future__ import annotations

import json
import math
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from sidestep.cli.bench_output import with_bar
from sidestep.cli.limit_options import by_joint

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt
    from rich.console import Console

    from sidestep import Arm
    from sidestep.perception import CameraRecord, Recording

SourceArgument: TypeAlias = Annotated[
    Path | None, typer.Argument(help="Recording: a folder, an MCAP file or a bag; or use --realsense.")
]
RecordingArgument: TypeAlias = Annotated[
    Path, typer.Argument(help="Recording: a folder of images, an MCAP file or a bag.")
]
RealSenseOption: TypeAlias = Annotated[
    bool, typer.Option("--realsense", help="A RealSense camera at this machine, live.")
]
SerialOption: TypeAlias = Annotated[
    str | None, typer.Option(help="With --realsense: serial number [default: the only camera].")
]
RobotOption: TypeAlias = Annotated[
    str | None,
    typer.Option(help="The arm: a name from `sidestep robots`, a URDF, xacro or MJCF file, or an .arm file."),
]
DraftOption: TypeAlias = Annotated[
    bool, typer.Option("--draft", help="Prepare an arm of a file in seconds, with larger ellipsoids.")
]
PoseOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        metavar="NAME|FILE",
        help="Where the camera is: a pose that the folder names; of a bag a frame of /tf_static; or a file with the "
        "4 × 4 matrix of the optical frame (x right, y down, z forward) in the world [default: as recorded].",
    ),
]
LinkOption: TypeAlias = Annotated[
    str | None, typer.Option(help="Frame of the arm on which the camera is mounted; the pose is in it.")
]
StandsOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--q",
        help="JOINT=VALUE [rad or m] of an arm that stands all the time, in place of recorded joint states; others "
        "are in the middle; may be repeated.",
    ),
]
PoseErrorOption: TypeAlias = Annotated[
    float | None,
    typer.Option(
        "--pose-error-mm", min=0.0, help="By how much the camera may be elsewhere [mm] [default: 5]."
    ),
]
AngleErrorOption: TypeAlias = Annotated[
    float | None,
    typer.Option("--pose-error-deg", min=0.0, help="By how much it may be turned [deg] [default: 0.29]."),
]
ClockErrorOption: TypeAlias = Annotated[
    float | None,
    typer.Option("--clock-error-ms", min=0.0, help="By how much times may be wrong [ms] [default: 5]."),
]
FarOption: TypeAlias = Annotated[
    float | None, typer.Option(min=0.1, help="Largest depth that is believed [m] [default: 4].")
]
RateOption: TypeAlias = Annotated[
    float, typer.Option(min=0.01, help="Images a second, of a folder without times [Hz].")
]


@dataclass(frozen=True, eq=False)
class OpenSource:
    """A source of images, the pose (4, 4) that was given for its camera, and what has to stay open while it is read."""

    recording: Recording
    name: str
    pose: npt.NDArray[np.float64] | None
    stream: AbstractContextManager[object]
    is_live: bool = False

    def records(self, link: str | None = None) -> list[CameraRecord]:
        """Its cameras, where they were said to be.

        Raises:
            ValueError: one pose for several cameras.
        """
        cameras = list(self.recording.cameras)
        if self.pose is not None and len(cameras) > 1:
            names = ", ".join(camera.name for camera in cameras)
            raise ValueError(f"--pose is one matrix, the recording has {len(cameras)} cameras: {names}")
        changes: dict[str, Any] = {} if self.pose is None else {"pose": self.pose}
        changes |= {} if link is None else {"link": link}
        return [replace(camera, **changes) for camera in cameras]


def open_source(
    path: Path | None,
    *,
    realsense: bool = False,
    serial: str | None = None,
    pose: str | None,
    rate: float = 30.0,
    colour: bool = False,
) -> OpenSource:
    """The recording, perhaps with colour images, or the live camera that was asked for.

    Raises:
        ValueError: both or neither, or it is malformed; FileNotFoundError: there is nothing.
    """
    from sidestep.perception import RealSense, open_recording

    if (path is None) != realsense:
        raise ValueError("give either a recording or --realsense")
    matrix = None if pose is None or not Path(pose).is_file() else read_pose(Path(pose))
    if path is None:
        if pose is not None and matrix is None:
            raise ValueError(f"--pose: there is no file '{pose}'")
        camera = RealSense("camera", serial=serial, pose=matrix)
        return OpenSource(camera, "the camera", matrix, camera, is_live=True)
    is_folder = path.is_dir() and not (path / "metadata.yaml").is_file()
    given = matrix if is_folder and matrix is not None else None if matrix is not None else pose
    return OpenSource(
        open_recording(path, pose=given, rate=rate, colour=colour), path.name, matrix, nullcontext()
    )


def read_pose(path: Path) -> npt.NDArray[np.float64]:
    """A pose (4, 4) of a file: JSON or rows of numbers, as `sidestep camera check --out` writes.

    Raises:
        ValueError: it holds no pose; names the file.
    """
    from sidestep.perception.rounded_pose import rounded_pose

    text = path.read_text(encoding="utf-8")
    try:
        rows = (
            json.loads(text)
            if text.lstrip().startswith("[")
            else [line.split() for line in text.splitlines()]
        )
        import numpy as np

        matrix = np.array([row for row in rows if row], dtype=np.float64)
    except (ValueError, TypeError) as error:
        raise ValueError(f"--pose: '{path}' is no matrix: {error}") from error
    return rounded_pose(matrix, f"--pose: '{path}'")


def load_arm(robot: str, terminal: Console, *, draft: bool) -> Arm:
    """The arm of --robot, prepared where it is not yet."""
    from sidestep import Arm

    return with_bar(
        terminal,
        f"preparing {Path(robot).name}",
        lambda show: Arm.load(
            robot,
            draft=draft,
            progress=lambda stage, item, done, in_all: show(done, in_all, f"{stage} {item}"),
        ),
    )


def standing_q(texts: list[str] | None, arm: Arm) -> npt.NDArray[np.float64] | None:
    """The configuration (nv,) of --q; None where it was not given.

    Raises:
        ValueError: a joint is unknown; names those there are.
    """
    if not texts:
        return None
    names = list(arm.robot.coordinate_names)
    import numpy as np

    q = np.array(arm.neutral, dtype=np.float64)
    for joint, value in by_joint(texts, "--q").items():
        if joint not in names:
            raise ValueError(f"--q: the arm has no joint {joint!r}; it has {', '.join(names)}")
        q[names.index(joint)] = value
    return q


def camera_errors(
    pose_error_mm: float | None, pose_error_deg: float | None, clock_error_ms: float | None
) -> dict[str, float | None]:
    """Errors as `DepthCamera` takes them [m], [rad], [s]; None: its default."""
    return {
        "translation_error": None if pose_error_mm is None else 1e-3 * pose_error_mm,
        "rotation_error": None if pose_error_deg is None else math.radians(pose_error_deg),
        "clock_error": None if clock_error_ms is None else 1e-3 * clock_error_ms,
    }
