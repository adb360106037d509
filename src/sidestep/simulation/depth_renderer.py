"""Depth and geoms of a MuJoCo scene, seen through a pinhole camera."""

from __future__ import annotations

import atexit
import copy
import os
import sys
import weakref
from typing import Any, Literal, get_args

import mujoco
import numpy as np
import numpy.typing as npt

from sidestep.simulation.arm_model import VISUAL_GROUP
from sidestep.simulation.model import SimulationModel

Array = npt.NDArray[np.float64]
Depth = npt.NDArray[np.float32]
Indices = npt.NDArray[np.int32]
LinkSurface = Literal["visual", "collision"]

# Clipping planes [m]. Objects that are not there wait 100 m away.
NEAREST, FARTHEST = np.float32(5e-3), np.float32(99.0)
# Coefficients of z = B / (buffer + A), rounded as OpenGL's projection matrix has them: A is a small difference.
A = np.float32(0.5) * ((FARTHEST + NEAREST) / (FARTHEST - NEAREST)) - np.float32(0.5)
B = FARTHEST * NEAREST / (FARTHEST - NEAREST)
SLICES, STACKS = 192, 96  # of round geoms: the facets of a sphere are at most 3e-4 of its radius inside it
HIDDEN_GROUP = 5  # MuJoCo's last group, which this option never draws
DRAWN_GROUPS = (1, 1, 1, 1, 1, 0)


class DepthRenderer:
    """Draws a copy of a model by OpenGL without a window, once per image for depth and geoms together.

    Both sides of a surface are drawn. Pixel (row i, column j) is the ray through x = (j - cx) / fx, y = (i - cy) / fy,
    z = 1 of the optical frame (x right, y down, z forward), so that whole numbers are the centres of pixels.

    Args:
        built: the model.
        size: (width, height) of the images [pixel].
        focal: (fx, fy) [pixel].
        centre: principal point (cx, cy) [pixel], anywhere.
        links: "visual": as their visual meshes, and those without any as their collision parts; "collision": as their
            convex collision parts, which are larger by up to some 15 mm and are drawn ten times as fast.

    Raises:
        ValueError: `links` is another.
        RuntimeError: OpenGL cannot start; says what to install.
    """

    def __init__(
        self,
        built: SimulationModel,
        *,
        size: tuple[int, int],
        focal: tuple[float, float],
        centre: tuple[float, float],
        links: LinkSurface = "visual",
    ) -> None:
        self._gl: Any = None
        self._context: mujoco.MjrContext | None = None
        self.width, self.height = size
        (fx, fy), (cx, cy) = focal, centre
        # Sides of the image on the plane at NEAREST: left, right, bottom and top, half a pixel outside the centres.
        columns, rows = np.array([-0.5, self.width - 0.5]), np.array([self.height - 0.5, -0.5])
        self._sides = NEAREST * np.concatenate([(columns - cx) / fx, (cy - rows) / fy])
        self._model = _drawn_model(built, self.width, self.height, links)
        self._scene = mujoco.MjvScene(self._model, maxgeom=self._model.ngeom + 1)
        self._scene.flags[:] = 0
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SEGMENT] = 1
        self._scene.flags[mujoco.mjtRndFlag.mjRND_IDCOLOR] = 1
        self._option, self._free = mujoco.MjvOption(), mujoco.MjvCamera()
        self._option.geomgroup[:] = DRAWN_GROUPS
        self._rectangle = mujoco.MjrRect(0, 0, self.width, self.height)
        self._colours = np.empty((self.height, self.width, 3), dtype=np.uint8)
        self._buffer = np.empty((self.height, self.width), dtype=np.float32)
        self._gl = _start_opengl(self.width, self.height)
        self._gl.make_current()
        self._context = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_50.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        self._context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        if not _open:  # after EGL has put its own end there, so that this comes before it
            atexit.register(_close_all)
        _open.add(self)

    def render(self, data: mujoco.MjData, X_WC: Array) -> tuple[Depth, Indices]:
        """Depth (height, width) [m] along the optical axis, 0 where nothing is, and the geom that each pixel shows, or
        -1, with the bodies where the kinematics of `data` have them.

        Raises:
            RuntimeError: the renderer is closed.
        """
        if self._context is None:
            raise RuntimeError("this renderer is closed: no more images come from it")
        model, scene = self._model, self._scene
        mujoco.mjv_updateScene(
            model, data, self._option, None, self._free, mujoco.mjtCatBit.mjCAT_ALL.value, scene
        )
        left, right, bottom, top = self._sides
        for camera in scene.camera:  # MuJoCo draws from the mean of two eyes
            camera.pos, camera.forward, camera.up = X_WC[:3, 3], X_WC[:3, 2], -X_WC[:3, 1]
            camera.frustum_near, camera.frustum_far, camera.orthographic = NEAREST, FARTHEST, 0
            camera.frustum_center, camera.frustum_width = 0.5 * (left + right), 0.5 * (right - left)
            camera.frustum_bottom, camera.frustum_top = bottom, top
        self._gl.make_current()
        mujoco.mjr_render(self._rectangle, scene, self._context)
        mujoco.mjr_readPixels(self._colours, self._buffer, self._rectangle, self._context)
        geom_of = np.full(model.ngeom + 2, -1, dtype=np.int32)  # by colour: 0 is the background
        for item in scene.geoms[: scene.ngeom]:
            if item.segid >= 0 and item.objtype == mujoco.mjtObj.mjOBJ_GEOM:
                geom_of[item.segid + 1] = item.objid
        colours = self._colours[::-1]  # OpenGL's first row is the lowest
        colour = colours[..., 0].astype(np.uint32)
        for channel, factor in ((1, 256), (2, 65536)):
            if model.ngeom + 1 >= factor:
                colour += factor * colours[..., channel].astype(np.uint32)
        geoms = geom_of[colour]
        depth: Depth = B / (self._buffer[::-1] + A)
        depth[geoms < 0] = 0.0
        return depth, geoms

    def close(self) -> None:
        """Gives back what OpenGL holds."""
        if self._context is not None:
            self._gl.make_current()
            self._context.free()
        self._context = None
        if self._gl is not None:
            self._gl.free()
        self._gl = None

    def __del__(self) -> None:
        self.close()


