"""Controls of the obstacles: add, place, throw, remove."""

from __future__ import annotations

import atexit
import dataclasses
import shutil
import tempfile
import time as clock
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sidestep.math.pose import from_quaternion, pose_at
from sidestep.obstacles import load_point_cloud
from sidestep.shapes import Box
from sidestep.studio import messages as m
from sidestep.studio.page.goal import GoalControl
from sidestep.studio.page.loop_link import LoopLink
from sidestep.studio.page.note import add_note
from sidestep.studio.page.placing import Ball, Camera, free_place
from sidestep.studio.scene_obstacle import CLOUD_RADIUS, SceneObstacle, ball, box, cloud, scattered, thinned

if TYPE_CHECKING:
    import viser


Array = npt.NDArray[np.float64]

NONE = "(none)"
USUAL_SIDES = (12.0, 12.0, 12.0)  # [cm] of a new box
PLACE_EVERY = 0.2  # [s] between two places that are shown of an obstacle that moves
GIZMO_ROOM = 1.2  # of the length of its arrows: it is drawn on top of all, and takes the mouse


class ObstaclePanel:
    """One obstacle is chosen, by a click in the scene or in the list; the buttons act on it."""

    def __init__(self, server: viser.ViserServer, loop: LoopLink, goal: Callable[[], GoalControl]) -> None:
        self._loop, self._goal = loop, goal
        gui = server.gui
        gui.add_markdown(
            "Drag an obstacle in the scene to move it; with **shift** held, letting go throws it. While the loop is "
            "paused it is put where the mouse is."
        )
        self._kind = gui.add_dropdown("new", ("ball", "box", "cloud"))
        self._size = gui.add_slider(
            "size [cm]",
            min=1.0,
            max=30.0,
            step=0.5,
            initial_value=6.0,
        )
        self._sides: Any = gui.add_vector3(
            "sides [cm]", USUAL_SIDES, min=(0.5,) * 3, max=(300.0,) * 3, step=0.5, visible=False
        )
        self._kind.on_update(lambda _: self._show_sizes())
        gui.add_button("Add").on_click(self._add)
        add_note(
            gui,
            "A ball of this radius, a box with these sides along x, y, z, or a square plate of points with this edge. "
            "It is put near the goal, where there is room.",
        )
        gui.add_upload_button("Add a point cloud file …").on_upload(self._upload)
        add_note(
            gui,
            "A .ply, .pcd, .npy, .npz or text file, thinned to balls that hold its points. It stays at its own "
            "coordinates if the arm is clear of it there.",
        )
        self._folder = Path(tempfile.mkdtemp(prefix="sidestep-studio-"))
        atexit.register(shutil.rmtree, self._folder, ignore_errors=True)
        gui.add_divider()
        self._chosen: Any = gui.add_dropdown("obstacle", (NONE,))
        self._place: Any = gui.add_vector3("position [m]", (0.0, 0.0, 0.0), step=0.01)
        self._place.on_update(self._moved)
        self._box: Any = gui.add_vector3(
            "its sides [cm]", USUAL_SIDES, min=(0.5,) * 3, max=(300.0,) * 3, step=0.5, visible=False
        )
        self._box.on_update(self._resized)
        self._speed = gui.add_slider("speed [m/s]", min=0.1, max=2.0, step=0.1, initial_value=0.5)
        gui.add_button("Throw at the arm").on_click(self._throw)
        add_note(gui, "Throws it from where it is, towards the tip of the arm.")
        remove = gui.add_button("Remove")
        remove.on_click(self._remove)
        self._chosen.on_update(self._chose)
        self._count = 0
        self._shown = (NONE, 0.0, 0.0, 0.0)
        self._box_shown: tuple[str, tuple[float, ...]] = NONE, ()
        self._followed = 0.0
        self._sent: list[tuple[str, Ball]] = []  # added, and not there yet

    def select(self, name: str) -> None:
        """Chooses an obstacle."""
        if name in self._chosen.options:
            self._chosen.value = name

    def refused(self, name: str) -> None:
        """An obstacle that was added is not there, and will not be."""
        self._sent = [(sent, ball) for sent, ball in self._sent if sent != name]

    def set_names(self, names: tuple[str, ...]) -> None:
        """Which obstacles there are; one that was added here is chosen."""
        chosen = next((name for name, _ in reversed(self._sent) if name in names), self._chosen.value)
        self._sent = [(name, ball) for name, ball in self._sent if name not in names]
        self._chosen.options = names or (NONE,)
        self._chosen.value = chosen if chosen in self._chosen.options else self._chosen.options[0]
        self._show_place()

    def _index(self) -> int | None:
        last = self._loop.last
        names = [] if last is None else [thing.name for thing in last.things]
        return names.index(self._chosen.value) if self._chosen.value in names else None

    def _show_place(self) -> None:
        index, last = self._index(), self._loop.last
        if index is not None and last is not None:
            x, y, z = (float(value) for value in last.poses[index][:3, 3].round(3))
            shape = last.things[index].obstacle.shape
            self._box.visible = isinstance(shape, Box)
            if isinstance(shape, Box):
                sides = tuple(round(100.0 * side, 2) for side in shape.size)
                if self._box_shown != (self._chosen.value, sides):
                    self._box_shown = self._chosen.value, sides
                    self._box.value = sides
            if self._shown != (self._chosen.value, x, y, z):  # else it may be typed over just now
                self._shown = self._chosen.value, x, y, z
                self._place.value = (x, y, z)

    def follow(self, snapshot: m.Snapshot) -> None:
        """Shows where the chosen obstacle is; one that moves not so often that the numbers cannot be read."""
        index, now = self._index(), clock.monotonic()
        if index is None:
            return
        moves = snapshot.running and snapshot.velocities[index].any()
        if not moves or now - self._followed >= PLACE_EVERY:
            self._followed = now
            self._show_place()

    def _chose(self, _: Any) -> None:
        self._show_place()

    def _moved(self, event: Any) -> None:
        index, last = self._index(), self._loop.last
        if event.client is None or index is None or last is None:
            return
        self._loop.send(
            m.DragObstacle(self._chosen.value, pose_at(self._place.value, last.poses[index][:3, :3]))
        )

    def _show_sizes(self) -> None:
        """The sizes that the kind of a new obstacle has."""
        self._sides.visible = self._kind.value == "box"
        self._size.visible = self._kind.value != "box"

    def _resized(self, event: Any) -> None:
        index, last = self._index(), self._loop.last
        if event.client is None or index is None or last is None:
            return
        thing = last.things[index]
        x, y, z = (float(side) / 100.0 for side in self._box.value)
        shape = Box((x, y, z))
        self._box_shown = self._chosen.value, tuple(map(float, self._box.value))
        item = dataclasses.replace(thing.obstacle, shape=shape)
        self._loop.send(m.ReplaceObstacle(SceneObstacle(thing.name, item, thing.folder)))

    def _add(self, event: Any) -> None:
        kind, size = str(self._kind.value), self._size.value / 100.0
        name, nowhere = self._new_name(kind), np.zeros(3)
        if kind == "ball":
            made = ball(name, nowhere, size)
        elif kind == "box":
            made = box(name, nowhere, np.array(self._sides.value) / 100.0)
        else:
            made = self._cloud(name, scattered(size, seed=self._count))
        with self._loop.telling(event.client):
            self._put(made, event.client)

    def _upload(self, event: Any) -> None:
        file = event.target.value
        with self._loop.telling(event.client):
            with tempfile.TemporaryDirectory(
                dir=self._folder
            ) as folder:  # apart from the clouds that are there
                path = Path(folder) / Path(file.name).name
                path.write_bytes(file.content)
                points, radius = thinned(np.array(load_point_cloud(path).points))
            self._put(self._cloud(self._new_name("cloud"), points, radius), event.client, as_written=True)

    def _put(self, thing: SceneObstacle, client: Any, *, as_written: bool = False) -> None:
        """Adds a thing where it is free; `as_written`: where its file has it, if it is free there."""
        loop, last = self._loop, self._loop.last
        if last is None:
            raise ValueError("the loop does not run yet")
        others = [
            (pose[:3, :3] @ present.middle + pose[:3, 3], present.size)
            for present, pose in zip(last.things, last.poses, strict=True)
        ]
        goal, camera = self._goal(), client.camera
        place = free_place(
            loop.robot,
            (last.q, goal.q),
            [*others, *(ball for _, ball in self._sent)],
            (np.array(goal.gizmo.position), GIZMO_ROOM * goal.gizmo.scale),
            thing.size,
            Camera(np.array(camera.position), from_quaternion(np.array(camera.wxyz)), camera.fov),
            first=(thing.middle,) if as_written else (),
        )
        self._sent.append((thing.name, (place, thing.size)))
        loop.send(m.AddObstacle(thing.at(pose_at(place - thing.middle))))

    def _cloud(self, name: str, points: Array, radius: float = CLOUD_RADIUS) -> SceneObstacle:
        path = self._folder / f"{name}.npy"
        np.save(path, points)
        return cloud(name, np.zeros(3), path, radius)

    def _new_name(self, kind: str) -> str:
        taken = () if self._loop.last is None else {thing.name for thing in self._loop.last.things}
        while (name := f"{kind}{self._count}") in taken:
            self._count += 1
        self._count += 1
        return name

    def _throw(self, _: Any) -> None:
        index, last = self._index(), self._loop.last
        if index is None or last is None:
            return
        way = self._loop.robot.pose(last.q, self._loop.tip)[:3, 3] - last.poses[index][:3, 3]
        length = float(np.linalg.norm(way))
        if length > 0.0:
            self._loop.send(m.ThrowObstacle(self._chosen.value, self._speed.value * way / length))

    def _remove(self, _: Any) -> None:
        if self._index() is not None:
            self._loop.send(m.RemoveObstacle(self._chosen.value))
