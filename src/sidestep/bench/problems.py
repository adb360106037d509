"""Random reach problems: an arm, balls in the space it reaches, a start and a goal that are free."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import coal
import numpy as np
import numpy.typing as npt

from sidestep._core import Obstacles
from sidestep.distance import ExactClearance, SceneObject, SelfCollision
from sidestep.robot import Robot
from sidestep.robot.mesh import mesh_model

Array = npt.NDArray[np.float64]

RADII = (0.05, 0.10)  # [m] of the balls
SHELL = (0.35, 1.0)  # of the reach, between which ball centres lie
BASE_CLEARANCE = 0.02  # [m] of a ball from what does not move: nearer, it would be in the mounting
CLEARANCE = 0.03  # [m] of start and goal from every ball, exact
TRIES = 50  # configurations drawn for one set of balls before new balls are drawn
SETS = 1000  # sets of balls drawn before the settings are called impossible
REACH_SAMPLES = 2000  # configurations from which the reach is measured
LENGTH_DECIMALS = 3  # reach and shoulder are rounded to 1 mm, so that every machine computes the same
TOLERANCE = 1e-3  # [m] of the minimum over a straight line


@dataclass(frozen=True)
class Workspace:
    """Where the tip of an arm gets to: a shell around the shoulder.

    Attributes:
        shoulder: (3,) [m] the point of the first joint's axis from which the farthest tip is nearest.
        reach: [m] distance of that farthest tip.
        directions: (dim, 3) orthonormal; 3 rows, or 2 for an arm that moves in a plane.
    """

    shoulder: Array
    reach: float
    directions: Array

    @classmethod
    def of(cls, robot: Robot) -> Workspace:
        """Measures where the far end of the last link with geometry gets to, on random configurations (seed 0)."""
        rng = np.random.default_rng(0)
        meshes = [(link.name, robot.collision_mesh(link.name)) for link in robot.links]
        tip, vertices = [(name, mesh.vertices) for name, mesh in meshes if mesh is not None][-1]
        away = np.linalg.norm(vertices, axis=1)
        end = np.append(vertices[away > away.max() - 10.0**-LENGTH_DECIMALS].mean(axis=0), 1.0)
        poses = [robot.pose(robot.random_configuration(rng), tip) for _ in range(REACH_SAMPLES)]
        tips = np.array([(X @ end)[:3] for X in poses])
        joint = robot.joints[0]
        axis = joint.placement[:3, :3] @ joint.axis
        origin = joint.placement[:3, 3]
        along = (tips - origin) @ axis
        away2 = np.sum((tips - origin) ** 2, axis=1) - along**2
        heights = np.linspace(along.min(), along.max(), 1001)
        farthest = np.sqrt((away2 + (along - heights[:, None]) ** 2).max(axis=1))
        best = int(farthest.argmin())
        shoulder = np.round(origin + heights[best] * axis, LENGTH_DECIMALS) + 0.0
        return cls(shoulder, round(float(farthest[best]), LENGTH_DECIMALS), _directions(tips))

    def sample(self, rng: np.random.Generator) -> Array:
        """A point (3,), uniform in the volume (or area) of the shell."""
        dim = len(self.directions)
        inner, outer = (share * self.reach for share in SHELL)
        distance = rng.uniform(inner**dim, outer**dim) ** (1.0 / dim)
        point: Array = self.shoulder + distance * self.direction(rng)
        return point

    def direction(self, rng: np.random.Generator) -> Array:
        """A uniform unit vector (3,) in which the arm can move."""
        coefficients = rng.normal(size=len(self.directions))
        unit: Array = (coefficients / np.linalg.norm(coefficients)) @ self.directions
        return unit


@dataclass(frozen=True, eq=False)
class ReachProblem:
    """One problem: get from start to goal among balls.

    Attributes:
        robot: name for `Robot.named`.
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
        robot: name for `Robot.named`.
        obstacles: number of balls. seed: of all. moving: largest speed of a ball [m/s].

    Raises:
        ValueError: a value out of range.
    """

    robot: str = "fr3"
    obstacles: int = 10
    seed: int = 0
    moving: float = 0.0

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

    Args:
        settings: what to draw.
        robot: the robot of that name, if it is loaded already; self_collision: likewise.
    """

    def __init__(
        self,
        settings: ProblemSettings,
        *,
        robot: Robot | None = None,
        self_collision: SelfCollision | None = None,
    ) -> None:
        self.settings = settings
        self.robot = robot or Robot.named(settings.robot)
        self.self_collision = self_collision or SelfCollision(self.robot)
        self.workspace = Workspace.of(self.robot)
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
                f"no start and goal with {100 * CLEARANCE:.0f} cm clearance found among {SETS} sets of "
                f"{settings.obstacles} obstacles for {settings.robot!r}: ask for fewer obstacles"
            )
        drift = np.random.default_rng((settings.seed, index, 1))
        velocities = np.array(
            [drift.uniform(0.0, settings.moving) * self.workspace.direction(drift) for _ in centers]
        ).reshape(-1, 3)
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
            center, radius = self.workspace.sample(rng), rng.uniform(*RADII)
            if self._from_base(center) >= radius + BASE_CLEARANCE:
                centers.append(center)
                radii.append(radius)
        return np.array(centers).reshape(-1, 3), np.array(radii)

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
            if clearance.distance(q).distance >= CLEARANCE and not self.self_collision.touching(q):
                found.append(q)
                if len(found) == 2:
                    return found[0], found[1]
        return None


def _directions(points: Array) -> Array:
    """An orthonormal basis (2 or 3, 3) of the directions in which points (N, 3) [m] spread, the same anywhere."""
    _, spread, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    if spread[2] > 1e-6 * spread[0]:
        return np.eye(3)
    normal = np.round(axes[2], 6) + 0.0  # rounded: the basis must not depend on the machine's last digits
    first = np.eye(3)[int(np.abs(normal).argmin())]
    first = first - (first @ normal) * normal
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(normal * np.sign(normal[np.abs(normal).argmax()]), first)])


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
