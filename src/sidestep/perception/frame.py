"""One depth image with its capture time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import real_array
from sidestep.math.pose import checked_pose


@dataclass(frozen=True, eq=False)
class Frame:
    """A depth image, when it was captured and where the arm was then: what every source of images yields.

    The depth is z along the optical axis (x right, y down, z forward), not the distance along the ray. Depth in metres
    is `unit * depth`; 0, nan and inf stand for nothing seen.

    Attributes:
        camera: name of the camera.
        time: when the image was captured [s], on the clock that its source states.
        depth: (H, W) of uint16, or of float32 [m]; float64 is rounded to float32. Read-only, not copied.
        unit: metres of one step of the depth; 1 where the depth is in metres already.
        q: joint positions (n,) [rad or m] at `time`, in the order of the source's `joint_names`; None if not known.
        colour: (h, w, 3) uint8, for looking only; None if there is none.
        pose: pose (4, 4) of the camera at `time`, of a camera that the source knows to be elsewhere in each image; None
            where the camera's own pose counts.

    Raises:
        TypeError, ValueError: a value is not as said; the message names it.
    """

    camera: str
    time: float
    depth: npt.NDArray[Any]
    unit: float
    q: npt.NDArray[np.float64] | None = None
    colour: npt.NDArray[np.uint8] | None = None
    pose: npt.NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        if not (isinstance(self.camera, str) and self.camera):
            raise ValueError(f"camera is {self.camera!r}, must be the name of a camera")
        owner = f"frame of camera '{self.camera}'"
        if not math.isfinite(self.time):
            raise ValueError(f"{owner}: time is {self.time} s, must be finite")
        depth = _checked_depth(self.depth, owner)
        if not (math.isfinite(self.unit) and self.unit > 0.0):
            raise ValueError(f"{owner}: unit is {self.unit} m, must be positive and finite")
        if depth.dtype != np.uint16 and self.unit != 1.0:
            raise ValueError(f"{owner}: unit is {self.unit} m, must be 1 for depth in metres ({depth.dtype})")
        object.__setattr__(self, "depth", depth)
        if self.q is not None:
            object.__setattr__(self, "q", _checked_positions(self.q, owner))
        if self.colour is not None:
            colour = np.asarray(self.colour)
            if colour.dtype != np.uint8 or colour.ndim != 3 or colour.shape[2] != 3:
                raise ValueError(
                    f"{owner}: colour is {colour.dtype} {colour.shape}, must be uint8 (h, w, 3): red, green, blue"
                )
        if self.pose is not None:
            object.__setattr__(self, "pose", checked_pose(self.pose, f"{owner}: pose"))

    @property
    def metres(self) -> npt.NDArray[np.float32]:
        """The depth (H, W) in metres, a new array where it is uint16; 0, nan and inf stand for nothing seen."""
        if self.depth.dtype == np.float32:
            return self.depth
        return np.asarray(self.depth * np.float32(self.unit))


def _checked_depth(value: npt.NDArray[Any], owner: str) -> npt.NDArray[Any]:
    """A read-only view of a depth image (H, W) of uint16 or float32."""
    depth = np.asarray(value)
    if depth.ndim != 2 or 0 in depth.shape:
        raise ValueError(f"{owner}: depth has shape {depth.shape}, must be (H, W)")
    if depth.dtype == np.float64:
        depth = depth.astype(np.float32)
    if depth.dtype not in (np.uint16, np.float32):
        raise TypeError(f"{owner}: depth is {depth.dtype}, must be uint16, float32 or float64")
    depth = depth.view()
    depth.setflags(write=False)
    return depth


def _checked_positions(value: npt.ArrayLike, owner: str) -> npt.NDArray[np.float64]:
    q: npt.NDArray[np.float64] = real_array(value, f"{owner}: q").copy()
    if q.ndim != 1 or not np.isfinite(q).all():
        raise ValueError(f"{owner}: q is {q.tolist()}, must be finite joint positions (n,)")
    q.setflags(write=False)
    return q
