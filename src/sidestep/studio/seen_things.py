"""What the loop sees of the obstacles: points of each in its frame, and whose each point is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sidestep._core import Obstacles
from sidestep.studio.adapter import STILL
from sidestep.studio.scene_obstacle import SceneObstacle
from sidestep.studio.simulated_scene import MovableObstacle


class SeenThings:
    """The points of things, laid out once.

    Args:
        bare: as the thesis's methods see them, see `SceneObstacle.seen`.
    """

    def __init__(self, things: Sequence[SceneObstacle], *, bare: bool) -> None:
        views = [thing.seen(bare=bare) for thing in things]
        self.things = tuple(things)
        self._views = [points for points, _ in views]
        self._radii = np.concatenate([np.zeros(0), *(radii for _, radii in views)])
        counts = [len(points) for points in self._views]
        self._owners = np.repeat(np.arange(len(counts)), counts)

    def obstacles(self, actors: Sequence[MovableObstacle]) -> Obstacles:
        """Where they are and how they move, of actors in the order of the things."""
        if not actors:
            return Obstacles.none()
        points = [
            view @ actor.pose[:3, :3].T + actor.pose[:3, 3]
            for view, actor in zip(self._views, actors, strict=True)
        ]
        velocities = np.array([actor.velocity for actor in actors])
        velocities[np.linalg.norm(velocities, axis=1) < STILL] = 0.0
        seen = Obstacles(np.concatenate(points), self._radii, velocities[self._owners])
        return seen.named([thing.name for thing in self.things], [len(view) for view in self._views])
