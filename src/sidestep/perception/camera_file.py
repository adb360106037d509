"""The file `camera.json` of a folder of depth images."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep.perception.camera_record import CameraRecord
from sidestep.perception.rounded_pose import rounded_pose
from sidestep.storage.whole_file import write_text

Pose = str | npt.ArrayLike | None  # name of one of a file's poses, a pose (4, 4), or what the file says
_OPTIONAL = ("distortion_model", "distortion", "link", "unit")


def read_camera(path: Path, *, pose: Pose = None) -> CameraRecord:
    """The camera of a file: as `write_camera` writes it, or with a matrix `K` (3, 3).

    A file with `K` has `width`, `height`, `depth_unit_m` [m], images without distortion, and `T_base_camera`: null, the
    pose (4, 4) of the camera, or several poses by name, of which `pose` chooses one. Such a camera is called like its
    folder.

    Args:
        path: the file.
        pose: name of one of its poses; a pose (4, 4) instead; None: its only one, or none.

    Raises:
        ValueError: the file is malformed, or the choice of a pose is open or unknown; names the file and the poses.
    """
    owner = f"camera file '{path}'"
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"{owner} is not JSON: {error}") from error
    if not isinstance(content, dict):
        raise ValueError(f"{owner} holds {type(content).__name__}, must be an object")
    try:
        record = _of_matrix(content, path, pose) if "K" in content else _of_names(content, owner, pose)
    except KeyError as error:
        raise ValueError(f"{owner} has no {error}; it has {', '.join(content)}") from error
    except TypeError as error:
        raise ValueError(f"{owner}: {error}") from error
    return record


def write_camera(path: Path, camera: CameraRecord) -> None:
    """Writes a camera as JSON: the attributes of `CameraRecord` by name, its pose as four rows or null."""
    names = ("name", "width", "height", "fx", "fy", "cx", "cy", "distortion_model", "link", "unit")
    content = {name: getattr(camera, name) for name in names}
    content["distortion"] = camera.distortion.tolist()
    content["pose"] = None if camera.pose is None else camera.pose.tolist()
    write_text(path, json.dumps(content, indent=1) + "\n")


def _of_names(content: Mapping[str, Any], owner: str, pose: Pose) -> CameraRecord:
    needed = {name: content[name] for name in ("name", "width", "height", "fx", "fy", "cx", "cy")}
    optional = {name: content[name] for name in _OPTIONAL if name in content}
    unknown = content.keys() - needed.keys() - set(_OPTIONAL) - {"pose"}
    if unknown:
        raise ValueError(
            f"{owner}: unknown {', '.join(sorted(unknown))}, allowed: {', '.join((*needed, *_OPTIONAL, 'pose'))}"
        )
    return CameraRecord(**needed, **optional, pose=chosen_pose(content.get("pose"), pose, owner=owner))


def _of_matrix(content: Mapping[str, Any], path: Path, pose: Pose) -> CameraRecord:
    owner = f"camera file '{path}'"
    distortion = str(content.get("distortion", "none"))
    if not distortion.startswith("none"):
        raise ValueError(f"{owner}: distortion is {distortion!r}, must be 'none' beside K")
    fx, fy, cx, cy = pinhole(content["K"], owner)
    return CameraRecord(
        name=path.resolve().parent.name,
        width=content["width"],
        height=content["height"],
        fx=fx,
        fy=fy,
        cx=cx,
        cy=cy,
        pose=chosen_pose(content.get("T_base_camera"), pose, owner=owner),
        unit=content["depth_unit_m"],
    )


def pinhole(matrix: npt.ArrayLike, owner: str) -> tuple[float, float, float, float]:
    """fx, fy, cx, cy of an intrinsic matrix (3, 3).

    Raises:
        ValueError: it is no such matrix; names the owner.
    """
    K = np.asarray(matrix, dtype=np.float64)
    rest = K.copy() if K.shape == (3, 3) else np.ones((3, 3))
    rest[[0, 1, 0, 1], [0, 1, 2, 2]] = 0.0
    if not np.array_equal(rest, np.diag([0.0, 0.0, 1.0])):
        raise ValueError(f"{owner}: K is {K.tolist()}, must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]")
    return float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2])


def chosen_pose(said: Any, pose: Pose, *, owner: str) -> npt.NDArray[np.float64] | None:
    """The pose (4, 4) of a camera.

    Args:
        said: by a file: nothing, a pose, or poses by name.
        pose: the name of one of them, or a pose instead; None: the only one.
        owner: what an error calls the file.

    Raises:
        ValueError: the choice is open, or a name is unknown; names the poses.
    """
    poses = said if isinstance(said, Mapping) else {}
    if pose is not None and not isinstance(pose, str):
        return rounded_pose(pose, f"{owner}: pose")
    if isinstance(pose, str):
        if pose not in poses:
            known = f"it has {', '.join(map(repr, poses))}" if poses else "it has no poses by name"
            raise ValueError(f"{owner}: no pose {pose!r}; {known}")
        said = poses[pose]
    elif len(poses) > 1:
        raise ValueError(f"{owner} has several poses, choose one: {', '.join(map(repr, poses))}")
    elif poses:
        ((_, said),) = poses.items()
    return None if said is None or said == {} else rounded_pose(said, f"{owner}: pose")
