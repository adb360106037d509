"""Obstacles of the studio: a scenario's obstacle with the solids of it and the points that are seen."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sidestep.distance import SceneObject
from sidestep.math.pose import moved, pose_at
from sidestep.obstacles import merge_in_voxels
from sidestep.scenario import Scenario
from sidestep.scenario.assembly import pose_of, solids
from sidestep.scenario.perception import View, cloud_balls, view_of
from sidestep.scenario.scenario import Obstacle, Vector3
from sidestep.scenario.shape import PointSource
from sidestep.shapes import Box, Sphere

Array = npt.NDArray[np.float64]

CLOUD_SPACING = 0.025  # [m] between points of a cloud that is made here, and of one that is thinned, at first
CLOUD_RADIUS = 0.012  # [m] of the ball around each point
CLOUD_LIMIT = 400  # points: each is a ball for the physics, and the scene is built again with every change


@dataclass(frozen=True)
class SceneObstacle:
    """An obstacle on the stage.

    Args:
        name: unique on the stage.
        obstacle: what it is and where it starts; its `points` and `spacing` say what is seen of it.
        folder: what the file names of its shape refer to.

    Raises:
        ValueError, OSError: a file that is missing or malformed; a cloud of too many points.
    """

    name: str
    obstacle: Obstacle
    folder: Path

    def __reduce__(self) -> tuple[type[SceneObstacle], tuple[str, Obstacle, Path]]:
        return SceneObstacle, (self.name, self.obstacle, self.folder)  # without what can be made again

    @cached_property
    def start(self) -> Array:
        """Pose (4, 4) in the world at the start."""
        return pose_of(self.obstacle)

    @property
    def cloud(self) -> Array | None:
        """Points (n, 3) of a point cloud in its frame [m], None of another shape."""
        return None if self._cloud_balls is None else self._cloud_balls[0]

    @cached_property
    def _cloud_balls(self) -> tuple[Array, float] | None:
        shape = self.obstacle.shape
        if not isinstance(shape, PointSource):
            return None
        points, radius = cloud_balls(shape, (self.folder / shape.file).resolve())
        if len(points) > CLOUD_LIMIT:
            raise ValueError(
                f"{self.name}: the cloud has {len(points)} points; the studio takes at most {CLOUD_LIMIT}: "
                "give the shape a voxel, which merges those in a cell of that edge [m]"
            )
        return points, radius

    @cached_property
    def solids(self) -> tuple[SceneObject, ...]:
        """What it is made of, at the start: one solid, or a ball for each point of a cloud."""
        if self._cloud_balls is not None:
            cloud, radius = self._cloud_balls
            return tuple(
                SceneObject(
                    f"{self.name}.{k}",
                    Sphere.kind,
                    size=(radius,),
                    pose=self.start @ pose_at(p),
                    motion="moving",
                )
                for k, p in enumerate(cloud)
            )
        bare = dataclasses.replace(self.obstacle, velocity=(0.0, 0.0, 0.0), motion=None)
        scenario = Scenario(name=self.name, robot=None, start=None, goal=None, folder=self.folder)  # type: ignore[arg-type]
        (solid,) = solids(scenario, bare, self.name)
        return (dataclasses.replace(solid, motion="free" if self.obstacle.free else "moving"),)

    @cached_property
    def offsets(self) -> Array:
        """Positions (n, 3) of the solids in the frame of the thing [m]."""
        return np.zeros((1, 3)) if self.cloud is None else self.cloud

    def seen(self, *, bare: bool) -> tuple[Array, Array]:
        """Points (n, 3) in its frame [m] and radii (n,) [m] that the controller is told of, as in `sidestep run`.

        Balls are told as they are; other shapes as balls that cover the surface without a gap. With `bare`, as the
        scenario file asks by `points`.
        """
        if self._cloud_balls is None:
            view = self._bare_view if bare else self._full_view
            return view.points, view.radii
        has_size = not bare or self.obstacle.points == "ball"
        cloud, radius = self._cloud_balls
        return cloud, np.full(len(cloud), radius if has_size else 0.0)

    @cached_property
    def _bare_view(self) -> View:
        return view_of(self.obstacle, self.solids[0], bare=True)

    @cached_property
    def _full_view(self) -> View:
        return view_of(self.obstacle, self.solids[0], bare=False)

    @cached_property
    def middle(self) -> Array:
        """The middle (3,) of a ball that holds it, in its frame [m]."""
        middle: Array = 0.5 * (self.offsets.min(axis=0) + self.offsets.max(axis=0))
        return middle

    @cached_property
    def size(self) -> float:
        """The radius [m] of that ball."""
        return float(
            np.linalg.norm(self.offsets - self.middle, axis=1).max() + self.solids[0].bounding_radius
        )

    @property
    def triangles(self) -> Array:
        """Of its surface where it starts (F, 3, 3) [m]; none of a cloud, which one can look through."""
        if self.cloud is not None:
            return np.zeros((0, 3, 3))
        return moved(np.array(self.solids[0].surface().triangles, dtype=float), self.start)

    def at(self, pose: Array) -> SceneObstacle:
        """The same thing, starting at another pose (4, 4), at rest."""
        position, rotation_deg = written_pose(pose)
        item = dataclasses.replace(
            self.obstacle,
            position=position,
            rotation_deg=rotation_deg,
            velocity=(0.0, 0.0, 0.0),
            motion=None,
        )
        return SceneObstacle(self.name, item, self.folder)


def things_of(scenario: Scenario) -> tuple[SceneObstacle, ...]:
    """The obstacles of a scenario; raises ValueError where two share a name."""
    things = tuple(
        SceneObstacle(item.name or f"obstacle{index}", item, scenario.folder)
        for index, item in enumerate(scenario.obstacles)
    )
    check_names(things)
    return things


def check_names(things: Iterable[SceneObstacle]) -> None:
    """Raises ValueError where two obstacles share a name."""
    names: set[str] = set()
    for thing in things:
        if thing.name in names:
            raise ValueError(f"two obstacles are called {thing.name!r}; names must differ")
        names.add(thing.name)


def thing_of(solid: str, things: Iterable[SceneObstacle]) -> str:
    """The name of the thing that a solid is a part of; its own where it is of none."""
    whole = solid.rpartition(".")[0]
    return whole if any(thing.name == whole and thing.cloud is not None for thing in things) else solid


def ball(name: str, position: Array, radius: float) -> SceneObstacle:
    """A ball at a position (3,) [m] in the world."""
    return SceneObstacle(name, Obstacle(Sphere(radius), _vector(position), points="ball"), Path.cwd())


def box(name: str, position: Array, size: Array) -> SceneObstacle:
    """A box with edge lengths (3,) [m] around a position (3,) [m]."""
    return SceneObstacle(name, Obstacle(Box(_vector(size)), _vector(position), points="surface"), Path.cwd())


def cloud(name: str, position: Array, file: Path, radius: float) -> SceneObstacle:
    """The points of a file (see `load_point_cloud`) around a position, each a ball [m]."""
    shape = PointSource(file=str(file.resolve()), radius=radius)
    return SceneObstacle(name, Obstacle(shape, _vector(position), points="ball"), Path.cwd())


def scattered(size: float, *, seed: int) -> Array:
    """Points (n, 3) [m] at random on an upright square plate of edge `size`, as a camera may see a wall."""
    count = int(np.clip(round((size / CLOUD_SPACING) ** 2), 10, CLOUD_LIMIT // 2))
    rng = np.random.default_rng(seed)
    points = np.zeros((count, 3))
    points[:, 1:] = rng.uniform(-0.5 * size, 0.5 * size, (count, 2))
    return points


def thinned(points: Array) -> tuple[Array, float]:
    """At most `CLOUD_LIMIT` points (n, 3), and the radius [m] of balls around them that hold all that were given.

    Those in one cube are merged, of the smallest cubes that suffice.
    """
    voxel = CLOUD_SPACING
    thin, radii = points, np.zeros(len(points))
    while len(thin) > CLOUD_LIMIT:
        thin, radii = merge_in_voxels(points, voxel=voxel)
        voxel *= 1.25
    return thin, max(CLOUD_RADIUS, float(radii.max(initial=0.0)))


def written_pose(pose: Array) -> tuple[Vector3, Vector3]:
    """Position [m] and roll, pitch, yaw [deg] about fixed axes of a pose (4, 4), as files have them."""
    from scipy.spatial.transform import Rotation

    return _vector(pose[:3, 3]), _vector(Rotation.from_matrix(pose[:3, :3]).as_euler("xyz", degrees=True))


def _vector(values: Array) -> tuple[float, float, float]:
    x, y, z = (float(value) + 0.0 for value in values)  # no minus in front of a zero
    return x, y, z
