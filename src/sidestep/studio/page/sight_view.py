"""What a depth camera sees, in the scene: its frustum, cells in the colours of their kinds, and what moves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import trimesh

from sidestep.math.pose import pose_vector
from sidestep.perception.colours import CELLS, rgb
from sidestep.studio.camera_choice import FOCAL, HEIGHT, WIDTH
from sidestep.studio.page import colours
from sidestep.studio.sight import KINDS, CameraState, Sight

if TYPE_CHECKING:
    import viser

FRUSTUM = 0.12  # [m] depth of the camera that is drawn
EDGE = 2.0 / np.sqrt(
    3.0
)  # edge of a cube in a ball of radius 1: cells are cubes, their obstacles the balls around
MOST = 6000  # cells that are drawn at most: a browser without a graphics card draws them in seconds
DOT = 0.004  # [m] of a cell where nobody has looked: many, and the scene is behind them
MOVING_SIZE = 1.15  # of a moving ball over that of the cell it was made of, which it covers


class SightView:
    """Drawn anew for every image."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._parts: dict[str, Any] = {}
        self._shown = 0
        self._box = trimesh.creation.box((1.0, 1.0, 1.0))
        self._ball = trimesh.creation.icosphere(subdivisions=1)
        self.counts: dict[str, int] = {}  # of what is drawn, by kind

    def show(self, state: CameraState, *, visible: bool) -> None:
        """Shows a state, or nothing."""
        sight = state.sight if visible else None
        if sight is None:
            self.clear()
            return
        if sight.number != self._shown:
            self._shown = sight.number
            self._draw_frustum(sight)
            self._draw_cells(sight)
            self._draw_unseen(sight)
        self._draw_moving(state)

    def clear(self) -> None:
        """Takes everything out of the scene."""
        for part in self._parts.values():
            part.remove()
        self._parts, self._shown, self.counts = {}, 0, {}

    def _draw_frustum(self, sight: Sight) -> None:
        vector = pose_vector(sight.pose)
        part = self._parts.get("frustum")
        if part is None:
            self._parts["frustum"] = self._server.scene.add_camera_frustum(
                "/sight/frustum",
                fov=2.0 * float(np.arctan(0.5 * HEIGHT / FOCAL)),
                aspect=WIDTH / HEIGHT,
                scale=FRUSTUM,
                thickness=2.5,
                thickness_units="screen",
                color=colours.rgb(colours.PULL),
                position=vector[:3],
                wxyz=vector[3:],
            )
        else:
            part.position, part.wxyz = vector[:3], vector[3:]

    def _draw_cells(self, sight: Sight) -> None:
        self.counts = {
            name: int(count)
            for name, count in zip(KINDS, np.bincount(sight.kinds, minlength=len(KINDS)), strict=True)
        }
        step = max(1, -(-len(sight.kinds) // MOST))
        palette = np.array([colours.batched(rgb(CELLS[name])) for name in KINDS], dtype=np.uint8)
        self._batch(
            "cells",
            self._box,
            sight.centres[::step],
            EDGE * sight.radii[::step],
            palette[sight.kinds[::step]],
        )

    def _draw_unseen(self, sight: Sight) -> None:
        self.counts["unseen"] = len(sight.unseen)
        if not len(sight.unseen):
            self._remove("unseen")
            return
        self._parts["unseen"] = self._server.scene.add_point_cloud(
            "/sight/unseen",
            sight.unseen,
            rgb(CELLS["unseen"]),
            point_size=DOT,
            point_shape="circle",
            precision="float32",
        )

    def _draw_moving(self, state: CameraState) -> None:
        self.counts["moving"] = len(state.moving)
        self._batch(
            "moving",
            self._ball,
            state.moving[:, :3].astype(np.float32),
            (MOVING_SIZE * state.moving[:, 3]).astype(np.float32),
            np.array(colours.batched(rgb(CELLS["moving"])), dtype=np.uint8),
        )

    def _batch(
        self,
        name: str,
        unit: trimesh.Trimesh,
        places: npt.NDArray[np.float32],
        sizes: npt.NDArray[np.float32],
        tints: npt.NDArray[np.uint8],
    ) -> None:
        """Many copies of a mesh at places (N, 3), of sizes (N,), in one colour or (N, 3)."""
        if not len(places):
            self._remove(name)
            return
        self._parts[name] = self._server.scene.add_batched_meshes_simple(
            f"/sight/{name}",
            unit.vertices.astype(np.float32),
            unit.faces.astype(np.uint32),
            batched_wxyzs=np.tile(np.array([1.0, 0.0, 0.0, 0.0], dtype=np.float32), (len(places), 1)),
            batched_positions=places,
            batched_scales=sizes,
            batched_colors=tints,
            lod="off",
            flat_shading=True,
            cast_shadow=False,
            receive_shadow=False,
        )

    def _remove(self, name: str) -> None:
        part = self._parts.pop(name, None)
        if part is not None:
            part.remove()
