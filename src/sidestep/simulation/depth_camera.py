"""A depth camera in MuJoCo: what it sees, when that arrives, and what is true."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Protocol

import mujoco
import numpy as np
import numpy.typing as npt

from sidestep.math.matrices import product
from sidestep.math.pose import checked_pose
from sidestep.math.pose import look_at as look_at
from sidestep.simulation.depth_noise import DepthNoiseModel, noise_model
from sidestep.simulation.depth_renderer import DepthRenderer, LinkSurface
from sidestep.simulation.model import SimulationModel

Array = npt.NDArray[np.float64]

NOTHING, ARM, OTHER = 0, 1, 2  # whose surface a pixel shows
ROUNDING = 1e-9  # [s] by which sums of periods are off


class CameraGeometry(Protocol):
    """What a simulated camera needs to know: a pinhole and where it is, as `sidestep.perception.DepthCamera` has them.

    Attributes:
        name: of the camera.
        width, height: of the image [pixel].
        fx, fy, cx, cy: focal lengths and principal point [pixel]; whole numbers are the centres of pixels.
        distortion_model: "none"; MuJoCo draws straight lines straight.
        pose: (4, 4) of the optical frame (x right, y down, z forward): in the world, or in `link`.
        link: of the arm that carries it; "": fixed in the world.
        near, far: depths that are seen [m].
    """

    @property
    def name(self) -> str: ...
    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def fx(self) -> float: ...
    @property
    def fy(self) -> float: ...
    @property
    def cx(self) -> float: ...
    @property
    def cy(self) -> float: ...
    @property
    def distortion_model(self) -> str: ...
    @property
    def pose(self) -> Any: ...
    @property
    def link(self) -> str: ...
    @property
    def near(self) -> float: ...
    @property
    def far(self) -> float: ...


@dataclass(frozen=True, eq=False)
class SimulatedImage:
    """One image with its truth.

    Attributes:
        camera: name of the camera.
        time: of the capture [s].
        depth: (H, W) measured depth along the optical axis [m], 0 where nothing is measured.
        true_depth: (H, W) depth without noise and without the limits of the range [m], 0 where nothing is.
        owner: (H, W) whose surface the pixel truly shows: 0 nothing, 1 a link of the arm or what it holds, 2 other.
        geom: (H, W) index of MuJoCo's geom that the pixel truly shows, -1 nothing.
        pose: (4, 4) of the optical frame in the world at the capture.
    """

    camera: str
    time: float
    depth: npt.NDArray[np.float32]
    true_depth: npt.NDArray[np.float32]
    owner: npt.NDArray[np.uint8]
    geom: npt.NDArray[np.int32]
    pose: Array


class SimulatedCamera:
    """A depth camera among the bodies of a MuJoCo model, with noise, latency and lost images.

    Every image has its own random numbers, of the seed and its count: two cameras with one seed agree, whatever is
    lost.

    Args:
        model: of the robot and the scene.
        camera: its geometry.
        noise: "none", "d435", "kinect", "structured_light", or a noise model with other values.
        latency: from the capture to the delivery [s].
        lost: share of images in [0, 1] that never arrive.
        rate: of the images that `observe` takes [Hz].
        seed: of the noise and of what is lost.
        links: "visual": links look like their visual meshes, those without any like their collision parts;
            "collision": like their convex collision parts, which are drawn ten times as fast.

    Raises:
        ValueError: a distortion model other than "none", an unknown noise or link, or a value outside its range.
        RuntimeError: OpenGL cannot start; says what to install.
    """

    def __init__(
        self,
        model: SimulationModel,
        camera: CameraGeometry,
        *,
        noise: str | DepthNoiseModel = "none",
        latency: float = 0.0,
        lost: float = 0.0,
        rate: float = 30.0,
        seed: int = 0,
        links: LinkSurface = "visual",
    ) -> None:
        _check(model, camera, latency, lost, rate)
        self.camera, self.latency, self.lost, self.seed = camera, float(latency), float(lost), seed
        self._model = model
        self._X_LC = checked_pose(camera.pose, f"camera {camera.name!r}: pose")
        self._noise = noise_model(noise)
        self._owner = _owners(model)
        self._count = 0
        self._on_the_way: deque[SimulatedImage] = deque()
        self.rate = float(rate)
        self._last, self._due = -np.inf, -np.inf
        self._renderer = DepthRenderer(
            model,
            size=(camera.width, camera.height),
            focal=(camera.fx, camera.fy),
            centre=(camera.cx, camera.cy),
            links=links,
        )

    def capture(
        self, data: mujoco.MjData, time: float, *, attached: Sequence[str] = ()
    ) -> SimulatedImage | None:
        """The image of the bodies where `data` has the joints, free and moving objects; None if it is lost.

        The forward kinematics of `data` are computed anew, and nothing else in it changes. The image also comes from
        `delivered`, in time.

        Args:
            data: the state of the model.
            time: of the capture [s], later than that of the image before.
            attached: names of the scene's objects that the arm holds: their pixels count as the arm's.

        Raises:
            ValueError: the time is not later, or the scene has no such object.
            RuntimeError: the camera is closed.
        """
        if not (np.isfinite(time) and time > self._last):
            raise ValueError(f"camera {self.camera.name!r}: time is {time}, allowed: later than {self._last}")
        owner_of = self._with(attached)
        self._last = time
        rng = np.random.default_rng([self.seed, self._count])
        self._count += 1
        if rng.random() < self.lost:
            return None
        mujoco.mj_kinematics(self._model.model, data)
        X_WC = (
            product(self._model.link_pose(data, self.camera.link), self._X_LC)
            if self.camera.link
            else self._X_LC
        )
        true_depth, geom = self._renderer.render(data, X_WC)
        depth = self._noise.apply(true_depth, self.camera.fx, rng)
        depth[(depth < self.camera.near) | (depth > self.camera.far)] = 0.0
        image = SimulatedImage(
            camera=self.camera.name,
            time=float(time),
            depth=depth,
            true_depth=true_depth,
            owner=owner_of[geom],
            geom=geom,
            pose=X_WC,
        )
        self._on_the_way.append(image)
        return image

    def observe(
        self, data: mujoco.MjData, now: float, *, attached: Sequence[str] = ()
    ) -> list[SimulatedImage]:
        """Takes an image whenever one is due, `rate` times a second, and gives those that arrived by now.

        Call it in every step of a simulation, instead of `capture` and `delivered`.

        Args:
            data, attached: see `capture`.
            now: the time of `data` [s].

        Raises:
            ValueError, RuntimeError: see `capture`.
        """
        if now + ROUNDING >= self._due:
            self.capture(data, now, attached=attached)
            late = not self._due > now - 1.0 / self.rate  # the first one, or after a pause
            self._due = (now if late else self._due) + 1.0 / self.rate
        return self.delivered(now)

    def delivered(self, now: float) -> list[SimulatedImage]:
        """The images that arrived since the last call, oldest first: those with time + latency <= now."""
        arrived = []
        while self._on_the_way and self._on_the_way[0].time + self.latency <= now + ROUNDING:
            arrived.append(self._on_the_way.popleft())
        return arrived

    def close(self) -> None:
        """Gives back what OpenGL holds; what was captured is still delivered."""
        self._renderer.close()

    def __enter__(self) -> SimulatedCamera:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _with(self, attached: Sequence[str]) -> npt.NDArray[np.uint8]:
        """Owner by geom, the last entry for -1, with these objects as the arm's."""
        if not attached:
            return self._owner
        objects = {name: geom for geom, (role, name) in self._model.geom_owner.items() if role == "object"}
        unknown = [name for name in attached if name not in objects]
        if unknown:
            raise ValueError(
                f"attached: no object {unknown[0]!r} in the scene, allowed: {', '.join(objects)}"
            )
        owner = self._owner.copy()
        owner[[objects[name] for name in attached]] = ARM
        return owner