_open: weakref.WeakSet[DepthRenderer] = weakref.WeakSet()


def _close_all() -> None:
    """Closes what is open at the end of the program, while OpenGL still runs."""
    for renderer in list(_open):
        renderer.close()


def _drawn_model(built: SimulationModel, width: int, height: int, links: LinkSurface) -> mujoco.MjModel:
    """A copy of the model for drawing: room for the image, one sample a pixel, fine spheres, each link once."""
    if links not in get_args(LinkSurface):
        raise ValueError(f"links is {links!r}, allowed: {', '.join(get_args(LinkSurface))}")
    model = copy.copy(built.model)
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    model.vis.quality.offsamples, model.vis.quality.shadowsize = 0, 0
    model.vis.quality.numslices, model.vis.quality.numstacks = SLICES, STACKS
    names = [model.geom(geom).name for geom in range(model.ngeom)]
    visual = [geom for geom, group in enumerate(model.geom_group) if group == VISUAL_GROUP]
    # Visual meshes are named visual:LINK:NUMBER.
    with_visuals = {names[geom].removeprefix("visual:").rsplit(":", 1)[0] for geom in visual}
    collision = [geom for geom, (role, _) in built.geom_owner.items() if role == "link"]
    twice = [geom for geom in collision if built.geom_owner[geom][1] in with_visuals]
    model.geom_group[visual if links == "collision" else twice] = HIDDEN_GROUP
    return model


def _start_opengl(width: int, height: int) -> Any:
    """OpenGL's context without a window: on Linux by EGL, unless MUJOCO_GL is set; else MuJoCo's choice."""
    headless = sys.platform == "linux" and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    )
    if headless and not os.environ.get("MUJOCO_GL"):
        os.environ["MUJOCO_GL"] = "egl"  # MuJoCo's library reads it as well
    choice = os.environ.get("MUJOCO_GL", "").lower() or ("egl" if sys.platform == "linux" else "")
    try:
        if headless and choice not in ("egl", "osmesa"):  # MuJoCo would end the process
            raise OSError(f"MUJOCO_GL is {choice!r} and there is no display")
        if choice == "egl":  # also where `import mujoco` has chosen another before
            from mujoco.egl import GLContext
        else:
            from mujoco.gl_context import GLContext
        return GLContext(width, height)
    except Exception as error:  # PyOpenGL, EGL and GLFW each raise their own
        raise RuntimeError(
            f"simulated cameras need OpenGL, which does not start ({type(error).__name__}: {error}); without a display "
            "set MUJOCO_GL=egl and install EGL: on Debian and Ubuntu the packages libegl1 and libgl1-mesa-dri"
        ) from error
