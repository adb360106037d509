"""Random reach problems: an arm, balls in the space it reaches, a start and a goal that are free."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import coal
import numpy as np
import numpy.typing as npt

from sidestep._core import Obstacles, unlimited_joints
from sidestep.bench.workspace import Space, SweptSpace, Workspace
from sidestep.distance import ExactClearance, SceneObject, SelfCollision
from sidestep.robot import Robot
from sidestep.robot.any_source import is_name, robot_from
from sidestep.robot.catalogue import RECIPES
from sidestep.shapes.mesh_reader import mesh_model

Array = npt.NDArray[np.float64]

RADII = (0.05, 0.10)  # [m] of the balls; of an arm from a file, of its reach
BASE_CLEARANCE = 0.02  # [m] of a ball from what does not move: nearer, it would be in the mounting
CLEARANCE = 0.03  # [m] of start and goal from every ball, exact
TRIES = 50  # configurations drawn for one set of balls before new balls are drawn
SETS = 1000  # sets of balls drawn before the settings are called impossible
TOLERANCE = 1e-3  # [m] of the minimum over a straight line


@dataclass(frozen=True, eq=False)
class ReachProblem:
    """One problem: get from start to goal among balls.

    Attributes:
        robot: name for `Robot.named`, or a description's path.
        seed, index: of which the problem was made.
        start, goal: (nv,) [rad | m].
        centers: (N, 3) [m] of the balls at time 0, world; velocities: (N, 3) [m/s], constant; radii: (N,) [m].
        straight_line_blocked: the straight line in joint space touches a ball where it was at time 0.
    """

    robot: str
    seed: int
    index: int
    start: Array
    goal: Array
    centers: Array
    velocities: Array
    radii: Array
    straight_line_blocked: bool

    @cached_property
    def objects(self) -> tuple[SceneObject, ...]:
        """The balls as solids."""
        return balls(self.centers, self.radii, self.velocities)

    @property
    def changes(self) -> tuple[float, ...]:
        """Nothing comes or goes."""
        return ()

    @property
    def obstacles(self) -> Obstacles:
        """The balls as the controller sees them at time 0: a point with a radius and a velocity each."""
        return self.obstacles_at(0.0)

    def obstacles_at(self, time: float) -> Obstacles:
        """The same at a time [s]."""
        if len(self.centers) == 0:
            return Obstacles.none()
        return Obstacles(self.centers + time * self.velocities, self.radii, self.velocities)


@dataclass(frozen=True)
class ProblemSettings:
    """What problems are drawn.

    Attributes:
        robot: name for `Robot.named`, or a description's path. options: of `Robot.from_urdf` for it, such as `tip`.
        obstacles: number of balls. seed: of all. moving: largest speed of a ball [m/s].

    Raises:
        ValueError: a value out of range.
    """

    robot: str = "fr3"
    obstacles: int = 10
    seed: int = 0
    moving: float = 0.0
    options: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.obstacles < 0:
            raise ValueError(f"obstacles is {self.obstacles}, must not be negative")
        if self.seed < 0:
            raise ValueError(f"seed is {self.seed}, must not be negative")
        if not (np.isfinite(self.moving) and self.moving >= 0.0):
            raise ValueError(f"moving is {self.moving} m/s, must be finite and not negative")


class ProblemGenerator:
    """Draws problem number `index` from (seed, index) alone, so that order and processes do not matter.

    Radii are uniform in 5-10 cm; centres uniform in the volume between 35 % and 100 % of the reach around the
    shoulder (see `Workspace`), at least 2 cm from what does not move. Start and goal are uniform within the
    position limits, among those with exact clearance >= 3 cm at time 0 and no self-collision. Velocities have
    uniform directions and uniform speeds up to `moving`, from a stream of their own: the same problem stands
    still and drifts. There is no floor.

    An arm that is no named one has its balls in the space that its links sweep (see `SweptSpace`), of 5-10 % of its
    reach, and clearances in proportion where that is below 1 m. The goal of a joint that turns freely is the turn
    nearest to the start.

    Args:
        settings: what to draw.
        robot: the robot, if it is loaded already. self_collision: likewise.
    """

    def __init__(
        self,
        settings: ProblemSettings,
        *,
        robot: Robot | None = None,
        self_collision: SelfCollision | None = None,
    ) -> None:
        self.settings = settings
        self.robot = robot or robot_from(settings.robot, settings.options)
        self.self_collision = self_collision or SelfCollision(self.robot)
        # Published results stand on the problems of the named robots.
        self._named = is_name(settings.robot) and settings.robot in {recipe.name for recipe in RECIPES}
        self.workspace: Space = Workspace.of(self.robot) if self._named else SweptSpace.of(self.robot)
        reach = self.workspace.reach
        self._size = 1.0 if self._named else reach  # of the balls
        self._scale = 1.0 if self._named else min(1.0, reach)  # of clearances
        self._clearance = ExactClearance(self.robot, ())
        moves = {frame.name: frame.joint >= 0 for frame in self.robot.frames}
        meshes = [
            (mesh, self.robot.pose(self.robot.neutral, link.name))
            for link in self.robot.links
            if not moves[link.name] and (mesh := self.robot.collision_mesh(link.name)) is not None
        ]
        self._immobile = [(mesh_model(mesh), coal.Transform3s(X[:3, :3], X[:3, 3])) for mesh, X in meshes]

    def problem(self, index: int) -> ReachProblem:
        """Problem number `index`.

        Raises:
            ValueError: no start and goal were found among 1000 sets of balls.
        """
        settings = self.settings
        rng = np.random.default_rng((settings.seed, index))
        for _ in range(SETS):
            centers, radii = self._balls(rng)
            clearance = self._clearance.among(balls(centers, radii))
            ends = self._ends(rng, clearance)
            if ends is not None:
                break
        else:
            raise ValueError(
                f"no start and goal with {100 * self._scale * CLEARANCE:.2g} cm clearance found among {SETS} sets of "
                f"{settings.obstacles} obstacles for {settings.robot!r}: ask for fewer obstacles"
            )
        drift = np.random.default_rng((settings.seed, index, 1))
        velocities = np.array(
            [drift.uniform(0.0, settings.moving) * self.workspace.direction(drift) for _ in centers]
        ).reshape(-1, 3)
        if not self._named:
            ends = ends[0], self._nearest_turn(ends[1], ends[0])
        line = clearance.decided_minimum(np.array(ends), tolerance=TOLERANCE)
        return ReachProblem(
            robot=settings.robot,
            seed=settings.seed,
            index=index,
            start=ends[0],
            goal=ends[1],
            centers=centers,
            velocities=velocities,
            radii=radii,
            straight_line_blocked=line.clearance.distance <= 0.0,
        )

    def _balls(self, rng: np.random.Generator) -> tuple[Array, Array]:
        centers: list[Array] = []
        radii: list[float] = []
        while len(centers) < self.settings.obstacles:
            center, radius = self.workspace.sample(rng), self._size * rng.uniform(*RADII)
            if self._from_base(center) >= radius + self._scale * BASE_CLEARANCE:
                centers.append(center)
                radii.append(radius)
        return np.array(centers).reshape(-1, 3), np.array(radii)

    def _nearest_turn(self, q: Array, other: Array) -> Array:
        turn = 2.0 * np.pi
        free = np.array(unlimited_joints(self.robot))
        return np.asarray(np.where(free, q + turn * np.round((other - q) / turn), q))

    def _from_base(self, point: Array) -> float:
        at, ball = coal.Transform3s(np.eye(3), point), coal.Sphere(1e-9)
        return min(
            (
                float(coal.distance(model, X, ball, at, coal.DistanceRequest(), coal.DistanceResult()))
                for model, X in self._immobile
            ),
            default=float("inf"),
        )

    def _ends(self, rng: np.random.Generator, clearance: ExactClearance) -> tuple[Array, Array] | None:
        found: list[Array] = []
        for _ in range(TRIES):
            q = self.robot.random_configuration(rng)
            if clearance.distance(q).distance >= self._scale * CLEARANCE and not self.self_collision.touching(
                q
            ):
                found.append(q)
                if len(found) == 2:
                    return found[0], found[1]
        return None


def balls(centers: Array, radii: Array, velocities: Array | None = None) -> tuple[SceneObject, ...]:
    """Balls as solids, moving where they have a velocity."""
    speeds = np.zeros_like(centers) if velocities is None else velocities
    return tuple(
        SceneObject.ball(
            f"obstacle_{k}",
            center,
            radius=float(radius),
            motion="moving" if np.any(velocity != 0.0) else "fixed",
            velocity=velocity,
        )
        for k, (center, radius, velocity) in enumerate(zip(centers, radii, speeds, strict=True))
    )