def _owners(model: SimulationModel) -> npt.NDArray[np.uint8]:
    """Owner (ngeom + 1,) by geom, whose last entry is that of geom -1: nothing."""
    raw = model.model
    arm = raw.body_rootid[raw.geom_bodyid] == raw.body("robot_base").id
    return np.append(np.where(arm, ARM, OTHER), NOTHING).astype(np.uint8)


def _check(model: SimulationModel, camera: CameraGeometry, latency: float, lost: float, rate: float) -> None:
    owner = f"camera {camera.name!r}"
    if camera.distortion_model != "none":
        raise ValueError(
            f"{owner}: distortion_model is {camera.distortion_model!r}, allowed in simulation: 'none'; give the "
            "intrinsics of the undistorted image"
        )
    if camera.width < 1 or camera.height < 1 or not (camera.fx > 0.0 and camera.fy > 0.0):
        raise ValueError(
            f"{owner}: width, height, fx, fy are {camera.width}, {camera.height}, {camera.fx}, {camera.fy}, allowed: "
            "positive numbers"
        )
    if not np.isfinite([camera.fx, camera.fy, camera.cx, camera.cy]).all():
        raise ValueError(f"{owner}: cx, cy are {camera.cx}, {camera.cy}, allowed: finite numbers")
    if camera.link and camera.link not in model.link_frames:
        raise ValueError(
            f"{owner}: link is {camera.link!r}, allowed: {', '.join(model.link_frames)}, or '' (world)"
        )
    if not (np.isfinite(latency) and latency >= 0.0):
        raise ValueError(f"{owner}: latency is {latency} s, allowed: 0 and more")
    if not 0.0 <= lost <= 1.0:
        raise ValueError(f"{owner}: lost is {lost}, allowed: 0 to 1")
    if not (np.isfinite(rate) and rate > 0.0):
        raise ValueError(f"{owner}: rate is {rate} Hz, allowed: above 0")
