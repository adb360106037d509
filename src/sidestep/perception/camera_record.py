"""What a source of depth images says about a camera."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import DepthCamera, real_array
from sidestep.math.pose import checked_pose
from sidestep.math.pose import look_at as look_at

DISTORTION_MODELS = ("none", "brown_conrady", "inverse_brown_conrady", "kannala_brandt")


@dataclass(frozen=True, eq=False)
class CameraRecord:
    """A depth camera as its source describes it: size, intrinsics, distortion, unit, and pose where that is known.

    Attributes:
        name: of the camera, as in its frames.
        width, height: of its images [pixel].
        fx, fy, cx, cy: focal lengths and principal point [pixel]; the centre of the first pixel is at (0, 0).
        distortion_model: one of `DISTORTION_MODELS`.
        distortion: (5,): k1, k2, p1, p2, k3 of the Brown-Conrady models, k1 to k4 and 0 of Kannala-Brandt.
        pose: pose (4, 4) of the optical frame (x right, y down, z forward) in the world, or in `link`; None: not known.
        link: the link of the arm that carries the camera; "" for a camera that stands in the world.
        unit: metres of one step of its images of uint16.

    Raises:
        ValueError: a value is not as said; the message names it.
    """

    name: str
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion_model: str = "none"
    distortion: npt.NDArray[np.float64] = field(default_factory=lambda: np.zeros(5))
    pose: npt.NDArray[np.float64] | None = None
    link: str = ""
    unit: float = 0.001

    def __post_init__(self) -> None:
        if not (isinstance(self.name, str) and self.name):
            raise ValueError(f"name is {self.name!r}, must be the name of a camera")
        owner = f"camera '{self.name}'"
        if not (self.width > 0 and self.height > 0):
            raise ValueError(f"{owner}: size is {self.width} x {self.height} pixels, must be positive")
        for name, value in {"fx": self.fx, "fy": self.fy, "unit": self.unit}.items():
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{owner}: {name} is {value}, must be positive and finite")
        if not (math.isfinite(self.cx) and math.isfinite(self.cy)):
            raise ValueError(f"{owner}: cx, cy are {self.cx}, {self.cy}, must be finite")
        if self.distortion_model not in DISTORTION_MODELS:
            raise ValueError(
                f"{owner}: distortion_model is {self.distortion_model!r}, must be one of {', '.join(DISTORTION_MODELS)}"
            )
        coefficients = real_array(self.distortion, f"{owner}: distortion").copy()
        if coefficients.shape != (5,) or not np.isfinite(coefficients).all():
            raise ValueError(f"{owner}: distortion is {coefficients.tolist()}, must be five finite numbers")
        if self.distortion_model == "none" and coefficients.any():
            raise ValueError(f"{owner}: distortion is {coefficients.tolist()}, must be zero for model 'none'")
        coefficients.setflags(write=False)
        object.__setattr__(self, "distortion", coefficients)
        if self.pose is not None:
            object.__setattr__(self, "pose", checked_pose(self.pose, f"{owner}: pose"))

    def camera(self, **others: Any) -> DepthCamera:
        """The camera of `Perception`; `others`: what a source does not know, such as pose, noise and far.

        Raises:
            ValueError: the pose is not known and not given.
        """
        told: dict[str, Any] = {
            "width": self.width,
            "height": self.height,
            "fx": self.fx,
            "fy": self.fy,
            "cx": self.cx,
            "cy": self.cy,
            "distortion_model": self.distortion_model,
            "distortion": self.distortion,
            "link": self.link,
            "pose": self.pose,
        } | others
        if told["pose"] is None:
            raise ValueError(f"camera '{self.name}': its source does not know where it is; give pose=")
        return DepthCamera(self.name, **told)
