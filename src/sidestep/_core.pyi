"""
C++ core of sidestep. Use the names re-exported by the sidestep package.
"""

from collections.abc import Callable, Sequence
import enum
import os
import pathlib
from typing import Any, Final, Self, overload

import numpy
import numpy.typing

import sidestep.loop
import sidestep.obstacles


class JointType(enum.Enum):
    """
    How a joint moves its child. A continuous joint is revolute without limits.
    """

    revolute = 0

    prismatic = 1

class Joint:
    """One moving joint; fixed and locked joints are folded into placements."""

    def __init__(self, name: str, type: JointType, *, parent: int, placement: numpy.typing.ArrayLike, axis: numpy.typing.ArrayLike, coordinate: int, multiplier: float = 1.0, offset: float = 0.0) -> None:
        """
        placement (4, 4): pose of the joint at zero motion in the parent joint's frame (-1: the world);
        axis (3,): unit vector in the joint frame; the motion is multiplier * q[coordinate] + offset.
        """

    @property
    def name(self) -> str: ...

    @property
    def type(self) -> JointType: ...

    @property
    def parent(self) -> int: ...

    @property
    def placement(self) -> numpy.typing.NDArray[numpy.float64]: ...

    @property
    def axis(self) -> numpy.typing.NDArray[numpy.float64]: ...

    @property
    def coordinate(self) -> int: ...

    @property
    def multiplier(self) -> float: ...

    @property
    def offset(self) -> float: ...

class Frame:
    """
    A named link frame, rigidly attached to the child of a joint (-1: to the world).
    """

    def __init__(self, name: str, *, joint: int, placement: numpy.typing.ArrayLike) -> None: ...

    @property
    def name(self) -> str: ...

    @property
    def joint(self) -> int: ...

    @property
    def placement(self) -> numpy.typing.NDArray[numpy.float64]: ...

class JointLimits:
    """
    Per-coordinate limits: position [rad | m], velocity [/s], acceleration [/s^2], effort [Nm | N], jerk [/s^3], effort rate [Nm/s | N/s]. Each (nv,); position bounds may be infinite, the others are positive. Without `jerk` it is 100/s times the acceleration; without `effort_rate` there is no limit.
    """

    def __init__(self, *, lower: numpy.typing.ArrayLike, upper: numpy.typing.ArrayLike, velocity: numpy.typing.ArrayLike, acceleration: numpy.typing.ArrayLike, effort: numpy.typing.ArrayLike, jerk: numpy.typing.ArrayLike | None = None, effort_rate: numpy.typing.ArrayLike | None = None) -> None: ...

    @property
    def lower(self) -> numpy.typing.NDArray[numpy.float64]: ...

    @property
    def upper(self) -> numpy.typing.NDArray[numpy.float64]: ...

    @property
    def velocity(self) -> numpy.typing.NDArray[numpy.float64]: ...

    @property
    def acceleration(self) -> numpy.typing.NDArray[numpy.float64]: ...

    @property
    def effort(self) -> numpy.typing.NDArray[numpy.float64]: ...

    @property
    def jerk(self) -> numpy.typing.NDArray[numpy.float64]: ...

    @property
    def effort_rate(self) -> numpy.typing.NDArray[numpy.float64]: ...

    rounding: Final[float] = ...
    """
    [rad | m] by which a measured or published configuration may be outside the position limits and is taken in as the nearest one within.
    """

class Robot:
    """The immutable kinematic model of an arm, in the core."""

    def __init__(self, name: str, *, joints: Sequence[Joint], frames: Sequence[Frame], coordinate_names: Sequence[str], limits: JointLimits) -> None: ...

    def __repr__(self) -> str: ...

    @property
    def name(self) -> str:
        """What messages call the arm."""

    @property
    def num_coordinates(self) -> int:
        """Number of joint coordinates nv (= nq)."""

    @property
    def joints(self) -> list[Joint]:
        """Every joint, parents first."""

    @property
    def frames(self) -> list[Frame]:
        """Every frame, such as links."""

    @property
    def coordinate_names(self) -> list[str]:
        """(nv,) Names of the joint coordinates."""

    @property
    def coordinate_units(self) -> list[str]:
        """The unit of every coordinate: 'rad', or 'm' of a sliding joint."""

    @property
    def limits(self) -> JointLimits:
        """Limits of the joint coordinates."""

    def pose(self, q: numpy.typing.ArrayLike, link: str) -> numpy.typing.NDArray[numpy.float64]:
        """Pose (4, 4) of a link frame in the world at q (nv,)."""

    def jacobian(self, q: numpy.typing.ArrayLike, link: str) -> numpy.typing.NDArray[numpy.float64]:
        """
        Jacobian (6, nv) of a link frame: rows 0-2 velocity of its origin, rows 3-5 angular velocity, both in
        the world (Pinocchio's LOCAL_WORLD_ALIGNED).
        """

    def bias_acceleration(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, link: str) -> numpy.typing.NDArray[numpy.float64]:
        """
        Classical acceleration (6,) of a link frame when the joint acceleration is zero, rows as in jacobian.
        """

class Body:
    """A Gaussian mixture per link, in the core."""

    def __init__(self, *, links: Sequence[str], weights: numpy.typing.ArrayLike, means: numpy.typing.ArrayLike, covariances: numpy.typing.ArrayLike, levels: numpy.typing.ArrayLike | None = None) -> None:
        """
        links (K,): frame of each component; weights (K,), sum 1 per link; means (K, 3) [m];
        covariances (K, 3, 3) [m^2]; levels (K,) of a calibrated body. Raises ValueError that names the component at fault.
        """

    def __repr__(self) -> str: ...

    @property
    def num_components(self) -> int:
        """Number of Gaussians or ellipsoids K."""

    @property
    def links(self) -> list[str]:
        """(K,) The link that carries each."""

    @property
    def weights(self) -> numpy.typing.NDArray[numpy.float64]:
        """(K,) Weights; of a link they add up to 1."""

    @property
    def means(self) -> numpy.typing.NDArray[numpy.float64]:
        """(K, 3) [m] in the frame of the link."""

    @property
    def levels(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        Levels (K,) of the covering ellipsoids, or None if the body is not calibrated.
        """

    @property
    def covariances(self) -> numpy.typing.NDArray[numpy.float64]:
        """(K, 3, 3) [m^2] in the frame of the link."""

def distance_to_triangles(points: numpy.typing.ArrayLike, triangles: numpy.typing.ArrayLike, candidates: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
    """
    Exact distance (N,) [m] of points (N, 3) [m] to the nearest of those triangles (F, 3, 3) [m] that are candidates (N, C)
    of each.
    """

def refine_cover(*, origin: numpy.typing.ArrayLike, spacing: float, values: numpy.typing.ArrayLike, points: numpy.typing.ArrayLike, multipliers: numpy.typing.ArrayLike, directions: numpy.typing.ArrayLike, centres: numpy.typing.ArrayLike, shapes: numpy.typing.ArrayLike, steps: int, first_rate: float, last_rate: float, stiffness: float, multiplier_steps: int, margin: float, unit: float, area: float, slimness: float) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]:
    """
    Moves ellipsoids until they hold points (N, 3) [m] and overshoot a surface little: centres (K, 3),
    shapes (K, 3, 3) and multipliers (N,) afterwards. The surface is the zero of signed distances values
    (nx, ny, nz) [m] on a grid from origin (3,); directions (R, J, 3) are R sets of unit vectors, used in turn.
    """

def real_array(value: numpy.typing.ArrayLike, name: str) -> numpy.typing.NDArray[numpy.float64]:
    """
    `value` as an array of float64, not copied where it is one. Raises TypeError that names the argument and its dtype for
    complex numbers, booleans, dates, text and objects, ValueError for masked entries.
    """

class Obstacles:
    """
    Obstacle points in the world, each a ball with a radius, moving with a constant velocity.
    """

    def __init__(self, points: numpy.typing.ArrayLike, radii: numpy.typing.ArrayLike = 0.0, velocities: numpy.typing.ArrayLike | None = None) -> None:
        """
        points (N, 3) [m]; radii scalar or (N,) [m], >= 0; velocities (N, 3) [m/s] or None for rest.
        Radii are at most 1e9 m. Raises ValueError that names the first bad point; an empty cloud is refused (see none()).
        Warns where every point is farther than 100 m, as points in millimetres are.
        """

    @staticmethod
    def none() -> Obstacles:
        """A workspace that is known to be free."""

    def __getstate__(self) -> tuple[Any, ...]: ...

    def __setstate__(self, state: tuple[Any, ...], /) -> None: ...

    def __copy__(self) -> Obstacles: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    def __len__(self) -> int: ...

    def __repr__(self) -> str: ...

    @property
    def points(self) -> numpy.typing.NDArray[numpy.float64]: ...

    @property
    def radii(self) -> numpy.typing.NDArray[numpy.float64]:
        """(N,) [m]."""

    @property
    def velocities(self) -> numpy.typing.NDArray[numpy.float64]:
        """(N, 3) [m/s] in the world."""

    @property
    def groups(self) -> list[tuple[str | None, int]]:
        """
        Of what belongs together, in the order of the points: its name, None where it has none, and how many.
        """

    def named(self, names: Sequence[str], counts: Sequence[int], poses: list[numpy.typing.NDArray[numpy.float64]] | None = None) -> Obstacles:
        """
        The same points with the names of what they belong to: the first counts[0] points to names[0], and so on;
        an empty name is none. poses: (4, 4) of each in the world, by which Controller.move_obstacle moves it. Raises ValueError unless counts and names are as many, and the counts add up to the number of points.
        """

    def name_of(self, point: int) -> str | None:
        """
        Name of what a point belongs to, as messages call it; None where it has none. Raises IndexError.
        """

    def advance(self, duration: float) -> None:
        """
        Moves every point along its velocity for `duration` [s]. Raises ValueError, and moves none, where it, or
        where it takes a point, is not finite.
        """

def multiply_add_rate(duration: float = 0.2) -> float:
    """
    Floating-point operations a second of one core that does nothing but multiply and add doubles in the widest
    registers, at most within `duration` [s]. Raises ValueError unless that is positive and finite.
    """

def instruction_set() -> str:
    """
    What the inner loops over points run with on this machine: "avx512", "avx2" or "baseline".
    """

class EmbeddingEvaluation:
    """Values, Jacobian and curvatures of an embedding."""

    @property
    def values(self) -> numpy.typing.NDArray[numpy.float64]:
        """psi (m,)."""

    @property
    def jacobian(self) -> numpy.typing.NDArray[numpy.float64]:
        """dpsi/dq (m, nv)."""

    @property
    def curvatures(self) -> numpy.typing.NDArray[numpy.float64]:
        """d2psi/dt2 (m,) along the motion with constant joint velocity."""

    @property
    def clearances(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        h (m,) [m] where the coordinates are barriers of clearances; inf beyond their reach.
        """

    @property
    def clearance_rates(self) -> numpy.typing.NDArray[numpy.float64]:
        """dh/dt (m,) [m/s]."""

    @property
    def clearance_curvatures(self) -> numpy.typing.NDArray[numpy.float64]:
        """d2h/dt2 (m,) [m/s^2] along the motion with constant joint velocity."""

    @property
    def clearance_gradients(self) -> numpy.typing.NDArray[numpy.float64]:
        """dh/dq (m, nv) [m/rad]."""

class Embedding:
    """
    Extra coordinates psi(q, t) that embed the joint space as the graph q -> (q, psi(q, t)).
    """

    @property
    def num_coordinates(self) -> int:
        """Number of coordinates m."""

    def evaluate(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, obstacles: Obstacles) -> EmbeddingEvaluation:
        """
        psi, dpsi/dq and d2psi/dt2 at q (nv,) [rad] and v (nv,) [rad/s], obstacle velocities included.
        """

    def hessian(self, q: numpy.typing.ArrayLike, obstacles: Obstacles) -> numpy.typing.NDArray[numpy.float64]:
        """
        d2psi/dq2, (nv, nv) where m = 1, else (m, nv, nv); exact. For tests and plots, not for the loop.
        """

class ClearanceBarrier(Embedding):
    """
    One coordinate per covering ellipsoid of the body, a barrier of its clearance h_k to the obstacles,
        psi_k = strength (activation / h_k - 1)^power  for h_k < activation, else 0.
    activation [m]: where it begins; larger reacts earlier and gentler, and closes narrow passages.
    strength: larger turns the motion away earlier within that distance. power >= 2: larger stays flat longer
    and rises steeper. floor [m]: below it psi goes on along its tangent. temperature [m]: smoothing between
    neighbouring points. reach [m]: clearances are measured up to here, at least to the activation distance. More
    costs time; it is for who wants to see them. What
    approaches is seen from as far as the arm needs to stop. window [temperatures]: points that are farther than
    the nearest by more do not count, each of which would change the mean by window exp(-window) temperature at most,
    2e-7 m; fewer cost less. The body must be calibrated (Body.cover); raises ValueError that names what is wrong.
    """

    def __init__(self, robot: Robot, body: Body, *, activation: float = 0.1, strength: float = 0.1, power: float = 2.0, floor: float = 0.002, temperature: float = 0.002, reach: float = 0.0, window: float = 12.0) -> None: ...

    @property
    def activation(self) -> float: ...

    @property
    def reach(self) -> float: ...

    @property
    def components(self) -> list[int]:
        """Which component of the body each coordinate belongs to."""

class JointLimitBarrier(Embedding):
    """
    One coordinate per finite position limit, a barrier of the way h [rad | m] left to it, as in ClearanceBarrier. The
    activation distance of a sliding joint is at most a twentieth of its range, its floor shorter by the same share.
    """

    def __init__(self, robot: Robot, *, activation: float = 0.1, strength: float = 0.02, power: float = 2.0, floor: float = 0.002) -> None: ...

class SelfCollisionBarrier(Embedding):
    """
    One coordinate per pair of links, a barrier of the clearance between their covering ellipsoids: their
    distance, or minus their depth, less the gap at which the links touch. pairs: (first, second) or
    (first, second, contact), names of links and that gap [m], see link_pairs.barrier_pairs. Other parameters as in
    ClearanceBarrier.
    """

    def __init__(self, robot: Robot, body: Body, pairs: Sequence[tuple[str, str] | tuple[str, str, float]], *, activation: float = 0.05, strength: float = 0.02, power: float = 2.0, floor: float = 0.002, temperature: float = 0.002, reach: float = 0.0) -> None: ...

class ClearanceTable:
    """
    The clearance h [m] of two links that only two coordinates x, y [rad | m] move relative to each other, as a
    function of these: a uniform cubic B-spline in either, h(x, y) = sum_ij B_i(x) B_j(y) control[i, j]. Control
    point i is at begin + i spacing; beyond the ends h and its derivatives stay as they are there, and where
    periodic the points span one turn. first, second: names of the links; coordinates, begin, spacing, periodic: two
    each; control (n, m) [m], at least 4 each. Raises ValueError that names what is wrong.
    """

    def __init__(self, first: str, second: str, *, coordinates: Sequence[int], begin: Sequence[float], spacing: Sequence[float], periodic: Sequence[bool], control: numpy.typing.ArrayLike) -> None: ...

    @property
    def first(self) -> str: ...

    @property
    def second(self) -> str: ...

    @property
    def coordinates(self) -> tuple[int, int]: ...

    @property
    def begin(self) -> tuple[float, float]: ...

    @property
    def spacing(self) -> tuple[float, float]: ...

    @property
    def periodic(self) -> tuple[bool, bool]: ...

    @property
    def control(self) -> numpy.typing.NDArray[numpy.float64]:
        """(n, m) [m]."""

    def at(self, x: float, y: float) -> tuple[float, numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]:
        """h [m], its gradient (2,) and Hessian (2, 2) by x and y."""

class ClearanceTableBarrier(Embedding):
    """
    One coordinate per table, a barrier of the clearance it holds: self-collision of links with two joints between
    them, see sidestep.arm.clearance_tables. Other parameters as in ClearanceBarrier.
    """

    def __init__(self, robot: Robot, tables: Sequence[ClearanceTable], *, activation: float = 0.05, strength: float = 0.02, power: float = 2.0, floor: float = 0.002, reach: float = 0.0) -> None: ...

class PlaneBarrier(Embedding):
    """
    One coordinate per link, a barrier of its clearance to a plane (a floor, a table, a wall). point (3,) [m] on
    the plane, normal (3,) to the free side, in the world; other parameters as in ClearanceBarrier.
    """

    def __init__(self, robot: Robot, body: Body, *, point: numpy.typing.ArrayLike, normal: numpy.typing.ArrayLike, links: Sequence[str], activation: float = 0.05, strength: float = 0.02, power: float = 2.0, floor: float = 0.002, temperature: float = 0.002, reach: float = 0.0) -> None: ...

def metric_matrix(jacobian: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
    """Metric G = I + J^T J (nv, nv) of the graph, from J (m, nv) (T2.9)."""

def geodesic_acceleration(jacobian: numpy.typing.ArrayLike, curvatures: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
    """
    Geodesic acceleration -G^-1 J^T c (nv,), from J (m, nv) and c = d2psi/dt2 (m,): T5.3 in closed form.
    """

def christoffel_symbols(jacobian: numpy.typing.ArrayLike, hessians: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
    """
    Christoffel symbols of the second kind (nv, nv, nv), indexed [k, i, j] for Gamma^k_ij, from dense tensors.
    The slow second implementation of the geodesic term: g^k = -Gamma^k_ij v^i v^j.
    """

class DampingForm(enum.Enum):
    """Where damping acts."""

    plain = 0
    """h = -G^-1 K (q - q*) - D v (T5.4)."""

    metric = 1
    """h = -G^-1 (K (q - q*) + D v) (T2.12)."""

class PullForm(enum.Enum):
    """How the goal pulls."""

    metric = 0
    """-G^-1 dU (T5.4): all that changes a psi is held back."""

    one_sided = 1
    """
    argmin_a |a + dU|^2 / 2 + sum_k max(0, J_k a)^2 / 2: only what makes a psi rise is held back.
    """

class Unswitched:
    """a = h + g (T2.12)."""

    def __init__(self) -> None: ...

class HarmonicOnly:
    """a = h, the damped spring alone."""

    def __init__(self) -> None: ...

class GeodesicOnly:
    """a = g, free fall along a geodesic (T5.3); it knows no goal."""

    def __init__(self) -> None: ...

class BinarySwitch:
    """a = s h + (1 - s) g with s = [psi <= threshold] (T5.5, T5.6)."""

    def __init__(self, threshold: float) -> None: ...

    @property
    def threshold(self) -> float: ...

class SigmoidSwitch:
    """
    The same with s = 1 - 1/(1 + exp(-slope (psi - threshold))) (thesis 6.1.1).
    """

    def __init__(self, threshold: float, slope: float) -> None: ...

    @property
    def threshold(self) -> float: ...

    @property
    def slope(self) -> float: ...

class DistanceSwitch:
    """
    The same joint by joint, s_i = 1/(1 + exp(-slope (d_i - threshold_i))) (T6.1, T6.2), where d_i [m] is the
    smallest distance between the obstacles and the Gaussian means on the link that joint i carries.
    """

    def __init__(self, thresholds: numpy.typing.ArrayLike, slope: float) -> None: ...

    @property
    def thresholds(self) -> numpy.typing.NDArray[numpy.float64]:
        """(nv,) [m], one for each joint."""

    @property
    def slope(self) -> float: ...

class JointGoal:
    """
    A configuration as a goal: U = (q - q*)^T K (q - q*) / 2 with the system's stiffness K.
    position q* (nv,) [rad]; velocity dq*/dt (nv,) [rad/s] and acceleration (nv,) [rad/s^2] of a goal that moves,
    zero by default. Raises ValueError on sizes, and names the first number that is not finite.
    """

    def __init__(self, position: numpy.typing.ArrayLike, velocity: numpy.typing.ArrayLike | None = None, acceleration: numpy.typing.ArrayLike | None = None) -> None: ...

    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]: ...

    @property
    def velocity(self) -> numpy.typing.NDArray[numpy.float64]: ...

    @property
    def acceleration(self) -> numpy.typing.NDArray[numpy.float64]: ...

    def __getstate__(self) -> tuple[Any, ...]: ...

    def __setstate__(self, state: tuple[Any, ...], /) -> None: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    def __repr__(self) -> str: ...

class PoseGoal:
    """
    A pose of a frame as a goal,
        U = k_p |p - p*|^2 / 2 + k_R |log(R*^T R)|^2 / 2.
    pose (4, 4) in the world, or (3,) where position_only. position_stiffness k_p [1/(m s)^2],
    orientation_stiffness k_R [1/s^2]. rest (nv,) with posture_stiffness [1/s^2]: a configuration that the joints are
    drawn to where the pose leaves them free. twist (6,): how the goal moves in the world, velocity of its origin
    [m/s] and angular velocity [rad/s]. At half a turn both ways back are equally short; one is taken.
    Where an entry of R^T R - 1 is up to 0.01, as of a quaternion of three digits, the nearest rotation is taken, with a
    warning that says by how much.
    Raises ValueError on a frame that is unknown or that no joint moves (listing the allowed ones), a rotation that is
    none, a number that is not finite, a stiffness out of range. A pose out of reach gives a status in the step.
    """

    def __init__(self, robot: Robot, frame: str, pose: numpy.typing.ArrayLike, *, position_only: bool = False, position_stiffness: float = 4.0, orientation_stiffness: float = 0.5, rest: numpy.typing.ArrayLike | None = None, posture_stiffness: float = 0.0, twist: numpy.typing.ArrayLike | None = None) -> None: ...

    @property
    def frame(self) -> str: ...

    @property
    def pose(self) -> numpy.typing.NDArray[numpy.float64]:
        """(4, 4) in the world."""

    @property
    def position_only(self) -> bool: ...

    def __getstate__(self) -> tuple[Any, ...]: ...

    def __setstate__(self, state: tuple[Any, ...], /) -> None: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    def __repr__(self) -> str: ...

def find_posture(robot: Robot, goal: PoseGoal, near: numpy.typing.ArrayLike, *, starts: int = 1, seed: int = 0) -> tuple[numpy.typing.NDArray[numpy.float64], float, float]:
    """
    A configuration within the limits with the frame at the pose, by damped least squares from q = near:
        q <- clip(q + J^T (J J^T + lambda^2 I)^-1 e),    e = (p* - p, log(R* R^T)),
    lambda shrinking with the error (Nakamura and Hanafusa 1986); where that does not get there, from up to `starts`
    configurations ever farther away, the same ones for one seed. Returns q (nv,), the distance [m] and the angle [rad]
    that are left: below 1e-7 it is there, else it is the nearest that was found. Knows of no obstacles.
    Raises ValueError on sizes, what is not finite, and a goal of another robot.
    """

class StepStatus(enum.Enum):
    """What a step of the system says about its result."""

    ok = 0
    """The equations hold."""

    outside_limits = 1
    """They hold, but a joint is outside its position limits."""

    goal_out_of_reach = 2
    """They hold, but the frame cannot be where the goal is."""

    inside_barrier = 3
    """They hold, with a push out: a clearance is below its barrier's floor."""

    goal_outside_limits = 4
    """The goal is outside the limits: no pull."""

    invalid_state = 6
    """Fallback: q or v is not finite."""

    invalid_goal = 5
    """The goal is not finite, or of another robot: no pull."""

    not_finite = 7
    """Fallback: the equations gave a value that is not finite."""

def is_fallback(status: StepStatus) -> bool:
    """
    Whether the acceleration is the fallback: a damped stop within the acceleration limits.
    """

class MotionState(enum.Enum):
    """What the motion of one step is about."""

    free = 0
    """On the way, nothing in it."""

    sliding = 1
    """On the way, bent by a barrier."""

    arriving = 2
    """As near to the goal as counts as there."""

    stuck = 3
    """At rest short of the goal: a local minimum, or a pose out of reach."""

    blocked_at_goal = 4
    """Stuck, and the goal itself is inside a barrier."""

    inside_barrier = 5
    """A clearance is below its floor: moving out."""

    fallback = 6
    """The step is a fallback, nothing is known."""

class CoordinateKind(enum.Enum):
    """What an embedding coordinate is about."""

    potential = 0
    """No clearance: a density, a sum."""

    obstacle = 1
    """A link against the obstacle points."""

    self = 2
    """Two links of the robot."""

    plane = 3
    """A link against a plane."""

    joint_limit = 4
    """A joint against a position limit."""

    effort = 5
    """What a joint holds of the arm against its effort limit."""

class CoordinateLabel:
    """What one coordinate of an embedding is about."""

    @property
    def kind(self) -> CoordinateKind:
        """What the coordinate measures."""

    @property
    def name(self) -> str:
        """Of the link, or of the joint for a limit; empty for a potential."""

    @property
    def other(self) -> str:
        """The second link of a pair; 'lower' or 'upper' for a joint limit."""

    def __repr__(self) -> str: ...

class Diagnosis:
    """
    Why a motion is what it is, from one step. Stuck: |v| < 0.02 rad/s short of the goal, and the metric lets
    less than 5 % of the goal's pull through (or there is none): a local minimum. The coordinate named is the
    one with the largest share in what is held back.
    """

    @property
    def state(self) -> MotionState:
        """What the motion of the step is about."""

    @property
    def coordinate(self) -> int:
        """The dominating one; -1: none."""

    @property
    def kind(self) -> CoordinateKind:
        """Of the dominating coordinate."""

    @property
    def name(self) -> str:
        """Its link, or joint for a limit; empty: none."""

    @property
    def other(self) -> str:
        """The second link; or 'lower' or 'upper'."""

    @property
    def point(self) -> int:
        """Its nearest obstacle point; -1: none."""

    @property
    def clearance(self) -> float:
        """Its clearance [m; rad]."""

    @property
    def share(self) -> float:
        """Its share of what is held back."""

    @property
    def blocked(self) -> float:
        """The part of the goal's pull that is held back, 1 - |G^-1 dU| / |dU|."""

    @property
    def speed(self) -> float:
        """|v| [rad/s]."""

    @property
    def joint_error(self) -> float:
        """Largest [rad | m]; nan for a pose."""

    @property
    def position_error(self) -> float:
        """[m]; nan for joints."""

    @property
    def rotation_error(self) -> float:
        """[rad]; nan if not wanted."""

    @property
    def way_left(self) -> str:
        """
        How far the goal is, in words: '0.31 rad', '12.0 mm' of a sliding joint.
        """

    def describe(self) -> str:
        """In one English sentence."""

    def __str__(self) -> str: ...

    def __repr__(self) -> str: ...

class PenetrationRecovery:
    """
    What is done with an arm inside a barrier. speed [m/s] with which it leaves, rate [1/s] at which it
    takes that up, margin [m] below the floor at which the push is full, rebound [rad/s]: the largest
    joint speed that a barrier gives back.
    """

    def __init__(self, *, speed: float = 0.1, rate: float = 20.0, margin: float = 0.005, rebound: float = 1.0) -> None: ...

    @property
    def speed(self) -> float: ...

    @property
    def rate(self) -> float: ...

    @property
    def margin(self) -> float: ...

    @property
    def rebound(self) -> float: ...

class Step:
    """The result of one step; arrays are copies."""

    @property
    def status(self) -> StepStatus:
        """How the step ended."""

    @property
    def acceleration(self) -> numpy.typing.NDArray[numpy.float64]:
        """a (nv,) [rad/s^2]."""

    @property
    def harmonic(self) -> numpy.typing.NDArray[numpy.float64]:
        """h (nv,) [rad/s^2]."""

    @property
    def geodesic(self) -> numpy.typing.NDArray[numpy.float64]:
        """g (nv,) [rad/s^2]."""

    @property
    def switch(self) -> numpy.typing.NDArray[numpy.float64]:
        """Weights s (nv,) of the harmonic part."""

    @property
    def values(self) -> numpy.typing.NDArray[numpy.float64]:
        """psi (m,)."""

    @property
    def curvatures(self) -> numpy.typing.NDArray[numpy.float64]:
        """d2psi/dt2 (m,)."""

    @property
    def jacobian(self) -> numpy.typing.NDArray[numpy.float64]:
        """dpsi/dq (m, nv)."""

    @property
    def clearances(self) -> Clearances:
        """Clearances of the coordinates that are barriers of them (m)."""

    @property
    def metric(self) -> numpy.typing.NDArray[numpy.float64]:
        """G = I + J^T J (nv, nv)."""

    @property
    def attraction(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        -G^-1 dU/dq (nv) [rad/s^2]: what the metric lets through of the goal's pull.
        """

    @property
    def recovery(self) -> numpy.typing.NDArray[numpy.float64]:
        """The push out of barriers (nv,) [rad/s^2]; zero outside."""

    @property
    def inside(self) -> int:
        """The coordinate deepest below its barrier's floor; -1: none."""

    @property
    def goal_gradient(self) -> numpy.typing.NDArray[numpy.float64]:
        """dU/dq (nv,)."""

    @property
    def goal_potential(self) -> float:
        """U [rad^2/s^2], without the posture pull."""

    @property
    def diagnosis(self) -> Diagnosis:
        """Why the motion is what it is."""

class GeometricSystem:
    """
    A damped spring that moves on the graph of psi: obstacles bend its path (Bosc 2024, chapter 5),
        h = -G^-1 dU/dq - D (v - v*),   g = -G^-1 J^T d2psi/dt2,   a = h + g or as the switch weighs them,
    with dU/dq = K (q - q*) and v* = 0 for a configuration at rest.
    Embeddings in the list are stacked, each with its own coordinates; an empty list and robot=... give flat
    space.
    stiffness K [1/s^2] and damping D [1/s]: scalar, (nv,) diagonal or (nv, nv), symmetric positive
    semi-definite. damping_form, pull_form: a DampingForm, a PullForm, or their names. switch: None (unswitched) or one of the switches.
    recovery: what a barrier does with an arm inside it, by default PenetrationRecovery().
    Raises ValueError that names the setting at fault.
    """

    def __init__(self, embeddings: Sequence[Embedding], *, stiffness: numpy.typing.ArrayLike = 0.5, damping: numpy.typing.ArrayLike = 1.5, damping_form: DampingForm | str = 'plain', switch: Unswitched | HarmonicOnly | GeodesicOnly | BinarySwitch | SigmoidSwitch | DistanceSwitch | None = None, robot: Robot | None = None, pull_form: PullForm | str = 'metric', recovery: PenetrationRecovery | None = None) -> None: ...

    @property
    def num_embedding_coordinates(self) -> int:
        """Number of coordinates m."""

    @property
    def labels(self) -> list[CoordinateLabel]:
        """What every embedding coordinate is about, as CoordinateLabel."""

    @property
    def stiffness(self) -> numpy.typing.NDArray[numpy.float64]: ...

    @property
    def damping(self) -> numpy.typing.NDArray[numpy.float64]: ...

    @property
    def pull_form(self) -> PullForm: ...

    @property
    def damping_form(self) -> DampingForm: ...

    @property
    def switch(self) -> Unswitched | HarmonicOnly | GeodesicOnly | BinarySwitch | SigmoidSwitch | DistanceSwitch: ...

    def acceleration(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, goal: numpy.typing.ArrayLike | JointGoal | PoseGoal, obstacles: Obstacles, activations: numpy.typing.ArrayLike | None = None) -> Step:
        """
        One step at q, v (nv,) [rad, rad/s] towards a configuration (nv,), a JointGoal or a PoseGoal. Values that are not finite and goals outside
        the limits give a status and a damped stop, not an exception; wrong shapes raise ValueError. activations (m,):
        clearances at which barriers begin, in place of the system's, see Controller.activations.
        """

    def diagnose(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, goal: numpy.typing.ArrayLike | JointGoal | PoseGoal, obstacles: Obstacles) -> Diagnosis:
        """
        The diagnosis of a step, and whether a stop is because the goal, a configuration, is itself blocked.
        """

    def goal_clearance(self, goal: numpy.typing.ArrayLike | JointGoal, obstacles: Obstacles) -> float:
        """
        The smallest clearance of any barrier at a goal configuration; inf beyond their reach.
        """

class ProgressMonitor:
    """
    Says when a motion has come no nearer to its goal for `patience` [s]: when the goal's
    potential has not fallen by `fraction` of its least value.
    """

    def __init__(self, *, patience: float = 2.0, fraction: float = 0.02) -> None: ...

    def update(self, time: float, potential: float) -> bool:
        """
        Takes `Step.goal_potential` at a time [s]; whether patience has run out.
        """

    def reset(self) -> None:
        """For a new goal."""

class LocalMinimumRecovery:
    """
    Leads an arm out of local minima without a map: when it has come no nearer to its goal for `patience` [s],
    it follows a random configuration for at most `leg` [s], then its goal again (Barraquand and Latombe 1991):
    one uniform within `spread` [rad] of every joint's position and within the limits; the n-th time for one goal within
    n times `spread`, for at most n times `leg`. Within 0.01 [rad | m] of its goal it has arrived. A goal that from
    one call to the next is more than 0.2 [rad | m] elsewhere is another one, and followed at once.
    fraction: of its potential that counts as nearer; seed: of the random configurations.
    Raises ValueError that names the setting at fault.
    """

    def __init__(self, robot: Robot, *, patience: float = 0.6, fraction: float = 0.05, leg: float = 2.0, spread: float = 1.7, seed: int = 0) -> None: ...

    def pursue(self, goal: numpy.typing.ArrayLike | JointGoal | PoseGoal, q: numpy.typing.ArrayLike, potential: float, period: float) -> JointGoal | PoseGoal:
        """
        The goal to follow in a step of `period` [s]: the goal given, or a sub-goal. potential: `Step.goal_potential`
        of the step before, NaN where there was none; it is used for poses, not for configurations.
        """

    @property
    def escaping(self) -> bool:
        """Whether the last step followed a sub-goal."""

    @property
    def count(self) -> int:
        """How many sub-goals there have been."""

class AvoidanceTrajectory:
    """
    A motion from q at v (nv,) to rest at a configuration (nv,), each joint as fast as nine tenths of its
    limits allow, and the acceleration that follows it. It ignores obstacles: the acceleration is for an
    MotionProgram with clearances. Raises ValueError on wrong shapes and what is
    not finite.
    """

    def __init__(self, robot: Robot, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, target: numpy.typing.ArrayLike) -> None: ...

    def __copy__(self) -> AvoidanceTrajectory: ...

    def acceleration(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, period: float) -> numpy.typing.NDArray[numpy.float64]:
        """
        a* + w^2 (q* - q) + 2 w (v* - v) (nv,) [/s^2], w = 10 /s, for a step of `period` [s].
        """

    def advance(self, period: float) -> None:
        """Moves the reference on by `period` [s]."""

    @property
    def target(self) -> numpy.typing.NDArray[numpy.float64]:
        """Where it comes to rest (nv,) [rad | m]."""

    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """The reference q* (nv,) [rad | m]."""

    @property
    def velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """The reference's velocity v* (nv,) [/s]."""

class LookAhead:
    """
    Leads an arm out of the way of what moves, in time, where a barrier would back off along the line of
    approach until a joint limit stops the arm. A look integrates the system, as a MotionProgram lets
    it, with the obstacles moving on as they do; where that comes nearer to them than `clearance` [m] within
    `horizon` [s], it looks for an AvoidanceTrajectory to one of `tries` random configurations that does not,
    to be followed until the way to the goal is free. One thread at a time. period [s]: of the steps looked
    at, shorter where it does not go into delay whole times; delay [s]: from one look to the next, from when
    on is followed what it found; seed: of the configurations.
    Raises ValueError that names the setting at fault, or if the system has no clearances to obstacles.
    """

    def __init__(self, system: GeometricSystem, *, horizon: float = 2.0, period: float = 0.01, delay: float = 0.1, clearance: float = 0.004, tries: int = 500, seed: int = 0) -> None: ...

    def look(self, goal: numpy.typing.ArrayLike | JointGoal | PoseGoal, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, obstacles: Obstacles, followed: AvoidanceTrajectory | None = None) -> AvoidanceTrajectory | None:
        """
        What to follow from `delay` on: a trajectory, or None for the system and the goal. q, v (nv,), obstacles and the
        trajectory that is followed, if there is one, are of now. Takes as long as some thousand steps, so not for the
        thread of a loop; other threads run meanwhile. The trajectory is advanced by who follows it.
        """

    def pursue(self, goal: numpy.typing.ArrayLike | JointGoal | PoseGoal, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, obstacles: Obstacles, period: float) -> AvoidanceTrajectory | None:
        """
        The trajectory to follow in a step of `period` [s] of a simulation, None where the goal is followed: looks every
        `delay`, and follows what the look before found, as if another thread had looked meanwhile.
        """

    def reset(self) -> None:
        """Before another motion is pursued: what was found is forgotten."""

    @property
    def count(self) -> int:
        """How many trajectories were found."""

class QuadraticProgramStatus(enum.Enum):
    """How a quadratic program ended."""

    def __str__(self) -> str: ...

    solved = 0

    infeasible = 1

    max_iterations = 2

    not_positive_definite = 3

    not_finite = 4

    wrong_size = 5

class QuadraticSolution:
    """What one solve of a QuadraticProgram gives."""

    @property
    def status(self) -> QuadraticProgramStatus:
        """How the solver ended."""

    @property
    def x(self) -> numpy.typing.NDArray[numpy.float64]:
        """The minimiser (n,)."""

    @property
    def multipliers(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n + m,): of the bounds, then of the rows; positive at an upper, negative at a lower limit.
        """

    @property
    def iterations(self) -> int:
        """Constraints that were added or dropped."""

    @property
    def residual(self) -> float:
        """
        Largest relative violation of the optimality conditions; NaN unless solved.
        """

    @property
    def seconds(self) -> float:
        """What the solver took [s], without the copies in and out."""

class QuadraticProgramData:
    """
    minimise 1/2 x'Hx + g'x subject to lower <= x <= upper and
    row_lower <= A x <= row_upper, with H (n, n) and A (m, n). Bounds may be infinite.
    """

    @property
    def H(self) -> numpy.typing.NDArray[numpy.float64]:
        """(n, n)"""

    @property
    def g(self) -> numpy.typing.NDArray[numpy.float64]:
        """(n,)"""

    @property
    def lower(self) -> numpy.typing.NDArray[numpy.float64]:
        """(n,)"""

    @property
    def upper(self) -> numpy.typing.NDArray[numpy.float64]:
        """(n,)"""

    @property
    def A(self) -> numpy.typing.NDArray[numpy.float64]:
        """(m, n)"""

    @property
    def row_lower(self) -> numpy.typing.NDArray[numpy.float64]:
        """(m,)"""

    @property
    def row_upper(self) -> numpy.typing.NDArray[numpy.float64]:
        """(m,)"""

class QuadraticProgram:
    """
    A dense strictly convex quadratic program of fixed size, solved by the dual active-set
    method: minimise 1/2 x'Hx + g'x subject to lower <= x <= upper and
    row_lower <= A x <= row_upper. Source: Goldfarb and Idnani (1983).
    """

    def __init__(self, num_variables: int, num_rows: int = 0) -> None: ...

    @property
    def num_variables(self) -> int:
        """Number of variables n."""

    @property
    def num_rows(self) -> int:
        """Number of rows m beside the bounds."""

    def solve(self, H: numpy.typing.ArrayLike, g: numpy.typing.ArrayLike, *, lower: numpy.typing.ArrayLike | None = None, upper: numpy.typing.ArrayLike | None = None, A: numpy.typing.ArrayLike | None = None, row_lower: numpy.typing.ArrayLike | None = None, row_upper: numpy.typing.ArrayLike | None = None) -> QuadraticSolution:
        """
        H (n, n) symmetric positive definite; g (n,); bounds scalar or (n,), rows A (m, n), scalar or (m,);
        None or infinite means no bound, equal bounds an equality. Returns a QuadraticSolution; data that cannot
        be solved give a status. Raises ValueError on wrong shapes.
        """

class Limit(enum.Flag):
    """Limits of one joint; a flag, so a set of them is one value."""

    position_lower = 1

    position_upper = 2

    velocity_lower = 4

    velocity_upper = 8

    acceleration_lower = 16

    acceleration_upper = 32

    torque_lower = 64

    torque_upper = 128

    jerk_lower = 256

    jerk_upper = 512

    torque_rate_lower = 1024

    torque_rate_upper = 2048

def acceleration_bounds(limits: Robot | JointLimits, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, period: float, *, position_margin: float = 0.0) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]:
    """
    Accelerations (lower, upper), each (nv,) [/s^2], that keep every joint inside its limits for ever.

    limits: a Robot or its JointLimits; q (nv,) [rad | m]; v (nv,) [/s]; period [s]: how long an acceleration is
    held. Outside the limits they steer back. Never empty. Raises ValueError on wrong shapes or values that are
    not finite. Source: Del Prete (2018), made exact for held accelerations.
    """

class Clearances:
    """
    Clearances h(q, t) of parts of an arm with what their motion needs; arrays are copies.
    """

    def __init__(self, *, values: numpy.typing.ArrayLike, rates: numpy.typing.ArrayLike, curvatures: numpy.typing.ArrayLike, gradients: numpy.typing.ArrayLike, nearest: Sequence[int], margins: numpy.typing.ArrayLike | None = None) -> None: ...

    @property
    def values(self) -> numpy.typing.NDArray[numpy.float64]:
        """h (m,) [m]; inf beyond the reach, where the rest has no meaning."""

    @property
    def rates(self) -> numpy.typing.NDArray[numpy.float64]:
        """dh/dt (m,) [m/s], obstacle velocities included."""

    @property
    def curvatures(self) -> numpy.typing.NDArray[numpy.float64]:
        """d2h/dt2 (m,) [m/s^2] along the motion with constant joint velocity."""

    @property
    def approach_values(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        h (m,) [m] of the critical sample: the one with the smallest predicted clearance after braking.
        """

    @property
    def approach_rates(self) -> numpy.typing.NDArray[numpy.float64]:
        """Its dh/dt (m,) [m/s]."""

    @property
    def gradients(self) -> numpy.typing.NDArray[numpy.float64]:
        """dh/dq (m, nv) [m/rad]."""

    @property
    def nearest(self) -> list[int]:
        """Index of the nearest obstacle point (m), -1 beyond the reach."""

    @property
    def margins(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        No larger margins than these (m,) [m] are kept: inf, or half the activation distance of a Barrier of
        what is not seen, such as self-collision.
        """

class SafetySettings:
    """
    What every command keeps of clearances, of which the margin may be less: `Clearances.margins`.

        margin [m], default 0.005, allowed 0 to 0.5: clearance that every command keeps: larger allows for more tracking error, delay and noise
        rate [1/s], default 20.0, allowed 0.5 to 200: largest closing speed per distance left to the margin: larger approaches faster, but reacts more to noise
        braking_fraction, default 0.5, allowed 0.05 to 1: share of the largest possible deceleration that braking relies on: larger brakes later
        correction, default 0.5, allowed 0.01 to 1: share of an excessive closing speed that is removed in one period: larger reacts harder
        max_rows, default 32, allowed 1 to 256: largest number of clearances that constrain one command: the most critical ones

    Raises ValueError that names the setting, its value and what is allowed.
    """

    def __init__(self, *, margin: float = 0.005, rate: float = 20.0, braking_fraction: float = 0.5, correction: float = 0.5, max_rows: int = 32) -> None: ...

    def __repr__(self) -> str:
        """What differs from the defaults."""

    def to_dict(self) -> dict[str, Any]:
        """
        All settings as a dict of numbers, texts and dicts, for YAML or JSON: SafetySettings(**d) gives them again.
        """

    def __getstate__(self) -> dict[str, Any]: ...

    def __setstate__(self, values: dict[str, Any], /) -> None: ...

    def __copy__(self) -> SafetySettings: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    @property
    def margin(self) -> float: ...

    @margin.setter
    def margin(self, value: float, /) -> None: ...

    @property
    def rate(self) -> float: ...

    @rate.setter
    def rate(self, value: float, /) -> None: ...

    @property
    def braking_fraction(self) -> float: ...

    @braking_fraction.setter
    def braking_fraction(self, value: float, /) -> None: ...

    @property
    def correction(self) -> float: ...

    @correction.setter
    def correction(self, value: float, /) -> None: ...

    @property
    def max_rows(self) -> int: ...

    @max_rows.setter
    def max_rows(self, value: int, /) -> None: ...

class ProgramStatus(enum.Enum):
    """How a solve of MotionProgram ended, from best to worst."""

    def __str__(self) -> str: ...

    ok = 0
    """tracked, no limit in the way"""

    limited = 1
    """optimal, with a limit in the way"""

    relaxed = 2
    """limits of jerk, joint or Cartesian speed, or acceleration gave way"""

    relaxed_safety = 3
    """not all clearances and position limits can be kept"""

    clearance_lost = 4
    """the least clearance is below zero, whatever the rest"""

    fallback_invalid_input = 5
    """unusable input, damped stop"""

    fallback_solver = 6
    """program not solved, damped stop"""

    @property
    def is_fallback(self) -> bool: ...

class ProgramFault(enum.Enum):
    """Which input of a solve is unusable."""

    def __str__(self) -> str: ...

    none = 0

    position = 1

    velocity = 2

    acceleration = 3

    mass_matrix = 4

    bias = 5

    clearances = 6

class SafetyRow:
    """What one control step did about one clearance."""

    @property
    def coordinate(self) -> int:
        """Which clearance."""

    @property
    def nearest(self) -> int:
        """Its nearest obstacle point."""

    @property
    def along_path(self) -> bool:
        """
        Whether a stop along the path is asked for: -|grad h| v/|v| stands for grad h.
        """

    @property
    def required(self) -> float:
        """Smallest grad h . x [m/s^2] that was asked for."""

    @property
    def slack(self) -> float:
        """By how much the solution falls short of it [m/s^2]."""

    @property
    def multiplier(self) -> float:
        """What the row costs the task, >= 0; the largest one dominates."""

class MotionSolution:
    """What a solve of MotionProgram gives."""

    @property
    def status(self) -> ProgramStatus:
        """How the solve ended."""

    @property
    def fault(self) -> ProgramFault:
        """Which input is unusable."""

    @property
    def torque(self) -> numpy.typing.NDArray[numpy.float64]:
        """(nv,) [Nm | N], within the effort limits, always finite."""

    @property
    def acceleration(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (nv,) [/s^2] that the torque gives; NaN where M or the bias is unusable.
        """

    @property
    def slack(self) -> numpy.typing.NDArray[numpy.float64]:
        """(nv,) [/s^2] signed acceleration beyond its bounds; 0 unless relaxed."""

    @property
    def lower(self) -> numpy.typing.NDArray[numpy.float64]:
        """(nv,) [/s^2] lower acceleration bounds."""

    @property
    def upper(self) -> numpy.typing.NDArray[numpy.float64]:
        """(nv,) [/s^2] upper acceleration bounds."""

    @property
    def active(self) -> tuple[Limit, ...]:
        """The limits in the way of each joint."""

    @property
    def safety(self) -> tuple[SafetyRow, ...]:
        """The clearances that were considered, most critical first."""

    @property
    def dominant(self) -> SafetyRow | None:
        """The clearance that bends the motion most; None if none does."""

    @property
    def least_clearance(self) -> float:
        """
        The least clearance given [m], exact, with a row or without; inf if there is none.
        """

    @property
    def least_coordinate(self) -> int:
        """Which clearance that is; -1 if there is none."""

    @property
    def least_nearest(self) -> int:
        """Its nearest obstacle point; -1 if there is none."""

class MotionProgram:
    """
    The acceleration, and the torque for it, nearest to a wanted one within every limit of the arm and its
    clearances: minimise 1/2 (x - a)'Q(x - a) + 1/2 t'Rt with t = torque / effort limit, subject to
    M x + h = torque, |torque| <= effort limit, lower(q, v) <= x <= upper(q, v).
    Source: Bosc, equation T6.3, corrected. One object per thread.
    """

    def __init__(self, robot: Robot, *, period: float = 0.001, by_torque: bool = True, tracking_weight: numpy.typing.ArrayLike = 1.0, torque_weight: numpy.typing.ArrayLike = 1e-06, slack_weight: float = 1000.0, velocity_overrun: float = 1.2, acceleration_overrun: float = 10.0, position_margin: float = 0.0, stop_time: float = 0.1, stop_damping: float = 0.25, safety: SafetySettings | None = None) -> None:
        """
        period [s]: time between two steps; by_torque: whether the arm is moved by torque: otherwise velocity and
        acceleration limits never give way, and no effort is limited; tracking_weight: Q, scalar or (nv,) [per (/s^2)^2];
        torque_weight: R, scalar or (nv,) [-]; slack_weight [-]: price of leaving the acceleration bounds over the
        steepest tracking cost; velocity_overrun, acceleration_overrun [-], >= 1: the factor up to which those limits
        give way to clearances and torque limits;
        position_margin [rad | m]: position limits are moved inwards by it; stop_time [s]: time constant of the
        damped stop; stop_damping [-]: its damping without a mass matrix, over effort limit / velocity limit;
        safety: SafetySettings, by default as they are. Raises ValueError that names the setting.
        """

    def solve(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, acceleration: numpy.typing.ArrayLike, mass_matrix: numpy.typing.ArrayLike | None = None, bias: numpy.typing.ArrayLike | None = None, *, clearances: Clearances | Step | None = None, last_acceleration: numpy.typing.ArrayLike | None = None, last_torque: numpy.typing.ArrayLike | None = None) -> MotionSolution:
        """
        One control step: q (nv,) [rad | m], v (nv,) [/s], wanted acceleration (nv,) [/s^2], mass matrix (nv, nv),
        bias (nv,) [Nm | N] (Coriolis, centrifugal and gravity; both only if by_torque), clearances at (q, v), which a Step
        has. With the last period's acceleration (nv,) [/s^2] or torque (nv,) [Nm | N], jerk or torque rate keep their limits.
        Returns a MotionSolution; values that are not finite give a fallback status and a damped stop. Raises ValueError on
        wrong shapes.
        """

    @property
    def period(self) -> float:
        """[s] between two calls."""

    @property
    def by_torque(self) -> bool:
        """Whether the arm is moved by torque."""

    @property
    def num_coordinates(self) -> int:
        """Number of joint coordinates nv."""

    @property
    def program(self) -> QuadraticProgramData:
        """
        The first quadratic program of the last call that had usable input, over the acceleration
        [rad/s^2 | m/s^2]; rows without bounds are left out.
        """

    def count(self, status: ProgramStatus) -> int:
        """Number of solves that ended with this status."""

def integrate_batch(controllers: Sequence[Controller], q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, *, steps: int, goals: numpy.typing.ArrayLike | None = None, tolerance: float = 0.0, threads: int = 0) -> list[MotionRecord]:
    """
    The motions of N controllers from q, v (N, nv), row k of controller k, each as `integrate` gives it, bit for bit, on
    several threads (0: one per processor). Each ends when every joint is within tolerance [rad | m] of its row of goals
    (N, nv), if given. Releases the GIL. Raises ValueError as `integrate` does, on a controller that is there twice and records
    of more than 8 GiB, RuntimeError while a controller is in use.
    """

class PlanStatus(enum.Enum):
    """What a search says about its result."""

    found = 0
    """There is a path."""

    no_path = 1
    """None within the budget of nodes, iterations and checks."""

    timeout = 2
    """None within the budget of time."""

    start_in_collision = 3
    """See Plan.obstruction."""

    goal_in_collision = 4
    """See Plan.obstruction."""

    invalid = 5
    """Start or goal is outside the position limits."""

class Obstruction:
    """
    What is in the way at an end of a motion: link, the other link of a pair, or which obstacle
    point (-1: none), and depth [m], how far the covering ellipsoids reach into it.
    """

    @property
    def kind(self) -> CoordinateKind:
        """Whether an obstacle, a plane or another link is in the way."""

    @property
    def link(self) -> str: ...

    @property
    def other(self) -> str: ...

    @property
    def point(self) -> int: ...

    @property
    def depth(self) -> float: ...

    def __str__(self) -> str: ...

    def __repr__(self) -> str: ...

class Plan:
    """A path, or why there is none."""

    @property
    def status(self) -> PlanStatus:
        """Whether a path was found, or why not."""

    @property
    def path(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (W, nv) waypoints from start to goal, straight between them; empty unless found.
        """

    @property
    def length(self) -> float:
        """Sum of |dq| [rad | m]."""

    @property
    def margin(self) -> float:
        """[m] that the path keeps, but for its ends."""

    @property
    def obstruction(self) -> Obstruction:
        """What is in the way at a start or goal in collision."""

    @property
    def nodes(self) -> int:
        """Of both trees."""

    @property
    def iterations(self) -> int:
        """Samples that the search drew."""

    @property
    def checks(self) -> int:
        """The work, see max_checks of PlannerSettings; improvement included."""

    @property
    def search_seconds(self) -> float:
        """[s] until a path was found, or given up."""

    @property
    def improvement_seconds(self) -> float:
        """[s] to look for a wider one, and to make it short."""

    def __repr__(self) -> str: ...

class PlannerSettings:
    """
    How a PathPlanner searches.

        margin [m], default 0.06, allowed 0.001 to 0.5: preferred clearance of paths: larger stays farther from obstacles, on longer paths
        floor [m], default 0.005, allowed 0.0001 to 0.5: least clearance of every path: smaller passes narrower gaps
        allowance [m], default 0.02, allowed 0 to 0.2: largest depth of a covering ellipsoid in an obstacle that is accepted at start and goal
        pair_allowance [m], default 0.02, allowed 0 to 0.2: largest depth of two links of the arm in each other that is accepted at start and goal
        slack [m], default 0.002, allowed 1e-05 to 0.1: distance by which an edge may undercut its margin (a quarter of the margin if that is more): larger checks faster
        fade [m], default 0.3, allowed 0.01 to 10: distance from start or goal over which their smaller margins return to the full one
        range [rad], default 1.0, allowed 0.01 to 10: length of the longest edge in the search trees
        max_nodes, default 10000, allowed 2 to 1e+06: largest number of nodes in both trees: the budget of one search
        max_iterations, default 40000, allowed 1 to 2e+09: largest number of iterations of one search: its budget
        max_checks, default 2000000, allowed 1 to 2e+09: largest number of clearance checks in one plan: its budget, some 2 s of work
        max_seconds [s], default inf, allowed 1e-09 to inf: time limit of one search; with a limit motions do not repeat
        shortcuts, default 100, allowed 0 to 1e+06: number of attempts to shorten a path: more give shorter paths, later

    Raises ValueError that names the setting, its value and what is allowed.
    """

    def __init__(self, *, margin: float = 0.06, floor: float = 0.005, allowance: float = 0.02, pair_allowance: float = 0.02, slack: float = 0.002, fade: float = 0.3, range: float = 1.0, max_nodes: int = 10000, max_iterations: int = 40000, max_checks: int = 2000000, max_seconds: float = ..., shortcuts: int = 100) -> None: ...

    def __repr__(self) -> str:
        """What differs from the defaults."""

    def to_dict(self) -> dict[str, Any]:
        """
        All settings as a dict of numbers, texts and dicts, for YAML or JSON: PlannerSettings(**d) gives them again.
        """

    def __getstate__(self) -> dict[str, Any]: ...

    def __setstate__(self, values: dict[str, Any], /) -> None: ...

    def __copy__(self) -> PlannerSettings: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    @property
    def margin(self) -> float: ...

    @margin.setter
    def margin(self, value: float, /) -> None: ...

    @property
    def floor(self) -> float: ...

    @floor.setter
    def floor(self, value: float, /) -> None: ...

    @property
    def allowance(self) -> float: ...

    @allowance.setter
    def allowance(self, value: float, /) -> None: ...

    @property
    def pair_allowance(self) -> float: ...

    @pair_allowance.setter
    def pair_allowance(self, value: float, /) -> None: ...

    @property
    def slack(self) -> float: ...

    @slack.setter
    def slack(self, value: float, /) -> None: ...

    @property
    def fade(self) -> float: ...

    @fade.setter
    def fade(self, value: float, /) -> None: ...

    @property
    def range(self) -> float: ...

    @range.setter
    def range(self, value: float, /) -> None: ...

    @property
    def max_nodes(self) -> int: ...

    @max_nodes.setter
    def max_nodes(self, value: int, /) -> None: ...

    @property
    def max_iterations(self) -> int: ...

    @max_iterations.setter
    def max_iterations(self, value: int, /) -> None: ...

    @property
    def max_checks(self) -> int: ...

    @max_checks.setter
    def max_checks(self, value: int, /) -> None: ...

    @property
    def max_seconds(self) -> float: ...

    @max_seconds.setter
    def max_seconds(self, value: float, /) -> None: ...

    @property
    def shortcuts(self) -> int: ...

    @shortcuts.setter
    def shortcuts(self, value: int, /) -> None: ...

class TimedPathSettings:
    """
    How fast the reference of an OnlinePlanner passes a path.

        wide [m], default 0.03, allowed 0.001 to 0.1: clearance below which a place on the path counts as narrow: activation distances are shorter there
        lead [rad], default 0.4, allowed 0.01 to 3: distance at which the reference waits for the arm: larger is faster, but cuts corners

    Raises ValueError that names the setting, its value and what is allowed.
    """

    def __init__(self, *, wide: float = 0.03, lead: float = 0.4) -> None: ...

    def __repr__(self) -> str:
        """What differs from the defaults."""

    def to_dict(self) -> dict[str, Any]:
        """
        All settings as a dict of numbers, texts and dicts, for YAML or JSON: TimedPathSettings(**d) gives them again.
        """

    def __getstate__(self) -> dict[str, Any]: ...

    def __setstate__(self, values: dict[str, Any], /) -> None: ...

    def __copy__(self) -> TimedPathSettings: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    @property
    def wide(self) -> float: ...

    @wide.setter
    def wide(self, value: float, /) -> None: ...

    @property
    def lead(self) -> float: ...

    @lead.setter
    def lead(self, value: float, /) -> None: ...

class OnlinePlannerStatus(enum.Enum):
    """What a motion led by an OnlinePlanner is about."""

    idle = 0
    """No goal was given."""

    moving = 1
    """On the way."""

    arrived = 2
    """Every joint is at the goal."""

    no_path = 3
    """None was found within the budget; looked for again."""

    goal_in_collision = 4
    """Gone to when it becomes free."""

    start_in_collision = 5
    """The reactive layer brings the arm out."""

    timeout = 6
    """The time for the motion is over; it goes on."""

    invalid = 7
    """The goal is outside the limits, or the state is not finite."""

class PlannerReference:
    """
    The current reference of an OnlinePlanner, and what the motion is about.
    """

    @property
    def status(self) -> OnlinePlannerStatus:
        """What the motion is about."""

    @property
    def goal(self) -> JointGoal:
        """The reference, as a goal for a GeometricSystem."""

    @property
    def places(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Waypoints (k, nv) where activation distances shrink: narrow places of the path that the arm is about to
        pass, or the goal where there is none. See Controller.activations.
        """

    @property
    def arrives(self) -> bool:
        """
        Whether activation distances shrink at the goal as well: `places` are others, and the end of the path
        is within the lead.
        """

class OnlinePlanner:
    """
    Leads an arm to a goal by a path that is searched in the background: a reference that runs ahead on the path.
    Until there is a path the reference is the goal itself; where the straight way to the goal is free, it is the path.
    robot, body, pairs, tables: as for PathPlanner; planner: PlannerSettings, route: TimedPathSettings, None for the defaults.
    period [s]: between two looks at the scene; patience [s]: without progress the arm is stuck and another way is
    searched; retry [s]: after which a failed search is repeated; tolerance [rad]: of arrival; duration [s]: allowed
    for a motion; synchronous: search in step(), the same every time, else in a thread of its own.
    Raises ValueError that names what is wrong.
    """

    def __init__(self, robot: Robot, body: Body, *, pairs: Sequence[tuple[str, str] | tuple[str, str, float]] = [], tables: Sequence[ClearanceTable] = [], planner: PlannerSettings | None = None, route: TimedPathSettings | None = None, period: float = 0.02, patience: float = 1.0, retry: float = 1.0, tolerance: float = 0.05, duration: float = float('inf'), seed: int = 0, synchronous: bool = False) -> None: ...

    def set_goal(self, goal: numpy.typing.ArrayLike) -> None:
        """A configuration (nv,) [rad] to go to; from the loop that calls step()."""

    def set_obstacles(self, obstacles: Obstacles) -> None:
        """The obstacles as they are seen now; from any thread."""

    def step(self, q: numpy.typing.ArrayLike, time: float) -> PlannerReference:
        """
        The current reference from q (nv,) [rad] at a time [s] that does not go back.
        """

    def disturbed(self, q: numpy.typing.ArrayLike, obstacles: Obstacles) -> bool:
        """
        Whether an obstacle that moves is within 10 cm of the arm at q (nv,) [rad], or could be in a second at its
        speed, by balls around the links.
        """

    @property
    def plan(self) -> Plan:
        """What the last search found."""

    @property
    def searches(self) -> int:
        """How often it searched."""

    @property
    def period(self) -> float:
        """[s] between two looks at the scene."""

class BodyClearance:
    """The smallest clearance of a body, and of what."""

    @property
    def clearance(self) -> float:
        """[m], a lower bound of the distance; not above the cap."""

    @property
    def kind(self) -> CoordinateKind: ...

    @property
    def link(self) -> str:
        """Empty where nothing is nearer than the cap."""

    @property
    def other(self) -> str:
        """The other link of a pair."""

    @property
    def point(self) -> int:
        """Which obstacle point; -1: none."""

class PathPlanner:
    """
    Plans a path of a covering body among obstacle points: the straight edge if it is free, else RRT-Connect
    (Kuffner and LaValle 2000), widened where there is room, and shortened. Deterministic in (start, goal, obstacles,
    seed) unless time runs out.
    Edges are proven free by bounds of how far the body moves, so that nothing thin is skipped.
    robot; body: calibrated (Body.cover); pairs: links that must not touch, as for SelfCollisionBarrier; tables: of other
    pairs, as for ClearanceTableBarrier; settings: a PlannerSettings, None for the defaults. Raises ValueError that names what is wrong.
    """

    def __init__(self, robot: Robot, body: Body, *, pairs: Sequence[tuple[str, str] | tuple[str, str, float]] = [], tables: Sequence[ClearanceTable] = [], settings: PlannerSettings | None = None) -> None: ...

    def plan(self, start: numpy.typing.ArrayLike, goal: numpy.typing.ArrayLike, obstacles: Obstacles, *, seed: int = 0) -> Plan:
        """
        A path from start (nv,) to goal (nv,) [rad] among the obstacles where they are now.
        """

    def clearance(self, q: numpy.typing.ArrayLike, obstacles: Obstacles, *, cap: float = 1.0) -> BodyClearance:
        """The smallest clearance at q (nv,), not above cap [m], and of what."""

    def is_free(self, q: numpy.typing.ArrayLike, obstacles: Obstacles, *, margin: float | None = None) -> bool:
        """
        Whether everything keeps the margin [m] (by default the planner's) at q (nv,).
        """

    def is_edge_free(self, a: numpy.typing.ArrayLike, b: numpy.typing.ArrayLike, obstacles: Obstacles, *, margin: float | None = None) -> bool:
        """
        Whether everything keeps the margin [m], less the slack, everywhere on the straight edge from a to b (nv,).
        """

class Inertial:
    """Mass properties of a rigid body, in the frame of that body."""

    def __init__(self, mass: float, com: numpy.typing.ArrayLike, inertia: numpy.typing.ArrayLike) -> None:
        """
        mass [kg]; com (3,): centre of mass [m]; inertia (3, 3): rotational inertia about it [kg m^2].
        """

    @property
    def mass(self) -> float: ...

    @property
    def com(self) -> numpy.typing.NDArray[numpy.float64]: ...

    @property
    def inertia(self) -> numpy.typing.NDArray[numpy.float64]: ...

def fold_inertials(robot: Robot, links: Sequence[Inertial]) -> list[Inertial]:
    """
    Sums the inertias of the links, one per frame in that frame, to one per joint in the frame of its child.
    Raises ValueError on a wrong number or an invalid inertia.
    """

class RigidBodyDynamics:
    """
    The equation of motion M(q) a + h(q, v) = torque of a tree, without friction and rotor inertia.
    Source: Featherstone, Rigid Body Dynamics Algorithms (2008), chapters 5 and 6.
    """

    def __init__(self, robot: Robot, inertials: Sequence[Inertial], *, gravity: numpy.typing.ArrayLike | None = None) -> None:
        """
        inertials: one per joint, in the frame of its child; gravity (3,): in the world [m/s^2], 9.81 along -z by default.
        Raises ValueError on a wrong number, an invalid inertia or a gravity that is not finite.
        """

    @property
    def gravity(self) -> numpy.typing.NDArray[numpy.float64]: ...

    @property
    def inertials(self) -> list[Inertial]: ...

    def mass_matrix(self, q: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
        """M(q) (nv, nv) [kg m^2, kg m, kg] at q (nv,)."""

    def bias(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
        """h(q, v) = C(q, v) v + g(q) (nv,) [Nm | N] at q (nv,), v (nv,)."""

    def call_seconds(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, *, calls: int) -> numpy.typing.NDArray[numpy.float64]:
        """
        (calls,) [s] that mass matrix and bias took together, of links whose poses are known, as in a Controller.
        """

class CoverProof:
    """What is proven and measured of the ellipsoids that cover one link."""

    def __init__(self, link: str, *, coverage: float, mean_overshoot: float, max_overshoot: float, volume_ratio: float, volume_of: str, interior_coverage: float, slimness: float) -> None: ...

    @property
    def link(self) -> str: ...

    @property
    def coverage(self) -> float:
        """Share of the mesh's area proven to lie inside the ellipsoids."""

    @property
    def mean_overshoot(self) -> float:
        """[m]"""

    @property
    def max_overshoot(self) -> float:
        """[m]"""

    @property
    def volume_ratio(self) -> float: ...

    @property
    def volume_of(self) -> str: ...

    @property
    def interior_coverage(self) -> float: ...

    @property
    def slimness(self) -> float: ...

class Provenance:
    """Where an arm comes from; does not count for its content hash."""

    def __init__(self, *, source: str, fingerprint: str, sidestep_version: str, date: str) -> None: ...

    @property
    def source(self) -> str: ...

    @property
    def fingerprint(self) -> str: ...

    @property
    def sidestep_version(self) -> str: ...

    @property
    def date(self) -> str: ...

class Arm:
    """Everything that is prepared once for a robot, in the core."""

    @overload
    def __init__(self, *, robot: Robot, body: Body, pairs: Sequence[tuple[str, str] | tuple[str, str, float]], tables: Sequence[ClearanceTable], inertials: Sequence[Inertial], proof: Sequence[CoverProof], allowed_pairs: Sequence[tuple[str, str]], provenance: Provenance) -> None:
        """
        inertials: one per joint, or none for an arm without dynamics. Raises ValueError that names what is wrong.
        """

    @overload
    def __init__(self, arm: Arm) -> None:
        """The same arm again; the content is shared."""

    @staticmethod
    def read(path: str | os.PathLike[str]) -> Arm:
        """
        Reads an .arm file. Raises OSError if it cannot be read, and ValueError that names the file and what is wrong.
        """

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes an .arm file in one piece. Raises OSError."""

    def __getstate__(self) -> bytes: ...

    def __setstate__(self, arg: bytes, /) -> None: ...

    def __eq__(self, other: object, /) -> bool:
        """By the content, see content_hash."""

    def __hash__(self) -> int: ...

    @property
    def name(self) -> str:
        """The name of the robot."""

    @property
    def num_coordinates(self) -> int:
        """Number of joint coordinates nv."""

    @property
    def robot(self) -> Robot:
        """The kinematic tree, without meshes."""

    @property
    def body(self) -> Body:
        """The covering body."""

    @property
    def limits(self) -> JointLimits:
        """JointLimits of the coordinates."""

    @property
    def pairs(self) -> list[tuple[str, str, float]]:
        """
        Pairs of links that must not touch, without a table: (first, second, contact [m]).
        """

    @property
    def tables(self) -> list[ClearanceTable]:
        """Clearance tables of the other pairs."""

    @property
    def inertials(self) -> list[Inertial]:
        """One per joint in the frame of its child; empty without dynamics."""

    @property
    def has_dynamics(self) -> bool:
        """Whether mass matrix and bias are known."""

    @property
    def proof(self) -> list[CoverProof]:
        """CoverProof of every covered link."""

    @property
    def allowed_pairs(self) -> list[tuple[str, str]]:
        """Links that may touch."""

    @property
    def provenance(self) -> Provenance:
        """Where the arm comes from."""

    @property
    def content_hash(self) -> str:
        """
        SHA-256 (64 hex digits) of everything but the provenance: equal arms have equal hashes.
        """

    def __repr__(self) -> str: ...

    @property
    def neutral(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        A configuration (nv,) inside the limits: the middle of each interval, 0 without limits.
        """

class Attachment:
    """
    An object that a link holds, see `Controller.attach`; `sidestep.arm.attachment` makes one.
    """

    def __init__(self, name: str, *, link: str, pose: numpy.typing.ArrayLike, centres: numpy.typing.ArrayLike, shapes: Sequence[numpy.typing.ArrayLike], inertial: Inertial, may_touch: Sequence[str] = (), rests_on: Sequence[str] = ()) -> None:
        """
        pose (4, 4) of the object in the frame of `link`; solid ellipsoids {centre + shape u : |u| <= 1} that hold all of it,
        centres (K, 3) and shapes (K, 3, 3) [m]; `inertial` in the object's frame; links that it may
        touch; names of obstacles that it stands on until it is lifted.
        """

    @property
    def name(self) -> str: ...

    @property
    def link(self) -> str: ...

    @property
    def pose(self) -> numpy.typing.NDArray[numpy.float64]:
        """(4, 4) in the link's frame."""

    @property
    def num_ellipsoids(self) -> int: ...

    @property
    def inertial(self) -> Inertial: ...

    @property
    def may_touch(self) -> list[str]: ...

    @property
    def rests_on(self) -> list[str]: ...

    def __repr__(self) -> str: ...

class BlackBoxSummary:
    """What a black box has kept."""

    @property
    def files(self) -> list[pathlib.Path]:
        """
        In the order of time; `load_recording(files)` reads them. Older ones are deleted.
        """

    @property
    def steps(self) -> int:
        """Steps that it recorded, those in deleted files included."""

    @property
    def lost(self) -> int:
        """Steps made after those, when the disk was too slow or full."""

    @property
    def bytes(self) -> int:
        """Size of the files."""

    @property
    def trouble(self) -> str:
        """Why nothing was written any more; empty: nothing."""

    def __repr__(self) -> str: ...

class BlackBox:
    """
    The last seconds of a controller on disk; as a context manager it ends with the block.
    """

    def stop(self) -> BlackBoxSummary:
        """
        Ends it; the files stay. Returns its BlackBoxSummary; warns of lost steps.
        """

    def __enter__(self) -> BlackBox: ...

    def __exit__(self, type: Any, value: Any, traceback: Any) -> None: ...

    def __repr__(self) -> str: ...

recording_suffix: str = '.mcap'

black_box_begin: str = 'blackbox-'

class RecordingSummary:
    """What a recording holds."""

    @property
    def path(self) -> pathlib.Path:
        """Its file."""

    @property
    def steps(self) -> int:
        """Steps that it holds."""

    @property
    def lost(self) -> int:
        """Steps made after those, when the disk was too slow."""

    @property
    def bytes(self) -> int:
        """Size of the file."""

    def __repr__(self) -> str: ...

class Recording:
    """
    A recording of a controller's steps; as a context manager it ends with the block.
    """

    def stop(self) -> RecordingSummary:
        """
        Ends it. Returns its RecordingSummary; warns of lost steps. Raises OSError where writing failed.
        """

    def __enter__(self) -> Recording: ...

    def __exit__(self, type: Any, value: Any, traceback: Any) -> None: ...

    def __repr__(self) -> str: ...

class RecordingHeader:
    """What made a recording, and with what."""

    @property
    def format(self) -> int:
        """Version of the file's format."""

    @property
    def sidestep_version(self) -> str:
        """The version of Sidestep that wrote it."""

    @property
    def compiler(self) -> str:
        """The compiler of that Sidestep."""

    @property
    def instruction_set(self) -> str:
        """Of the inner loops, see `instruction_set`."""

    @property
    def whole(self) -> bool:
        """
        From the first step on, so that it can be replayed; else of a black box.
        """

    @property
    def arm(self) -> Arm:
        """The arm (of the core) of the first step."""

    @property
    def settings(self) -> ControllerSettings:
        """A copy."""

    @property
    def notes(self) -> list[str]:
        """What this Sidestep does not know of it, or it not of this Sidestep."""

    def __repr__(self) -> str: ...

class ReplayDifference:
    """The first field of a command that a replay gave differently."""

    @property
    def step(self) -> int:
        """From 1."""

    @property
    def field(self) -> str:
        """For example "torque[3]"."""

    @property
    def recorded(self) -> str:
        """Its value, with 17 digits."""

    @property
    def replayed(self) -> str:
        """Its value, with 17 digits."""

    def __repr__(self) -> str: ...

class ReplayResult:
    """What a replay found."""

    @property
    def arm(self) -> str:
        """Name of the recorded arm."""

    @property
    def steps(self) -> int:
        """Steps replayed, the one that differs included."""

    @property
    def seconds(self) -> float:
        """The same in time of the motion [s]."""

    @property
    def equal(self) -> bool:
        """
        Every recorded command is the same bit for bit (nan like nan), and the file is not damaged.
        """

    @property
    def difference(self) -> ReplayDifference | None:
        """The first; the replay ends there."""

    @property
    def damage(self) -> str:
        """What is wrong with the file, and where; empty: nothing."""

    @property
    def complete(self) -> bool:
        """The recording was ended, not cut off by the end of its program."""

    @property
    def lost(self) -> int:
        """Steps that were made and not recorded."""

    @property
    def notes(self) -> list[str]:
        """What differs between recording and replay beside the commands."""

    def __repr__(self) -> str: ...

def read_recording_header(path: str | os.PathLike[str]) -> RecordingHeader:
    """
    What made a recording. Raises OSError where it cannot be read, ValueError that says what is wrong with it.
    """

def replay(path: str | os.PathLike[str], *, arm: Arm | None = None, settings: ControllerSettings | None = None) -> ReplayResult:
    """
    Gives a controller what a recording holds, step by step, and compares its commands with the recorded ones, bit for bit.
    The arm and the settings are in the recording; with others the notes name what differs. Raises OSError where the file cannot
    be read, ValueError that says what is wrong with it.
    """

class BarrierSettings:
    """
    The spring to the goal, and the barriers that bend its acceleration.

        stiffness [1/s^2], default 4.0, allowed 0.01 to 100: stiffness of the spring to the goal: larger is faster and brakes later
        damping [1/s], default 4.0, allowed 0.1 to 50: damping of that spring: 2 sqrt(stiffness) does not overshoot, larger is slower
        activation [m], default 0.1, allowed 0.01 to 1: activation distance of obstacle barriers: with a larger one the arm turns earlier and more gently, with a smaller one it passes narrower gaps
        strength, default 0.1, allowed 0.0001 to 10: strength of obstacle barriers: larger turns the motion away earlier
        power, default 2.0, allowed 2 to 6: exponent of all barriers: larger acts less far away and more steeply near contact
        floor [m], default 0.002, allowed 0.0001 to 0.02: clearance below which the arm counts as inside a barrier and is pushed out
        temperature [m], default 0.002, allowed 0.0001 to 0.02: smoothing length of the mean over near points and ellipsoids: larger is smoother and less exact
        limit_activation [rad], default 0.1, allowed 0.01 to 1: activation distance of position limits; for a prismatic joint at most a twentieth of its range
        limit_strength, default 0.02, allowed 0.0001 to 10: strength of the barriers of position limits: larger turns the motion away earlier
        self_activation [m], default 0.05, allowed 0.005 to 0.5: activation distance between links of the arm: larger keeps them farther apart, smaller leaves more postures free
        self_strength, default 0.02, allowed 0.0001 to 10: strength of the barriers between links: larger turns the motion away earlier

    A Controller refuses what is not allowed.
    """

    def __init__(self, *, stiffness: float = 4.0, damping: float = 4.0, activation: float = 0.1, strength: float = 0.1, power: float = 2.0, floor: float = 0.002, temperature: float = 0.002, limit_activation: float = 0.1, limit_strength: float = 0.02, self_activation: float = 0.05, self_strength: float = 0.02) -> None: ...

    def __repr__(self) -> str:
        """What differs from the defaults."""

    def to_dict(self) -> dict[str, Any]:
        """
        All settings as a dict of numbers, texts and dicts, for YAML or JSON: BarrierSettings(**d) gives them again.
        """

    def __getstate__(self) -> dict[str, Any]: ...

    def __setstate__(self, values: dict[str, Any], /) -> None: ...

    def __copy__(self) -> BarrierSettings: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    @property
    def stiffness(self) -> float: ...

    @stiffness.setter
    def stiffness(self, value: float, /) -> None: ...

    @property
    def damping(self) -> float: ...

    @damping.setter
    def damping(self, value: float, /) -> None: ...

    @property
    def activation(self) -> float: ...

    @activation.setter
    def activation(self, value: float, /) -> None: ...

    @property
    def strength(self) -> float: ...

    @strength.setter
    def strength(self, value: float, /) -> None: ...

    @property
    def power(self) -> float: ...

    @power.setter
    def power(self, value: float, /) -> None: ...

    @property
    def floor(self) -> float: ...

    @floor.setter
    def floor(self, value: float, /) -> None: ...

    @property
    def temperature(self) -> float: ...

    @temperature.setter
    def temperature(self, value: float, /) -> None: ...

    @property
    def limit_activation(self) -> float: ...

    @limit_activation.setter
    def limit_activation(self, value: float, /) -> None: ...

    @property
    def limit_strength(self) -> float: ...

    @limit_strength.setter
    def limit_strength(self, value: float, /) -> None: ...

    @property
    def self_activation(self) -> float: ...

    @self_activation.setter
    def self_activation(self, value: float, /) -> None: ...

    @property
    def self_strength(self) -> float: ...

    @self_strength.setter
    def self_strength(self, value: float, /) -> None: ...

class ArrivalSettings:
    """
    When a goal counts as reached.

        joint [rad], default 0.01, allowed 1e-06 to 1: largest joint error that counts as arrived
        sliding [m], default 0.001, allowed 1e-06 to 1: largest error of a prismatic joint that counts as arrived
        position [m], default 0.001, allowed 1e-06 to 1: largest distance from a pose goal that counts as arrived
        rotation [rad], default 0.0087, allowed 1e-06 to 3: largest angle from a pose goal that counts as arrived
        speed [rad/s], default 0.05, allowed 1e-06 to 100: largest joint speed that counts as arrived

    A Controller refuses what is not allowed.
    """

    def __init__(self, *, joint: float = 0.01, sliding: float = 0.001, position: float = 0.001, rotation: float = 0.0087, speed: float = 0.05) -> None: ...

    def __repr__(self) -> str:
        """What differs from the defaults."""

    def to_dict(self) -> dict[str, Any]:
        """
        All settings as a dict of numbers, texts and dicts, for YAML or JSON: ArrivalSettings(**d) gives them again.
        """

    def __getstate__(self) -> dict[str, Any]: ...

    def __setstate__(self, values: dict[str, Any], /) -> None: ...

    def __copy__(self) -> ArrivalSettings: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    @property
    def joint(self) -> float: ...

    @joint.setter
    def joint(self, value: float, /) -> None: ...

    @property
    def sliding(self) -> float: ...

    @sliding.setter
    def sliding(self, value: float, /) -> None: ...

    @property
    def position(self) -> float: ...

    @position.setter
    def position(self, value: float, /) -> None: ...

    @property
    def rotation(self) -> float: ...

    @rotation.setter
    def rotation(self, value: float, /) -> None: ...

    @property
    def speed(self) -> float: ...

    @speed.setter
    def speed(self, value: float, /) -> None: ...

class TrackingSettings:
    """
    Feedback that keeps the arm on the controller's reference: a = a_r + w^2 (q_r - q) + 2 z w (v_r - v), plus the torque of the
    disturbance observer. Not used with output position or velocity, which the arm's own drives track.

        frequency [1/s], default 60.0, allowed 1 to 300: natural frequency of the feedback to the reference: larger is stiffer, but noise and delay can make the arm shake
        damping, default 1.0, allowed 0.1 to 10: damping ratio of the feedback: 1 is critical damping; unknown rotor inertias reduce it; lower it if delay or noise make the arm shake
        velocity_filter [s], default 0.004, allowed 1e-05 to 1: time constant of the filter that corrects predicted velocities by measured ones: longer is calmer but lags more
        observer_time [s], default 0.05, allowed 0.005 to inf: time constant of the disturbance observer (friction, payload, wrong gravity): shorter compensates faster, but noise and delay can make the arm shake; inf: no observer
        observer_share, default 0.8, allowed 0 to 1: largest torque that the observer compensates, as a share of the effort limits
        largest_error [rad], default 0.2, allowed 0.001 to 10: tracking error above which the reference restarts at the arm; for a prismatic joint a fifth of it [m]
        servo_lag [rad], default 1.0, allowed 0.001 to 10: tracking error above which the reference restarts where the arm's own drives track position or velocity
        stiffness [1/rad], default 0.0, allowed 0 to 100: stiffness of a compliant arm, in effort limits per radian of tracking error: 0.01 is very soft, larger is stiffer. 0, the default, switches compliance off: the arm is then stiffest
        drift_gain [1/s], default 2.0, allowed 0 to 50: gain from position error to commanded velocity, with velocity output: larger returns to the reference faster

    A Controller refuses what is not allowed.
    """

    def __init__(self, *, frequency: float = 60.0, damping: float = 1.0, velocity_filter: float = 0.004, observer_time: float = 0.05, observer_share: float = 0.8, largest_error: float = 0.2, servo_lag: float = 1.0, stiffness: float = 0.0, drift_gain: float = 2.0) -> None: ...

    def __repr__(self) -> str:
        """What differs from the defaults."""

    def to_dict(self) -> dict[str, Any]:
        """
        All settings as a dict of numbers, texts and dicts, for YAML or JSON: TrackingSettings(**d) gives them again.
        """

    def __getstate__(self) -> dict[str, Any]: ...

    def __setstate__(self, values: dict[str, Any], /) -> None: ...

    def __copy__(self) -> TrackingSettings: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    @property
    def frequency(self) -> float: ...

    @frequency.setter
    def frequency(self, value: float, /) -> None: ...

    @property
    def damping(self) -> float: ...

    @damping.setter
    def damping(self, value: float, /) -> None: ...

    @property
    def velocity_filter(self) -> float: ...

    @velocity_filter.setter
    def velocity_filter(self, value: float, /) -> None: ...

    @property
    def observer_time(self) -> float: ...

    @observer_time.setter
    def observer_time(self, value: float, /) -> None: ...

    @property
    def observer_share(self) -> float: ...

    @observer_share.setter
    def observer_share(self, value: float, /) -> None: ...

    @property
    def largest_error(self) -> float: ...

    @largest_error.setter
    def largest_error(self, value: float, /) -> None: ...

    @property
    def servo_lag(self) -> float: ...

    @servo_lag.setter
    def servo_lag(self, value: float, /) -> None: ...

    @property
    def stiffness(self) -> float: ...

    @stiffness.setter
    def stiffness(self, value: float, /) -> None: ...

    @property
    def drift_gain(self) -> float: ...

    @drift_gain.setter
    def drift_gain(self, value: float, /) -> None: ...

class SpeedLimitSettings:
    """
    Limits of Cartesian speed by the distance d to the nearest obstacle, of every frame of the arm (speed and separation): between
    near and far V^2 = near_speed^2 + (far_speed^2 - near_speed^2) (d - near_distance)/(far_distance - near_distance), [m/s].

        near_speed [m/s], default 0.25, allowed 0.02 to 10: largest speed of any frame of the arm at near_distance from an obstacle or closer
        near_distance [m], default 0.1, allowed 0 to 10: distance to obstacles up to which near_speed is the limit
        far_speed [m/s], default 1.5, allowed 0.02 to 10: largest speed of any frame of the arm at far_distance from obstacles or farther
        far_distance [m], default 1.0, allowed 0.01 to 10: distance to obstacles from which far_speed is the limit; between near_distance and far_distance the limit rises with distance: the closer the two, the harder the arm has to brake

    Raises ValueError that names the setting, its value and what is allowed.
    """

    def __init__(self, *, near_speed: float = 0.25, near_distance: float = 0.1, far_speed: float = 1.5, far_distance: float = 1.0) -> None: ...

    def __repr__(self) -> str:
        """What differs from the defaults."""

    def to_dict(self) -> dict[str, Any]:
        """
        All settings as a dict of numbers, texts and dicts, for YAML or JSON: SpeedLimitSettings(**d) gives them again.
        """

    def __getstate__(self) -> dict[str, Any]: ...

    def __setstate__(self, values: dict[str, Any], /) -> None: ...

    def __copy__(self) -> SpeedLimitSettings: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    @property
    def near_speed(self) -> float: ...

    @near_speed.setter
    def near_speed(self, value: float, /) -> None: ...

    @property
    def near_distance(self) -> float: ...

    @near_distance.setter
    def near_distance(self, value: float, /) -> None: ...

    @property
    def far_speed(self) -> float: ...

    @far_speed.setter
    def far_speed(self, value: float, /) -> None: ...

    @property
    def far_distance(self) -> float: ...

    @far_distance.setter
    def far_distance(self, value: float, /) -> None: ...

class ContactSettings:
    """
    When a torque that neither model, load nor friction explains stops the arm: it waits for `Controller.restart`. With torque
    output; not with `tracking.stiffness`: such an arm is made to be pushed.

        share, default 0.3, allowed 0.02 to inf: largest torque that neither model, load nor friction explains, as a share of the effort limits: from there on the arm stops and waits for restart(); smaller feels gentler touches, but untold loads and friction stop the arm too; inf: no stop
        time [s], default 0.01, allowed 0 to 1: time for which that torque has to last: longer ignores short knocks

    A Controller refuses what is not allowed.
    """

    def __init__(self, *, share: float = 0.3, time: float = 0.01) -> None: ...

    def __repr__(self) -> str:
        """What differs from the defaults."""

    def to_dict(self) -> dict[str, Any]:
        """
        All settings as a dict of numbers, texts and dicts, for YAML or JSON: ContactSettings(**d) gives them again.
        """

    def __getstate__(self) -> dict[str, Any]: ...

    def __setstate__(self, values: dict[str, Any], /) -> None: ...

    def __copy__(self) -> ContactSettings: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    @property
    def share(self) -> float: ...

    @share.setter
    def share(self, value: float, /) -> None: ...

    @property
    def time(self) -> float: ...

    @time.setter
    def time(self, value: float, /) -> None: ...

class InputSettings:
    """
    How velocities, twists and trajectories are followed, see Controller.

        response [1/s], default 20.0, allowed 1 to 100: rate of the response to a commanded velocity or twist: larger responds faster, but passes on more noise
        timeout [s], default 0.25, allowed 0.001 to inf: age above which a commanded velocity or twist counts as zero
        singular, default 0.05, allowed 0.0001 to 1: smallest singular value of the frame's Jacobian [m and rad] at which a twist keeps its full speed; the arm stops at a fifth of it: larger is calmer, but stops farther from the stretched arm
        frequency [1/s], default 10.0, allowed 1 to 50: natural frequency of the return to a trajectory or to the planner's path: larger is stiffer
        lead [rad], default 0.1, allowed 0.001 to 10: tracking error above which a trajectory slows down; at twice as much it waits; for a prismatic joint a fifth of it [m]

    A Controller refuses what is not allowed.
    """

    def __init__(self, *, response: float = 20.0, timeout: float = 0.25, singular: float = 0.05, frequency: float = 10.0, lead: float = 0.1) -> None: ...

    def __repr__(self) -> str:
        """What differs from the defaults."""

    def to_dict(self) -> dict[str, Any]:
        """
        All settings as a dict of numbers, texts and dicts, for YAML or JSON: InputSettings(**d) gives them again.
        """

    def __getstate__(self) -> dict[str, Any]: ...

    def __setstate__(self, values: dict[str, Any], /) -> None: ...

    def __copy__(self) -> InputSettings: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    @property
    def response(self) -> float: ...

    @response.setter
    def response(self, value: float, /) -> None: ...

    @property
    def timeout(self) -> float: ...

    @timeout.setter
    def timeout(self, value: float, /) -> None: ...

    @property
    def singular(self) -> float: ...

    @singular.setter
    def singular(self, value: float, /) -> None: ...

    @property
    def frequency(self) -> float: ...

    @frequency.setter
    def frequency(self, value: float, /) -> None: ...

    @property
    def lead(self) -> float: ...

    @lead.setter
    def lead(self, value: float, /) -> None: ...

class SourceSettings:
    """
    How long obstacles are believed, see Controller.set_obstacles.

        valid_for [s], default 0.25, allowed 0.01 to inf: age up to which a source of obstacles is believed that was given a time, has velocities or comes again and again: beyond it the arm stops until the source comes again; shorter is safer, longer tolerates more lost sets
        largest_speed [m/s], default 2.0, allowed 0 to 100: largest speed of obstacles that nobody has told of: larger keeps the arm farther from what is overdue or uncertain
        empty_after [s], default 2.0, allowed 0 to inf: time for which a source that had obstacles must stay empty before that is believed: longer survives a camera that sees nothing for longer; remove_obstacles is believed at once

    A Controller refuses what is not allowed.
    """

    def __init__(self, *, valid_for: float = 0.25, largest_speed: float = 2.0, empty_after: float = 2.0) -> None: ...

    def __repr__(self) -> str:
        """What differs from the defaults."""

    def to_dict(self) -> dict[str, Any]:
        """
        All settings as a dict of numbers, texts and dicts, for YAML or JSON: SourceSettings(**d) gives them again.
        """

    def __getstate__(self) -> dict[str, Any]: ...

    def __setstate__(self, values: dict[str, Any], /) -> None: ...

    def __copy__(self) -> SourceSettings: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    @property
    def valid_for(self) -> float: ...

    @valid_for.setter
    def valid_for(self, value: float, /) -> None: ...

    @property
    def largest_speed(self) -> float: ...

    @largest_speed.setter
    def largest_speed(self, value: float, /) -> None: ...

    @property
    def empty_after(self) -> float: ...

    @empty_after.setter
    def empty_after(self, value: float, /) -> None: ...

class OnlinePlannerSettings:
    """
    The planner that runs beside the loop: how it searches, and how its paths are followed.

        period [s], default 0.02, allowed 0.001 to 10: time between two checks of the path: shorter reacts earlier
        patience [s], default 1.0, allowed 0.05 to 60: time without progress after which another path is searched
        retry [s], default 1.0, allowed 0.05 to 600: time after which a failed search is repeated in the same scene

    A Controller refuses what is not allowed.
    """

    def __init__(self, *, period: float = 0.02, patience: float = 1.0, retry: float = 1.0, search: PlannerSettings = ..., route: TimedPathSettings = ...) -> None: ...

    def __repr__(self) -> str:
        """What differs from the defaults."""

    def to_dict(self) -> dict[str, Any]:
        """
        All settings as a dict of numbers, texts and dicts, for YAML or JSON: OnlinePlannerSettings(**d) gives them again.
        """

    def __getstate__(self) -> dict[str, Any]: ...

    def __setstate__(self, values: dict[str, Any], /) -> None: ...

    def __copy__(self) -> OnlinePlannerSettings: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    @property
    def period(self) -> float: ...

    @period.setter
    def period(self, value: float, /) -> None: ...

    @property
    def patience(self) -> float: ...

    @patience.setter
    def patience(self, value: float, /) -> None: ...

    @property
    def retry(self) -> float: ...

    @retry.setter
    def retry(self, value: float, /) -> None: ...

    @property
    def search(self) -> PlannerSettings: ...

    @search.setter
    def search(self, arg: PlannerSettings, /) -> None: ...

    @property
    def route(self) -> TimedPathSettings: ...

    @route.setter
    def route(self, arg: TimedPathSettings, /) -> None: ...

class LookAheadSettings:
    """
    Prediction and avoidance of moving obstacles, see Controller.

        horizon [s], default 2.0, allowed 0.1 to 30: length of the prediction: longer sees fast obstacles earlier, but takes more processor time
        period [s], default 0.01, allowed 0.0005 to 0.2: time step of predicted motions: longer is faster to compute and coarser
        delay [s], default 0.1, allowed 0.005 to 5: time from one prediction to the next, and from its start until its result is used
        clearance [m], default 0.004, allowed -0.1 to 0.5: least clearance that a predicted motion must keep from obstacles
        tries, default 500, allowed 1 to 100000: number of avoidance trajectories that one prediction tries: more find a way out more often, but take more processor time
        slow_after, default 3.0, allowed 2 to 1000: age of the newest prediction above which the arm slows down near moving obstacles, as a multiple of delay: smaller is safer where processor time is short
        rest_after, default 10.0, allowed 2 to 10000: age of the newest prediction at which the arm stops near moving obstacles, as a multiple of delay

    Raises ValueError that names the setting, its value and what is allowed.
    """

    def __init__(self, *, horizon: float = 2.0, period: float = 0.01, delay: float = 0.1, clearance: float = 0.004, tries: int = 500, slow_after: float = 3.0, rest_after: float = 10.0) -> None: ...

    def __repr__(self) -> str:
        """What differs from the defaults."""

    def to_dict(self) -> dict[str, Any]:
        """
        All settings as a dict of numbers, texts and dicts, for YAML or JSON: LookAheadSettings(**d) gives them again.
        """

    def __getstate__(self) -> dict[str, Any]: ...

    def __setstate__(self, values: dict[str, Any], /) -> None: ...

    def __copy__(self) -> LookAheadSettings: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    @property
    def horizon(self) -> float: ...

    @horizon.setter
    def horizon(self, value: float, /) -> None: ...

    @property
    def period(self) -> float: ...

    @period.setter
    def period(self, value: float, /) -> None: ...

    @property
    def delay(self) -> float: ...

    @delay.setter
    def delay(self, value: float, /) -> None: ...

    @property
    def clearance(self) -> float: ...

    @clearance.setter
    def clearance(self, value: float, /) -> None: ...

    @property
    def tries(self) -> int: ...

    @tries.setter
    def tries(self, value: int, /) -> None: ...

    @property
    def slow_after(self) -> float: ...

    @slow_after.setter
    def slow_after(self, value: float, /) -> None: ...

    @property
    def rest_after(self) -> float: ...

    @rest_after.setter
    def rest_after(self, value: float, /) -> None: ...

class LocalMinimumSettings:
    """
    Sub-goals where the arm is stuck and there is no path.

        patience [s], default 0.6, allowed 0.05 to 60: time without progress after which the arm goes to a sub-goal
        fraction, default 0.05, allowed 0.0001 to 0.99: share by which the squared distance to the goal must fall to count as progress
        leg [s], default 2.0, allowed 0.1 to 60: longest duration of the motion to the first sub-goal; n times as long for the n-th
        spread [rad], default 1.7, allowed 0.01 to 20: largest distance of each joint of the first sub-goal from the arm; n times as far for the n-th

    Raises ValueError that names the setting, its value and what is allowed.
    """

    def __init__(self, *, patience: float = 0.6, fraction: float = 0.05, leg: float = 2.0, spread: float = 1.7) -> None: ...

    def __repr__(self) -> str:
        """What differs from the defaults."""

    def to_dict(self) -> dict[str, Any]:
        """
        All settings as a dict of numbers, texts and dicts, for YAML or JSON: LocalMinimumSettings(**d) gives them again.
        """

    def __getstate__(self) -> dict[str, Any]: ...

    def __setstate__(self, values: dict[str, Any], /) -> None: ...

    def __copy__(self) -> LocalMinimumSettings: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    @property
    def patience(self) -> float: ...

    @patience.setter
    def patience(self, value: float, /) -> None: ...

    @property
    def fraction(self) -> float: ...

    @fraction.setter
    def fraction(self, value: float, /) -> None: ...

    @property
    def leg(self) -> float: ...

    @leg.setter
    def leg(self, value: float, /) -> None: ...

    @property
    def spread(self) -> float: ...

    @spread.setter
    def spread(self, value: float, /) -> None: ...

class Output(enum.Enum):
    """
    What is sent to the arm. Torque and acceleration are tracked by the controller, from the measured state;
    position and velocity by the arm's own drives.
    """

    automatic = 0
    """Torque where the arm has inertias and effort limits."""

    torque = 1

    acceleration = 2

    velocity = 3

    position = 4

class ControllerSettings:
    """
    All settings of a Controller. Every part but `speed_limits` is on by default; `planner=None`, `look_ahead=None` and
    `local_minimum=None` leave a part out, for comparisons.

        period [s], default 0.001, allowed 0.0001 to 0.1: time between two calls of step; limits and clearances hold at these samples
        speed, default 1.0, allowed 0.01 to 1: share of the velocity and acceleration limits that motions use: less is slower and calmer
        limit_margin, default 0.02, allowed 0 to 0.5: share of the limits of velocity, acceleration, jerk and torque rate that stays unused, for noise, delay and rounding: larger is safer and slower
        effort_margin, default 0.05, allowed 0 to 0.5: share of the effort limits that stays unused, for errors of the model: larger is safer and slower
        position_margin [rad], default 0.0, allowed 0 to 1: distance by which position limits are moved inwards
        stop_time [s], default 0.1, allowed 0.005 to 10: time constant of the emergency stop: shorter brakes harder
        stop_damping, default 0.25, allowed 0.001 to 10: joint damping of the emergency stop without a mass matrix, in units of effort limit / velocity limit
        torque_weight, default 1e-06, allowed 0 to 1000: weight of torque relative to acceleration error: larger saves torque, but the arm sags
        slack_weight, default 1000.0, allowed 1 to 1e+06: weight of exceeding velocity and acceleration limits, relative to acceleration error: larger exceeds them less
        velocity_overrun, default 1.2, allowed 1 to 10: largest velocity that a clearance may demand, as a multiple of the velocity limit
        acceleration_overrun, default 10.0, allowed 1 to 100: largest acceleration that a clearance may demand, as a multiple of the acceleration limit
        obstacle_timeout [s], default inf, allowed 0.001 to inf: age above which every source of obstacles without a valid_for of its own is stale and the arm stops
        local_activation, default True, allowed 0 to 1: shorter activation distances near the goal and in narrow places, among static obstacles; without it the arm creeps there
        synchronous, default False, allowed 0 to 1: run planner, look-ahead and posture search inside step: motions repeat bit for bit, steps take longer
        seed, default 0, allowed 0 to 1.84467e+19: seed of all random numbers

    Raises ValueError that names the setting, its value and what is allowed.
    """

    def __init__(self, *, period: float = 0.001, speed: float = 1.0, limit_margin: float = 0.02, effort_margin: float = 0.05, position_margin: float = 0.0, stop_time: float = 0.1, stop_damping: float = 0.25, torque_weight: float = 1e-06, slack_weight: float = 1000.0, velocity_overrun: float = 1.2, acceleration_overrun: float = 10.0, obstacle_timeout: float = ..., local_activation: bool = True, synchronous: bool = False, seed: int = 0, barriers: BarrierSettings = ..., safety: SafetySettings = ..., arrival: ArrivalSettings = ..., tracking: TrackingSettings = ..., speed_limits: SpeedLimitSettings | None = ..., inputs: InputSettings = ..., sources: SourceSettings = ..., contact: ContactSettings = ..., planner: OnlinePlannerSettings | None = ..., look_ahead: LookAheadSettings | None = ..., local_minimum: LocalMinimumSettings | None = ..., output: Output | str = ...) -> None: ...

    def __repr__(self) -> str:
        """What differs from the defaults."""

    def to_dict(self) -> dict[str, Any]:
        """
        All settings as a dict of numbers, texts and dicts, for YAML or JSON: ControllerSettings(**d) gives them again.
        """

    def __getstate__(self) -> dict[str, Any]: ...

    def __setstate__(self, values: dict[str, Any], /) -> None: ...

    def __copy__(self) -> ControllerSettings: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    @property
    def period(self) -> float: ...

    @period.setter
    def period(self, value: float, /) -> None: ...

    @property
    def speed(self) -> float: ...

    @speed.setter
    def speed(self, value: float, /) -> None: ...

    @property
    def limit_margin(self) -> float: ...

    @limit_margin.setter
    def limit_margin(self, value: float, /) -> None: ...

    @property
    def effort_margin(self) -> float: ...

    @effort_margin.setter
    def effort_margin(self, value: float, /) -> None: ...

    @property
    def position_margin(self) -> float: ...

    @position_margin.setter
    def position_margin(self, value: float, /) -> None: ...

    @property
    def stop_time(self) -> float: ...

    @stop_time.setter
    def stop_time(self, value: float, /) -> None: ...

    @property
    def stop_damping(self) -> float: ...

    @stop_damping.setter
    def stop_damping(self, value: float, /) -> None: ...

    @property
    def torque_weight(self) -> float: ...

    @torque_weight.setter
    def torque_weight(self, value: float, /) -> None: ...

    @property
    def slack_weight(self) -> float: ...

    @slack_weight.setter
    def slack_weight(self, value: float, /) -> None: ...

    @property
    def velocity_overrun(self) -> float: ...

    @velocity_overrun.setter
    def velocity_overrun(self, value: float, /) -> None: ...

    @property
    def acceleration_overrun(self) -> float: ...

    @acceleration_overrun.setter
    def acceleration_overrun(self, value: float, /) -> None: ...

    @property
    def obstacle_timeout(self) -> float: ...

    @obstacle_timeout.setter
    def obstacle_timeout(self, value: float, /) -> None: ...

    @property
    def local_activation(self) -> bool: ...

    @local_activation.setter
    def local_activation(self, value: bool, /) -> None: ...

    @property
    def synchronous(self) -> bool: ...

    @synchronous.setter
    def synchronous(self, value: bool, /) -> None: ...

    @property
    def seed(self) -> int: ...

    @seed.setter
    def seed(self, value: int, /) -> None: ...

    @property
    def barriers(self) -> BarrierSettings: ...

    @barriers.setter
    def barriers(self, arg: BarrierSettings, /) -> None: ...

    @property
    def safety(self) -> SafetySettings: ...

    @safety.setter
    def safety(self, arg: SafetySettings, /) -> None: ...

    @property
    def arrival(self) -> ArrivalSettings: ...

    @arrival.setter
    def arrival(self, arg: ArrivalSettings, /) -> None: ...

    @property
    def tracking(self) -> TrackingSettings: ...

    @tracking.setter
    def tracking(self, arg: TrackingSettings, /) -> None: ...

    @property
    def contact(self) -> ContactSettings: ...

    @contact.setter
    def contact(self, arg: ContactSettings, /) -> None: ...

    @property
    def inputs(self) -> InputSettings: ...

    @inputs.setter
    def inputs(self, arg: InputSettings, /) -> None: ...

    @property
    def sources(self) -> SourceSettings: ...

    @sources.setter
    def sources(self, arg: SourceSettings, /) -> None: ...

    @property
    def output(self) -> Output: ...

    @output.setter
    def output(self, arg: Output, /) -> None: ...

    def validate(self) -> None:
        """
        Raises ValueError that names the setting, its value and what is allowed.
        """

    @property
    def speed_limits(self) -> SpeedLimitSettings | None: ...

    @speed_limits.setter
    def speed_limits(self, value: SpeedLimitSettings | None) -> None: ...

    @property
    def planner(self) -> OnlinePlannerSettings | None: ...

    @planner.setter
    def planner(self, value: OnlinePlannerSettings | None) -> None: ...

    @property
    def look_ahead(self) -> LookAheadSettings | None: ...

    @look_ahead.setter
    def look_ahead(self, value: LookAheadSettings | None) -> None: ...

    @property
    def local_minimum(self) -> LocalMinimumSettings | None: ...

    @local_minimum.setter
    def local_minimum(self, value: LocalMinimumSettings | None) -> None: ...

def controller_settings_fields() -> list[dict[str, float | str]]:
    """
    Every setting of the tree: name (dotted), unit, default, least and most allowed, what it is and trades, and whether the part
    that its name begins with is optional, so that None leaves it out.
    """

class TrajectoryBehaviour(enum.Enum):
    """What a Controller does if an obstacle blocks its trajectory."""

    keep_path = 0
    """
    Stay on the path: slow down, wait in front of the obstacle, continue when the path is free.
    """

    steer = 1
    """Leave the path to get around the obstacle, then return to it."""

class TwistFreedom(enum.Enum):
    """Which part of a twist is left free."""

    none = 0
    """Translation and rotation are both commanded."""

    rotation = 1
    """
    Only the velocity of the frame's origin is commanded; its rotation is free.
    """

class SafetyStatus(enum.IntEnum):
    """How safe a command is, by severity. Every command may be sent."""

    ok = 0
    """The motion is as requested; a velocity or twist is kept within 5 %."""

    limited = 1
    """A limit of the arm or a clearance changes it."""

    relaxed = 2
    """
    Limits of jerk, velocity, acceleration or Cartesian speed gave way to clearances, position or torque limits.
    """

    margin_lost = 3
    """
    Not every safety margin or position limit can be kept; nothing is touched.
    """

    tracking_lost = 4
    """
    The arm is farther from the command than its velocity limits cover in 0.1 s, or no motion explains its measured position: it comes to rest.
    """

    stale = 5
    """A source of obstacles is overdue, or none was ever set: the arm stops."""

    stopping = 6
    """
    The input is unusable, the quadratic program was not solved, or the arm feels a torque that nothing explains: a damped stop.
    """

    clearance_lost = 7
    """
    A covering ellipsoid of the arm reaches into an obstacle, a plane or another link.
    """

class Activity(enum.Enum):
    """What a controller is doing."""

    no_goal = 0
    """
    No goal, or the commanded velocity is too old: the arm comes to rest, and avoids moving obstacles.
    """

    moving = 1
    """On the way to its goal, or following a velocity, twist or trajectory."""

    waiting = 2
    """
    Waiting until a posture is found, its trajectory is free, or after a touch for `Controller.restart`, or paused for `Controller.resume`.
    """

    arrived = 3
    """The goal is reached."""

    blocked = 4
    """
    No path leads to the goal, for at least 0.2 s, see Controller.explain; the arm goes as near as it can.
    """

    stale = 5
    """As SafetyStatus.stale: the arm stops."""

class Command:
    """The result of one step of a Controller; arrays are copies."""

    @property
    def status(self) -> SafetyStatus:
        """How safe the command is."""

    @property
    def activity(self) -> Activity:
        """What the controller does."""

    @property
    def torque(self) -> numpy.typing.NDArray[numpy.float64]:
        """(nv,) torque [Nm | N], gravity included; zero without torque output."""

    @property
    def torque_without_gravity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (nv,) torque without gravity [Nm | N], for arms that compensate gravity themselves; nan if the arm has no inertias.
        """

    @property
    def acceleration(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (nv,) acceleration of the arm: that of the reference plus feedback [rad/s^2 | m/s^2].
        """

    @property
    def wanted(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (nv,) desired acceleration: after barriers, before any limit [rad/s^2 | m/s^2].
        """

    @property
    def velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """(nv,) velocity of the reference after this period [rad/s | m/s]."""

    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (nv,) position of the reference after this period [rad | m]; nan until a state was known.
        """

    @property
    def disturbance(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (nv,) disturbance that the observer compensates, with torque output [Nm | N].
        """

    @property
    def rotors(self) -> numpy.typing.NDArray[numpy.float64]:
        """(nv,) estimated rotor inertia that the model lacks [kg m^2 | kg]."""

    @property
    def input_change(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (nv,) difference between the velocity of the reference after this period and the requested one [rad/s | m/s]. For a
        twist V: J^+ (J v - V), damped near singularities; motion in the null space of J does not count. For a
        trajectory the requested velocity is that at its clock, at full speed. Zero without one of these.
        """

    @property
    def tracking_error(self) -> float:
        """Largest joint error between arm and reference [rad | m]."""

    @property
    def deviation(self) -> float:
        """
        Largest joint distance of the reference from the straight lines between a trajectory's samples [rad | m]; lines within
        0.05 s of the trajectory's clock count. Before the first sample: distance from the approach to it. See `delay` for
        how late it is.
        """

    @property
    def delay(self) -> float:
        """Time by which the trajectory's clock is late [s]."""

    @property
    def clearance(self) -> float:
        """
        Least clearance of the covering body [m], exact below the activation distances; inf: far; nan: unknown.
        """

    @property
    def coordinate(self) -> int:
        """
        Index in Controller.labels of the pair with the least clearance; -1: nothing is near.
        """

    @property
    def point(self) -> int:
        """Index of the obstacle point of that pair; -1: none."""

    @property
    def bound_by(self) -> int:
        """
        Index in Controller.labels of the clearance that changes the motion most; -1: none.
        """

    @property
    def distance(self) -> float:
        """
        Distance to the nearest obstacle [m], up to speed_limits.far_distance; inf: farther, or without these settings; nan: unknown.
        """

    @property
    def speed(self) -> float:
        """Speed of the arm's fastest frame [m/s]; nan: unknown."""

    @property
    def speed_limit(self) -> float:
        """Speed limit of every frame [m/s]; inf: none; nan: unknown."""

    @property
    def limits(self) -> list[Limit]:
        """(nv) limits that restrict each joint."""

    @property
    def avoiding(self) -> bool:
        """
        Whether the arm follows an avoidance trajectory, out of the way of a moving obstacle.
        """

    @property
    def on_path(self) -> bool:
        """Whether the arm follows a path of the planner."""

    @property
    def look_ahead_age(self) -> float:
        """
        Age of the newest look-ahead: time since the state that it started from [s]. It grows if threads get too little processor
        time, or if steps come faster than real time. 0: look-ahead is off, or runs inside `step`.
        """

    @property
    def planner_age(self) -> float:
        """
        Age of the planner's newest check, likewise [s]; 0 also if there is nothing to plan.
        """

    @property
    def pace(self) -> float:
        """
        Share of its speed that the arm may use near moving obstacles, given the age of the look-ahead: 1 up to
        `look_ahead.slow_after` delays, then linear, 0 from `look_ahead.rest_after` delays on.
        """

    @property
    def measured_period(self) -> float:
        """
        Period for which the step commands [s]: that of the settings, unless the last steps came more or less often.
        """

    @property
    def late_steps(self) -> int:
        """
        Steps so far that came more than 1.5 periods of the settings after the one before.
        """

    @property
    def missed_periods(self) -> int:
        """Periods of the settings so far in which a step was missing."""

    def __getstate__(self) -> dict[str, Any]: ...

    def __setstate__(self, state: dict[str, Any], /) -> None: ...

    def __repr__(self) -> str: ...

class Controller:
    """
    Turns the arm's state into a safe command, once a period: planner, barriers, look-ahead and quadratic program in one.
    Goals and obstacles may be set from any thread. Raises ValueError that names the setting at fault.
    """

    def __init__(self, arm: Arm, settings: ControllerSettings | None = None) -> None: ...

    def set_goal(self, goal: numpy.typing.ArrayLike | JointGoal | PoseGoal | Sequence[PoseGoal]) -> None:
        """
        Sets the goal, from the next step on: a configuration (nv,) [rad | m] within the limits, a moving goal, a pose, or
        poses of several frames, as of two arms. Joints that no pose needs stay where they are, and avoid obstacles. Raises
        ValueError that names the joint, its value and what is allowed; the previous goal then stays.
        """

    def set_velocity(self, v: numpy.typing.ArrayLike) -> None:
        """
        Commands joint velocities (nv,) [rad/s | m/s]; needs no goal. One factor scales them down to the limits. A joint stops at
        its position limit while the others continue. The arm slides along obstacles or stops at them. After `inputs.timeout`
        without a new request the arm stops. Raises ValueError that names the joint and what is allowed; the previous request
        then stays.
        """

    def set_twist(self, frame: str, twist: numpy.typing.ArrayLike, local: bool = False, free: TwistFreedom | str = 'none') -> None:
        """
        Commands the twist (6,) of a frame: velocity of its origin [m/s] and angular velocity [rad/s], in axes of the world or,
        with `local`, its own; rows as in `Robot.jacobian`. The frame moves with s times the whole twist, with the largest s
        in [0, 1] that joint limits and singular configurations allow. With free="rotation" the last three numbers are
        ignored and the frame may turn: for arms with fewer than six joints. Along obstacles the arm slides;
        `command.status`, `command.input_change` and `explain` say so. Raises ValueError that lists the known frames, or the
        values of `free`.
        """

    def set_trajectory(self, q: numpy.typing.ArrayLike, times: numpy.typing.ArrayLike, behaviour: TrajectoryBehaviour | str = 'keep_path') -> None:
        """
        Follows joint positions q (K, nv) [rad | m] at times (K,) [s] after the next step. Times must increase; a sample may be
        there twice. Cubics between samples keep monotone samples monotone and dwells still, within 0.01 rad (2 mm) of the
        straight lines. The arm has until the first time, at most 3600 s, to reach the first sample, which may differ from its
        present state. If time stamps bunch up so that limits forbid them, they move by up to 0.2 s; if that is not enough, the
        trajectory's clock slows down. Joints without limits take the short way between samples, at most half a turn.
        `keep_path` slows down and waits in front of an obstacle, `steer` goes around it and returns. `command.deviation` and
        `command.delay` say how far off and how late the arm is. Raises ValueError that names sample, joint, value and what is allowed.
        """

    def clear_goal(self) -> None:
        """
        Removes the goal: the arm comes to rest where it is, and still avoids moving obstacles.
        """

    def restart(self) -> None:
        """
        Restarts the reference at the measured state of the next step: call it after something else has moved the arm, or to go on
        after the arm touched something. The goal stays. Without this call the reference restarts once five measured positions in a row agree with each other but not
        with the command, or at the first one after a pause of more than 0.1 s; until then the arm comes to rest.
        """

    def continue_from(self, position: numpy.typing.ArrayLike, velocity: numpy.typing.ArrayLike, acceleration: numpy.typing.ArrayLike) -> None:
        """
        What the arm's drives say that they go on from (nv,), for outputs of positions: the reference of the next step begins there.
        For loops of one's own, before `step`, where a command did not reach the drives. Other outputs ignore it. Raises
        RuntimeError while a Loop or `integrate` has the controller: a Loop tells it by itself.
        """

    def pause(self) -> None:
        """
        The arm comes to rest within its limits and clearances, and stays there until `resume`; its goal or request is kept. The
        activity is `waiting` then. From any thread.
        """

    def resume(self) -> None:
        """Goes on to the goal after `pause`."""

    @property
    def is_paused(self) -> bool:
        """Whether the arm rests until `resume`."""

    def set_arm(self, arm: Arm) -> None:
        """
        Replaces body, inertias and pairs, for example by a finer cover; joints and limits must be the same. Takes some tenths of
        a second beside the loop; the next step uses the new body. Objects stay attached; the planner plans again.
        Raises ValueError that says what differs.
        """

    def attach(self, object: str | Attachment, geometry: sidestep.obstacles.Shape | numpy.typing.ArrayLike | None = None, **options: Any) -> None:
        """
        Attaches an object to a link, from the next step on: attach("cup", Cylinder(0.04, 0.1), link="fr3_hand", pose=X,
        mass=0.3, may_touch=["fr3_leftfinger", "fr3_rightfinger"]), with the options of `sidestep.arm.attachment`; a
        shape, or points (N, 3) in the object's frame. The object avoids obstacles and the links that other joints move, and its
        mass counts. Links that overlap with it now may stay as close as they are. With rests_on=["table"] it may also stay as
        close to the obstacle 'table' as it is now, until it is lifted off. Takes less than a second, while steps continue.
        Raises ValueError that names what is wrong; nothing changes then. Warns if the object is far from the link.
        """

    def detach(self, name: str) -> None:
        """
        Releases an object, from the next step on. Raises ValueError that lists the attached objects.
        """

    @property
    def attached(self) -> list[str]:
        """Names of the attached objects."""

    @property
    def arm(self) -> Arm:
        """The arm (of the core), with what is attached."""

    @property
    def obstacles(self) -> Obstacles:
        """
        A copy of what the last step saw; `name_of(command.point)` of it is the name of what is nearest.
        """

    def step(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, mass_matrix: numpy.typing.ArrayLike | None = None, bias: numpy.typing.ArrayLike | None = None, *, time: float | None = None) -> Command:
        """
        One period at q (nv,) [rad | m] and v (nv,) [/s], perhaps with the arm's own mass matrix (nv, nv) and bias (nv,)
        [Nm | N] there. `time`: when q and v were measured, on a monotonic clock of yours [s]; without it (None or nan) the machine's
        clock counts, and in synchronous runs exactly a period. A time that goes back gives a damped stop. Values that are not finite give a damped stop. Raises ValueError on wrong shapes, RuntimeError
        while a Loop or `integrate` has the controller; so does what tells of the last step. Warns where several threads
        step it in turn.
        """

    def record(self, path: str | os.PathLike[str]) -> Recording:
        """
        Records every input of every step and its command to a file, from which `replay` gives the same commands bit for bit.
        Before the first step; `with controller.record(path):` ends it with the block, else it ends with the controller. Steps
        allocate nothing for it and wait for nobody; where the disk is too slow it ends, and the steps after that are counted. Raises
        RuntimeError after the first step or where one was recorded already, OSError where the file cannot be written.
        """

    def black_box(self, folder: str | os.PathLike[str], seconds: float = 30.0, *, most_bytes: int = 1073741824) -> BlackBox:
        """
        Keeps the last `seconds` (up to a third more) on disk from now on, in files of a third of that each; older ones are deleted.
        The folder is kept near most_bytes: where they are reached, less than `seconds` are there, and the file being written comes
        on top. For `load_recording` and `sidestep report`: what begins in the middle of a motion cannot be replayed. From any
        thread, at any time, beside a recording. `with controller.black_box(folder):` ends it with the block. Raises RuntimeError
        where it is on, ValueError, OSError where nothing can be written.
        """

    @property
    def command(self) -> Command:
        """Of the last step."""

    def explain(self) -> str:
        """
        One sentence: what the last command does and why, and what to do about it.
        """

    @property
    def questions(self) -> list[str]:
        """
        What is hard to believe in the order and the obstacles that were set last, with value and likely cause, such as
        millimetres for metres; setters warn of it, and it is followed all the same. The newest is the last.
        """

    @property
    def settings(self) -> ControllerSettings:
        """A copy."""

    @property
    def values(self) -> numpy.typing.NDArray[numpy.float64]:
        """(m,) psi of every coordinate at the last step, see labels."""

    @property
    def geometric_step(self) -> Step:
        """
        The Step of the geometric system in the last step, with its clearances, metric and diagnosis.
        """

    @property
    def system(self) -> GeometricSystem:
        """
        The geometric system, a copy. Its barriers begin at full distance, see activations.
        """

    @property
    def activations(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (m,) clearance [m | rad] at which each barrier begins now: less than set where the arm has to come near what
        rests, at its goal and in narrow places of its path.
        """

    @property
    def labels(self) -> list[CoordinateLabel]:
        """What the clearances are of."""

    @property
    def target(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        (nv,) the configuration that the arm is led to: the goal, or a posture of a pose goal; None: none yet.
        """

    @property
    def plan(self) -> Plan:
        """What the planner found last."""

    @property
    def goal_obstruction(self) -> Obstruction | None:
        """
        What the covering body touches at the goal, or at the posture found for a pose, among the obstacles as they were set; None: it is free there, or there is no goal.
        """

    @property
    def searches(self) -> int:
        """How often a path was looked for."""

    @property
    def has_torque(self) -> bool:
        """Whether the commands hold torque."""

    def __repr__(self) -> str: ...

    def set_obstacles(self, obstacles: Obstacles | sidestep.obstacles.Shape | Sequence[Obstacles | sidestep.obstacles.Shape], source: str = 'scene', *, time: float | None = None, valid_for: float | None = None) -> None:
        """
        Replaces what a source said before, and nothing of the others, from the next step on: points, a shape, or a list of both. Balls
        cover each shape without gaps, see `sidestep.obstacles.obstacles_from_shapes`. Points move on by their velocities, from `time`
        on: when they were captured [s], on the clock of `step`; None: when the next step takes them.

        valid_for [s]: age up to which they are believed; inf: for ever. None: `sources.valid_for` where they have a time or velocities, or
        where the source came three times within that; else for ever (`obstacle_timeout`). A source that is older is overdue: its points
        stand still, the arm stops, and goes on when it comes again. An empty set after one with points is believed once the source
        has stayed empty for `sources.empty_after`; `remove_obstacles` at once. Until anything was set the arm stays where it is:
        `Obstacles.none()` says that the space is free. Raises ValueError that names the value and what is allowed.
        """

    def expect_obstacles(self, source: str) -> None:
        """
        Tells that a source will come: the arm stays where it is until it has said something, as a second camera that starts later. A
        source that has, stays as it is. `Perception` expects each of its cameras. Raises ValueError that names the value.
        """

    def remove_obstacles(self, source: str = 'scene') -> None:
        """
        Forgets a source, at once; also one that was expected. Raises ValueError that lists the sources.
        """

    def add_obstacle(self, obstacle: Obstacles | sidestep.obstacles.Shape, source: str = 'scene') -> None:
        """
        Adds a shape with a name to what a source says. Raises ValueError where it has no name, or the source has that name already.
        """

    def move_obstacle(self, name: str, pose: numpy.typing.ArrayLike, source: str = 'scene', *, time: float | None = None, valid_for: float | None = None) -> None:
        """
        Moves a shape that has a name to another pose (4, 4) in the world. Like `set_obstacles` it says that the whole source is as
        new as `time`: give each tracker a source of its own. Raises ValueError that lists the names.
        """

    def remove_obstacle(self, name: str, source: str = 'scene') -> None:
        """
        Removes a shape that has a name from what a source says, at once. Raises ValueError that lists the names.
        """

    @property
    def time(self) -> float:
        """
        Time of the last step [s], on the clock on which obstacles are captured.
        """

    @property
    def sources(self) -> list[SourceState]:
        """
        What is believed of each source, a SourceState each, as of the last step. For the thread of `step`.
        """

def program_status(controller: Controller) -> ProgramStatus:
    """
    How the quadratic program ended in the last step, for tests; `command.status` is what counts.
    """

def looks_like_degrees(angle: float) -> bool:
    """
    Whether an angle [rad] is implausible in radians and plausible in degrees: more than one and a half turns, at most
    three in degrees, and not a whole number of quarter turns.
    """

def unlimited_joints(robot: Robot) -> list[bool]:
    """
    (nv) Which coordinates turn without limits, so that a configuration is the same a turn further.
    """

class MotionRecord:
    """
    A motion of a controller without physics: row k is what step k began with and gave.
    """

    @property
    def q(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps, nv)."""

    @property
    def v(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps, nv)."""

    @property
    def acceleration(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps, nv)."""

    @property
    def statuses(self) -> list[SafetyStatus]:
        """(steps,) How safe each command was."""

    @property
    def activities(self) -> list[Activity]:
        """(steps,) What the controller did."""

    @property
    def clearance(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps,) of the covering body [m]."""

    @property
    def step_seconds(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps,) [s]."""

    @property
    def last_q(self) -> numpy.typing.NDArray[numpy.float64]:
        """(nv,) after the last step."""

    @property
    def last_v(self) -> numpy.typing.NDArray[numpy.float64]:
        """(nv,) after the last step."""

    @property
    def arrived(self) -> bool:
        """
        Every joint came within the tolerance of the goal, which ended the motion.
        """

    def __repr__(self) -> str: ...

def integrate(controller: Controller, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, *, steps: int, goal: numpy.typing.ArrayLike | None = None, tolerance: float = 0.0) -> MotionRecord:
    """
    Moves an ideal robot, which tracks the command exactly, by semi-implicit Euler: v += a T, q += v T. Ends when every joint
    is within tolerance [rad], a prismatic one within a tenth of it [m], of goal (nv,), if given. Releases the GIL. Raises
    ValueError on sizes, states that are not finite, less than one step, and a controller that is not synchronous.
    """

class RecordedRun:
    """A recorded run as arrays; row k is step k."""

    @property
    def header(self) -> RecordingHeader:
        """What made the recording, and with what."""

    @property
    def complete(self) -> bool:
        """The recording was ended, not cut off by the end of its program."""

    @property
    def lost(self) -> int:
        """Steps that were made and not recorded."""

    @property
    def damage(self) -> str:
        """What is wrong with a file, and where; empty: nothing."""

    @property
    def steps(self) -> int:
        """Number of steps."""

    @property
    def time(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps,) on the clock of `step` [s]."""

    @property
    def q(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps, nv) measured [rad | m]."""

    @property
    def v(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps, nv) measured [rad/s | m/s]."""

    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps, nv) commanded [rad | m]."""

    @property
    def velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps, nv) commanded [rad/s | m/s]."""

    @property
    def acceleration(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps, nv) commanded [rad/s² | m/s²]."""

    @property
    def wanted(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps, nv) acceleration before any limit [rad/s² | m/s²]."""

    @property
    def torque(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps, nv) commanded, gravity included [Nm | N]."""

    @property
    def torque_without_gravity(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps, nv) commanded [Nm | N]."""

    @property
    def clearance(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps,) least of the covering body [m]; inf: far, nan: unknown."""

    @property
    def distance(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps,) to the nearest obstacle, with speed limits [m]."""

    @property
    def speed(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps,) of the fastest frame [m/s]."""

    @property
    def speed_limit(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps,) for every frame [m/s]."""

    @property
    def tracking_error(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps,) largest of the joints [rad | m]."""

    @property
    def status(self) -> numpy.typing.NDArray[numpy.int32]:
        """(steps,) numbers of SafetyStatus."""

    @property
    def activity(self) -> numpy.typing.NDArray[numpy.int32]:
        """(steps,) numbers of Activity."""

    @property
    def nearest(self) -> numpy.typing.NDArray[numpy.int32]:
        """
        (steps,) index in `parties` of the least clearance; -1: nothing is near.
        """

    @property
    def bound_by(self) -> numpy.typing.NDArray[numpy.int32]:
        """
        (steps,) index in `parties` of what changes the motion most; -1: nothing.
        """

    @property
    def request(self) -> numpy.typing.NDArray[numpy.int32]:
        """(steps,) index in `requests`; -1: none is known."""

    @property
    def link_time(self) -> numpy.typing.NDArray[numpy.float64]:
        """(moments,) of `link_clearance` [s]."""

    @property
    def limits(self) -> numpy.typing.NDArray[numpy.uint16]:
        """(steps, nv) limits that restrict each joint, as bits."""

    @property
    def link_clearance(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (moments, links) of each link to what is around [m], and of the arm to itself (the last); inf: farther than 0.5 m.
        Computed by the clearance query from the recorded q and obstacles.
        """

    def scene(self, moment: int) -> tuple[numpy.typing.NDArray[numpy.float32], numpy.typing.NDArray[numpy.float32]]:
        """
        Centres (N, 3) [m] and radii (N,) [m] of the obstacles at a moment of link_time, if they were read.
        """

    @property
    def links(self) -> list[str]:
        """Names of the links, and "the arm itself"."""

    @property
    def requests(self) -> list[str]:
        """What was asked, in words, in the order of use."""

    @property
    def parties(self) -> list[tuple[str, str]]:
        """A link, and what it is near to in words."""

    def explain(self, step: int) -> str:
        """
        One sentence from what was recorded: how safe a step (from 0) was, and why.
        """

    def __repr__(self) -> str: ...

def read_recorded_run(paths: Sequence[str | os.PathLike[str]], *, scenes: bool = False) -> RecordedRun:
    """
    Reads a recording, or the files of one black box in the order of time; with `scenes` also where the obstacles were. Raises
    OSError where one cannot be read, ValueError that says what is wrong with it.
    """

class SourceState:
    """What a controller believes of a source of obstacles."""

    @property
    def name(self) -> str:
        """As `set_obstacles` was told."""

    @property
    def size(self) -> int:
        """Number of points."""

    @property
    def age(self) -> float:
        """
        Time since what is believed was captured [s]; inf: it was expected, and has not come yet.
        """

    @property
    def valid_for(self) -> float:
        """Age up to which it is believed [s]; inf: for ever."""

    @property
    def is_overdue(self) -> bool:
        """It is older than that: the arm stops until it comes again."""

    @property
    def is_emptied(self) -> bool:
        """Newer sets are empty, and not believed yet."""

    def __repr__(self) -> str: ...

class DepthNoise:
    """
    Noise of a depth camera: standard deviation sigma(z) = constant + quadratic z^2 of a depth z [m].

    For stereo quadratic = s/(f b), with the error s of a disparity [pixel], focal length f [pixel] and baseline b [m].
    """

    @overload
    def __init__(self) -> None: ...

    @overload
    def __init__(self, constant: float = 0.001, quadratic: float = 0.004) -> None: ...

    @property
    def constant(self) -> float:
        """[m]"""

    @property
    def quadratic(self) -> float:
        """[1/m]"""

    def sigma(self, z: float) -> float:
        """Standard deviation of a depth z [m]."""

    def __repr__(self) -> str: ...

class DepthCamera:
    """
    A depth camera: its size, intrinsics, place, noise and errors.

    Pixel (u, v), integer at its centre, u to the right and v down, sees along the ray (x, y, 1) of the optical frame (x right,
    y down, z forward), x = (u - cx)/fx and y = (v - cy)/fy where the lens does not distort. A depth is the z of what is seen.
    """

    def __init__(self, name: str, *, width: int, height: int, fx: float, fy: float, cx: float, cy: float, pose: numpy.typing.ArrayLike, link: str = '', distortion_model: str = 'none', distortion: numpy.typing.ArrayLike | None = None, noise: DepthNoise = ..., near: float = 0.1, far: float = 4.0, translation_error: float = 0.005, rotation_error: float = 0.005, clock_error: float = 0.005) -> None:
        """
        Args:
            name: by which images come, and name of its source of obstacles.
            width, height: of the image [pixel].
            fx, fy, cx, cy: focal lengths and principal point [pixel].
            pose: (4, 4) of the optical frame in the world; on a link in its frame.
            link: frame of the arm on which it is mounted; '': none.
            distortion_model: 'none', 'brown_conrady' (k1, k2, p1, p2, k3; ROS: plumb_bob), 'inverse_brown_conrady' (RealSense) or
                'kannala_brandt' (k1 to k4; ROS: equidistant).
            distortion: up to 5 coefficients.
            noise: of depths.
            near, far: range in which depths are believed [m].
            translation_error, rotation_error: by how much the pose may be wrong [m], [rad].
            clock_error: the same of times of capture [s].

        Raises ValueError that names the camera, the value and what is allowed.
        """

    @property
    def name(self) -> str:
        """By which images come."""

    @property
    def width(self) -> int:
        """[pixel]"""

    @property
    def height(self) -> int:
        """[pixel]"""

    @property
    def fx(self) -> float:
        """Focal length [pixel]."""

    @property
    def fy(self) -> float:
        """Focal length [pixel]."""

    @property
    def cx(self) -> float:
        """Principal point [pixel]."""

    @property
    def cy(self) -> float:
        """Principal point [pixel]."""

    @property
    def distortion_model(self) -> str:
        """Model of the lens."""

    @property
    def distortion(self) -> numpy.typing.NDArray[numpy.float64]:
        """Coefficients (5,) of the lens."""

    @property
    def link(self) -> str:
        """Frame of the arm on which it is mounted; '': none."""

    @property
    def pose(self) -> numpy.typing.NDArray[numpy.float64]:
        """Pose (4, 4) in the world, or on its link."""

    @property
    def noise(self) -> DepthNoise:
        """Noise of depths."""

    @property
    def near(self) -> float:
        """Least depth [m]."""

    @property
    def far(self) -> float:
        """Largest depth [m]."""

    @property
    def translation_error(self) -> float:
        """Error of the pose [m]."""

    @property
    def rotation_error(self) -> float:
        """Error of the pose [rad]."""

    @property
    def clock_error(self) -> float:
        """Error of times of capture [s]."""

    def replace(self, **changes: Any) -> DepthCamera:
        """
        The same camera but for some values, by the names of its arguments. Raises as it does.
        """

    def project(self, points: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
        """
        Pixels (N, 2) that see points (N, 3) of the optical frame, with z > 0; they may lie outside of the image. NaN: so far from the axis that the distortion's polynomial no longer holds.
        """

    def __repr__(self) -> str: ...

class PixelLabel(enum.IntEnum):
    """What a pixel shows."""

    nothing = 0
    """No depth, or one that is too near."""

    obstacle = 1
    """Something that is not the arm."""

    arm = 2
    """The arm, or an object that it holds."""

    edge = 3
    """A depth between two surfaces, which is on neither: a flying pixel."""

    explained = 4
    """A shape that was told."""

    left_out = 5
    """In a region that is left out."""

    outside = 6
    """Beyond the range of the camera."""

class ArmResidual:
    """
    How far what a camera sees is from where the arm should be: of rays through the cores of its cover.
    """

    @property
    def rays(self) -> int:
        """Rays with a depth."""

    @property
    def on_arm(self) -> int:
        """Those that end on the arm."""

    @property
    def through(self) -> int:
        """Those that end behind it."""

    @property
    def depth_error(self) -> float:
        """
        Mean of the measured depth less that of the grown cover, of those on the arm [m].
        """

    @property
    def through_share(self) -> float:
        """Share of rays that see through the arm, of those that nothing hides."""

class PerceptionReport:
    """What became of an image, and what it cost."""

    @property
    def used(self) -> bool:
        """
        False: nobody knows where the arm was at the time of capture, or the image shows nothing; obstacles are as before.
        """

    @property
    def obstacle_pixels(self) -> int:
        """Number of pixels that show something else than the arm."""

    @property
    def arm_pixels(self) -> int:
        """Number of pixels that show the arm."""

    @property
    def edge_pixels(self) -> int:
        """Number of flying pixels."""

    @property
    def seen(self) -> int:
        """Number of obstacles that this camera shows now."""

    @property
    def remembered(self) -> int:
        """Number of those that no camera shows now."""

    @property
    def explained(self) -> int:
        """Number of cells that told shapes explain, or that are left out."""

    @property
    def unseen(self) -> int:
        """Number of obstacles where nobody has looked."""

    @property
    def arm(self) -> ArmResidual:
        """Where the arm is, of this image."""

    @property
    def through(self) -> float:
        """Share of rays that see through the arm, smoothed over half a second."""

    @property
    def question(self) -> str:
        """What is hard to believe, in words; empty: nothing."""

    @property
    def depth_time(self) -> float:
        """Time for depths and edges [s]."""

    @property
    def mask_time(self) -> float:
        """Time to take the arm out [s]."""

    @property
    def map_time(self) -> float:
        """Time for points and map [s]."""

    @property
    def unseen_time(self) -> float:
        """Time for unseen space [s]."""

    @property
    def obstacles_time(self) -> float:
        """Time to hand obstacles to the controller [s]."""

    @property
    def total_time(self) -> float:
        """Sum of the times [s]."""

    def __repr__(self) -> str: ...

class CameraCorrection:
    """
    Where a camera is and how its clock goes, as the arm in its images says.
    """

    @property
    def pose(self) -> numpy.typing.NDArray[numpy.float64]:
        """Pose (4, 4) in the world, or on its link, that fits best."""

    @property
    def translation(self) -> float:
        """By which it differs from what was told [m]."""

    @property
    def rotation(self) -> float:
        """The same [rad]."""

    @property
    def clock_offset(self) -> float:
        """
        To add to the times of images [s]; nan: not known, the arm does not move enough.
        """

    @property
    def rms_before(self) -> float:
        """Distance of points from the surface of the arm before [m], robust."""

    @property
    def rms_after(self) -> float:
        """The same afterwards [m]."""

    @property
    def overshoot(self) -> float:
        """
        By which the cover is larger than the arm, where it was seen [m]: taken off.
        """

    @property
    def translation_spread(self) -> float:
        """Half the difference of what each second image alone says [m]."""

    @property
    def rotation_spread(self) -> float:
        """The same [rad]."""

    @property
    def clock_spread(self) -> float:
        """The same of the clock offset [s]."""

    @property
    def images(self) -> int:
        """Number of images that show the arm."""

    @property
    def points(self) -> int:
        """Number of points near it."""

    @property
    def question(self) -> str:
        """What is hard to believe, in words; empty: nothing."""

class CameraCheck:
    """
    Measures pose and clock offset of a camera from the arm that moves in view.

    Minimises the robust sum of the distances |d(X_WC p, q(t + tau)) + o| of points p of the images from the surface of the arm
    over the pose X_WC and the clock offset tau; d is the distance to the covering ellipsoids, o the overshoot of the link's cover.
    """

    def __init__(self, arm: Arm, camera: DepthCamera) -> None: ...

    def add_state(self, q: numpy.typing.ArrayLike, *, time: float) -> None:
        """The arm was at q (nv,) at a time [s], later than the last one."""

    def add(self, depth: numpy.typing.ArrayLike, *, time: float, unit: float | None = None) -> None:
        """
        An image (height, width), captured at a time [s]; as for Perception.update.
        """

    def solve(self) -> CameraCorrection:
        """
        Raises RuntimeError where fewer than three images show the arm near where it should be.
        """

class PerceptionSettings:
    """
    How what cameras see becomes obstacles.

        voxel [m], default 0.02, allowed 0.005 to 0.1: edge of the cells in which points are merged, within reach of the arm: smaller cells stand out of surfaces less (by 0.4 of the edge, more at edges), and cost more
        reach_margin [m], default 0.25, allowed 0 to 2: distance beyond the reach of the arm up to which cells are as fine as voxel; beyond, their edge is twice and four times as long: larger is finer farther out, and costs more
        view_margin [m], default 2.0, allowed 0 to 5: distance beyond the reach of the arm up to which things are seen: smaller is faster, and sees later what comes
        memory [s], default 30.0, allowed 0 to inf: time for which something is kept that is hidden or out of view now; what moved, or was seen for less than 0.1 s, is kept for 0.3 s and ten times as long as it was seen: longer keeps more that is gone
        clear_after, default 2, allowed 1 to 10: number of images in a row that must see through a cell before what was there is gone: more is safer against flicker, and clears later
        least_pixels, default 3, allowed 1 to 100: number of pixels that must show a cell before it counts at once, or three times as many around it where noise is larger than a cell; with fewer it counts when a second image shows it, the next or the one after it: more makes fewer ghosts, and shows thin things later
        steady_images, default 8, allowed 1 to 100: number of images over which a camera that stands still averages the depth of what rests (1: none): more is smoother, and up to 2 sigma behind what moves slowly (by less than 1 sigma from image to image), 0.9 sigma where it is 15 pixels wide and high
        unseen_is_free, default True, allowed 0 to 1: space that no camera has seen yet counts as free; without it the arm keeps clear of what nobody has looked at, and reaches less
        valid_for [s], default 0.25, allowed 0.001 to inf: age up to which the image of a camera is believed; then the arm stops until the next one comes: longer bridges more lost images

    Raises ValueError that names the setting, its value and what is allowed.
    """

    def __init__(self, *, voxel: float = 0.02, reach_margin: float = 0.25, view_margin: float = 2.0, memory: float = 30.0, clear_after: int = 2, least_pixels: int = 3, steady_images: int = 8, unseen_is_free: bool = True, valid_for: float = 0.25) -> None: ...

    def __repr__(self) -> str:
        """What differs from the defaults."""

    def to_dict(self) -> dict[str, Any]:
        """
        All settings as a dict of numbers, texts and dicts, for YAML or JSON: PerceptionSettings(**d) gives them again.
        """

    def __getstate__(self) -> dict[str, Any]: ...

    def __setstate__(self, values: dict[str, Any], /) -> None: ...

    def __copy__(self) -> PerceptionSettings: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    @property
    def voxel(self) -> float: ...

    @voxel.setter
    def voxel(self, value: float, /) -> None: ...

    @property
    def reach_margin(self) -> float: ...

    @reach_margin.setter
    def reach_margin(self, value: float, /) -> None: ...

    @property
    def view_margin(self) -> float: ...

    @view_margin.setter
    def view_margin(self, value: float, /) -> None: ...

    @property
    def memory(self) -> float: ...

    @memory.setter
    def memory(self, value: float, /) -> None: ...

    @property
    def clear_after(self) -> int: ...

    @clear_after.setter
    def clear_after(self, value: int, /) -> None: ...

    @property
    def least_pixels(self) -> int: ...

    @least_pixels.setter
    def least_pixels(self, value: int, /) -> None: ...

    @property
    def steady_images(self) -> int: ...

    @steady_images.setter
    def steady_images(self, value: int, /) -> None: ...

    @property
    def unseen_is_free(self) -> bool: ...

    @unseen_is_free.setter
    def unseen_is_free(self, value: bool, /) -> None: ...

    @property
    def valid_for(self) -> float: ...

    @valid_for.setter
    def valid_for(self, value: float, /) -> None: ...

def perception_settings_fields() -> list[dict[str, float | str]]:
    """Every setting of Perception, as controller_settings_fields."""

class Perception:
    """
    From depth cameras to the obstacles of a controller: takes the arm out of the image, remembers what is hidden, and hands
    the rest on.

    Each camera is a source of the controller, of its name. What no camera shows now is the source 'memory'; where nobody has
    looked, if that counts as occupied, 'unseen'. Calls from several threads wait for each other; none waits for `step`.
    """

    def __init__(self, controller: Controller, cameras: Sequence[DepthCamera], settings: PerceptionSettings | None = None) -> None:
        """
        Raises ValueError that names the camera or the setting, its value and what is allowed.
        """

    def update(self, camera: str, depth: numpy.typing.ArrayLike, *, time: float, unit: float | None = None, q: numpy.typing.ArrayLike | None = None, pose: numpy.typing.ArrayLike | None = None) -> PerceptionReport:
        """
        Takes an image of a camera, and gives the controller what it shows.

        Args:
            camera: its name.
            depth: (height, width) uint16 or float; 0, nan and inf: nothing seen.
            time: when it was captured [s], on the clock of `step`.
            unit: of a depth [m]; None: 0.001 of uint16, 1 of float.
            q: (nv,) of the arm at that time; None: as `step` was told.
            pose: (4, 4) of the optical frame in the world at that time; None: as the camera is mounted.

        Returns what became of it. Raises ValueError or TypeError that names the value and what is allowed.
        """

    def update_points(self, camera: str, points: numpy.typing.ArrayLike, *, time: float, q: numpy.typing.ArrayLike | None = None, pose: numpy.typing.ArrayLike | None = None) -> PerceptionReport:
        """
        The same of a cloud in the camera's optical frame [m]: (N, 3), or organised (height, width, 3); nan: nothing seen.
        """

    def leave_out(self, name: str, region: Obstacles | sidestep.obstacles.Shape | Sequence[Obstacles | sidestep.obstacles.Shape], *, grow: float = 0.02, link: str = '') -> None:
        """
        What is within `grow` [m] of the region is no obstacle: what is to be grasped, or a place where noise is known. In the world, or
        in the frame of a link. Replaces a region of the same name.
        """

    def take_in(self, name: str) -> None:
        """Undoes `leave_out`. Raises ValueError that lists the regions."""

    def forget(self) -> None:
        """Forgets all that was seen."""

    @property
    def cameras(self) -> list[DepthCamera]:
        """The cameras."""

    @property
    def settings(self) -> PerceptionSettings:
        """The settings."""

    def pose(self, camera: str) -> numpy.typing.NDArray[numpy.float64]:
        """Pose (4, 4) of a camera in the world at its last image."""

    def time(self, camera: str) -> float:
        """Time of capture of its last image [s]; nan before the first."""

    def depth(self, camera: str) -> numpy.typing.NDArray[numpy.float32]:
        """Depth [m] of the last image (height, width); 0: nothing seen."""

    def labels(self, camera: str) -> numpy.typing.NDArray[numpy.uint8]:
        """
        What each pixel of the last image shows (height, width), a PixelLabel each.
        """

    def cells(self) -> dict[str, numpy.typing.NDArray[Any]]:
        """
        The obstacles that were handed to the controller: centres (N, 3) [m], velocities (N, 3) [m/s], radii (N,) [m], ages (N,) [s], cameras (N,), remembered (N,):
        no camera shows it now, hidden (N,): something is in front of it. Copies that move as another camera
        says are not listed.
        """

    def unseen(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Middles (N, 3) of cells where nobody has looked and that border on seen space [m].
        """

class RobotState:
    """What a robot says of itself in one cycle."""

    def __init__(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, *, time: float | None = None, torque: numpy.typing.ArrayLike | None = None, told_position: numpy.typing.ArrayLike | None = None, told_velocity: numpy.typing.ArrayLike | None = None, told_acceleration: numpy.typing.ArrayLike | None = None, lost_cycles: int = 0, mass_matrix: numpy.typing.ArrayLike | None = None, bias: numpy.typing.ArrayLike | None = None) -> None:
        """
        q, v (nv,) measured [rad | m], [/s]. mass_matrix (nv, nv) and bias (nv,) [Nm | N], both or neither: the robot's own dynamics
        there, for which the torques are computed then. Raises ValueError on wrong shapes.
        """

    @property
    def time(self) -> float:
        """
        When it was measured [s]: on the machine's monotonic clock (`time.monotonic()`), or on the model's clock of a
        simulation; nan: the robot does not say.
        """

    @property
    def q(self) -> numpy.typing.NDArray[numpy.float64]:
        """(nv,) measured [rad | m]."""

    @property
    def v(self) -> numpy.typing.NDArray[numpy.float64]:
        """(nv,) measured [rad/s | m/s]."""

    @property
    def torque(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (nv,) measured, gravity included [Nm | N]; nan: the robot does not say.
        """

    @property
    def told_position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (nv,) what the robot goes on from, if it interpolates what it is sent [rad | m]; nan: it does not say.
        """

    @property
    def told_velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """(nv,) the same [rad/s | m/s]."""

    @property
    def told_acceleration(self) -> numpy.typing.NDArray[numpy.float64]:
        """(nv,) the same [rad/s^2 | m/s^2]."""

    @property
    def lost_cycles(self) -> int:
        """
        Cycles since the state before in which the robot went on without a command.
        """

    def __repr__(self) -> str: ...

class RobotDescription:
    """What a driver says of its robot, once."""

    def __init__(self, name: str, *, period: float, outputs: Sequence[str], joints: Sequence[str] = [], limits: JointLimits | None = None, paced: bool = True, real_time: bool = True, when_silent: str = 'not told') -> None:
        """
        period: of its cycle [s]; outputs: what it takes, of "torque", "acceleration", "velocity", "position"; joints: names in
        the order of its state, compared with the arm's; limits: of the robot, which the arm's must not exceed; paced: `read` waits
        for the robot's cycle, else the loop's own clock is the pace; real_time: False for a model on its own clock; when_silent:
        what it does when nobody writes, in words. Raises ValueError that names what is wrong.
        """

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def joints(self) -> list[str]:
        """
        Names of its joints, in the order of its state; empty: it does not say.
        """

    @property
    def period(self) -> float:
        """Of its cycle [s]."""

    @property
    def outputs(self) -> list[str]:
        """What it takes."""

    @property
    def paced(self) -> bool:
        """Whether `read` waits for its cycle."""

    @property
    def real_time(self) -> bool:
        """False: a model on its own clock."""

    @property
    def when_silent(self) -> str:
        """What it does when nobody writes, in words."""

    def __repr__(self) -> str: ...

class RunEnd(enum.Enum):
    """Why a run ended."""

    running = 0
    """It has not ended."""

    arrived = 1
    """The arm has been at its goal for `hold`, or `until` said so."""

    duration = 2
    """Its time was over."""

    stopped = 3
    """Somebody asked for it."""

    interrupted = 4
    """Ctrl-C."""

    failed = 5
    """An exception of the program around it."""

    state_lost = 6
    """No new state came from the robot, or the connection is gone."""

    robot_stopped = 7
    """The robot has stopped itself."""

    late = 8
    """The loop was later than `longest_gap`."""

    source_silent = 9
    """A source of obstacles was overdue for `silent_timeout`."""

    denied = 10
    """A supervisor did not approve of a command."""

class RunReport:
    """What a run on a robot was."""

    @property
    def end(self) -> RunEnd:
        """Why it ended."""

    @property
    def why(self) -> str:
        """The same in words."""

    @property
    def at_the_end(self) -> str:
        """What the controller said last, see `Controller.explain`."""

    @property
    def cycles(self) -> int:
        """Commands that were computed."""

    @property
    def missed(self) -> int:
        """Cycles that ended after the next one was due."""

    @property
    def lost(self) -> int:
        """Cycles in which the robot went on without a command, as it says."""

    @property
    def unwritten(self) -> int:
        """Commands that were not written: without a position, or not approved."""

    @property
    def worst(self) -> SafetyStatus:
        """Most severe status of a command."""

    @property
    def stop_time(self) -> float:
        """Time from the reason to the end until the loop let go of the arm [s]."""

    @property
    def at_rest(self) -> bool:
        """The arm was at rest, as measured, when the loop let go of it."""

    @property
    def scheduling(self) -> str:
        """What the machine permitted, in words."""

    @property
    def prioritised(self) -> bool:
        """Whether real-time scheduling was permitted."""

    @property
    def late(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (T,) of the last cycles: time from when each was due until it began [s]; 0 where the robot is the pace.
        """

    @property
    def taken(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (T,) of the last cycles: time from the state until the command was written [s].
        """

    @property
    def is_success(self) -> bool:
        """Whether nothing ended the run before its time."""

    def __repr__(self) -> str: ...

class RobotStopped(RuntimeError):
    pass

class LoopSettings:
    """
    How a run on a robot goes, and when it ends.

        duration [s], default inf, allowed 0 to inf: longest time of a run, counted in cycles; then the arm is brought to rest
        until_arrived, default False, allowed 0 to 1: the run ends when the arm has been at its goal for `hold`
        hold [s], default 0.2, allowed 0 to 60: time for which the arm must be at its goal before the run ends
        priority, default 60, allowed 0 to 99: priority of the loop's thread among real-time threads (SCHED_FIFO), where the machine permits it; 0: none. Higher is later less often, and lets other threads wait
        lock_memory, default True, allowed 0 to 1: keeps the program's memory from being swapped out, where the machine permits it
        start_timeout [s], default 5.0, allowed 0 to 600: longest wait for the robot's first state and the first obstacles
        state_timeout [s], default 0.1, allowed 0.001 to 10: time without a new state after which it counts as lost: the arm is braked without it, and the run ends. Longer bridges more lost messages, and brakes later
        longest_gap [s], default 0.1, allowed 0.001 to 10: longest delay of the loop itself, and largest jump of the states' clock; beyond it the run ends. Longer bears a busier machine, and leaves the robot alone for longer
        silent_timeout [s], default 10.0, allowed 0 to inf: time for which the arm waits at rest for a source of obstacles that has fallen silent; then the run ends
        stop_timeout [s], default 3.0, allowed 0 to 60: longest time for coming to rest at the end of a run
        start_in_contact, default False, allowed 0 to 1: begins also where the covering body of the arm overlaps something: the arm leads itself out
        kept_times, default 60000, allowed 1 to 1e+08: number of the last cycles whose times are kept; 16 bytes each

    Raises ValueError that names the setting, its value and what is allowed.
    """

    def __init__(self, *, duration: float = ..., until_arrived: bool = False, hold: float = 0.2, priority: int = 60, lock_memory: bool = True, start_timeout: float = 5.0, state_timeout: float = 0.1, longest_gap: float = 0.1, silent_timeout: float = 10.0, stop_timeout: float = 3.0, start_in_contact: bool = False, kept_times: int = 60000) -> None: ...

    def __repr__(self) -> str:
        """What differs from the defaults."""

    def to_dict(self) -> dict[str, Any]:
        """
        All settings as a dict of numbers, texts and dicts, for YAML or JSON: LoopSettings(**d) gives them again.
        """

    def __getstate__(self) -> dict[str, Any]: ...

    def __setstate__(self, values: dict[str, Any], /) -> None: ...

    def __copy__(self) -> LoopSettings: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    @property
    def duration(self) -> float: ...

    @duration.setter
    def duration(self, value: float, /) -> None: ...

    @property
    def until_arrived(self) -> bool: ...

    @until_arrived.setter
    def until_arrived(self, value: bool, /) -> None: ...

    @property
    def hold(self) -> float: ...

    @hold.setter
    def hold(self, value: float, /) -> None: ...

    @property
    def priority(self) -> int: ...

    @priority.setter
    def priority(self, value: int, /) -> None: ...

    @property
    def lock_memory(self) -> bool: ...

    @lock_memory.setter
    def lock_memory(self, value: bool, /) -> None: ...

    @property
    def start_timeout(self) -> float: ...

    @start_timeout.setter
    def start_timeout(self, value: float, /) -> None: ...

    @property
    def state_timeout(self) -> float: ...

    @state_timeout.setter
    def state_timeout(self, value: float, /) -> None: ...

    @property
    def longest_gap(self) -> float: ...

    @longest_gap.setter
    def longest_gap(self, value: float, /) -> None: ...

    @property
    def silent_timeout(self) -> float: ...

    @silent_timeout.setter
    def silent_timeout(self, value: float, /) -> None: ...

    @property
    def stop_timeout(self) -> float: ...

    @stop_timeout.setter
    def stop_timeout(self, value: float, /) -> None: ...

    @property
    def start_in_contact(self) -> bool: ...

    @start_in_contact.setter
    def start_in_contact(self, value: bool, /) -> None: ...

    @property
    def kept_times(self) -> int: ...

    @kept_times.setter
    def kept_times(self, value: int, /) -> None: ...

def clock_lateness(seconds: float, *, period: float = 0.001, priority: int = 60) -> numpy.typing.NDArray[numpy.float64]:
    """
    How late a thread wakes (T,) [s] that does nothing but wait for its turn, once a period [s]: what a loop on this machine cannot be
    better than.
    """

def supervisor_settings_fields() -> list[dict[str, float | str]]:
    """Every setting of a Supervisor, as `controller_settings_fields`."""

def loop_settings_fields() -> list[dict[str, float | str]]:
    """Every setting of a Loop, as `controller_settings_fields`."""

class NativeDriver:
    """A driver that needs no Python in the loop."""

    @property
    def description(self) -> RobotDescription:
        """RobotDescription of its robot."""

    def read(self, num_coordinates: int, timeout: float = 0.1) -> RobotState | None:
        """
        The robot's next state, for who only looks: not while a run goes on with this driver. None: there was none within timeout [s].
        Raises RuntimeError where the connection is gone or the robot has stopped itself.
        """

    @property
    def trouble(self) -> str:
        """Why the last call failed, in words."""

class IdealDriver(NativeDriver):
    """
    An ideal robot: it tracks every command exactly. With torque or acceleration v += a T, q += v T; with velocity or position it is
    where the reference is, at its speed. Its clock is the machine's; real_time=False: its own, as fast as the loop can.
    """

    def __init__(self, arm: Arm, q: numpy.typing.ArrayLike | None = None, *, v: numpy.typing.ArrayLike | None = None, period: float = 0.001, real_time: bool = True) -> None: ...

    def __enter__(self) -> IdealDriver: ...

    def __exit__(self, type: Any, value: Any, traceback: Any) -> None: ...

class CycleObserver:
    """Takes part in every cycle of a Loop, in its thread."""

class SupervisorSettings:
    """
    How far a supervisor lets things go.

        tolerance, default 0.1, allowed 0 to 10: share by which velocities, torques and torque rates may exceed their limits: more bears more noise, and denies later
        position_tolerance [rad], default 0.02, allowed 0 to 1: distance by which positions may be outside their limits
        tracking_tolerance [rad], default 0.3, allowed 0.001 to inf: largest distance of a commanded position from the measured one: a jump is denied
        state_age [s], default 0.05, allowed 0.001 to inf: age above which a measured state is too old
        blind_time [s], default 1.5, allowed 0.001 to inf: time without a new state after which no command is approved any more: the loop brakes the arm without one for less
        command_age [s], default 0.02, allowed 0.001 to inf: time without a report of the loop after which approval ends
        approval_age [s], default 0.02, allowed 0.001 to inf: age above which the supervisor's last approval does not count: longer bears a busier machine, and notices its death later
        stale_time [s], default 1.0, allowed 0.01 to inf: time after which an arm must be at rest whose obstacles are too old
        rest_speed [rad/s], default 0.05, allowed 0.001 to inf: joint speed that counts as rest then

    Raises ValueError that names the setting, its value and what is allowed.
    """

    def __init__(self, *, tolerance: float = 0.1, position_tolerance: float = 0.02, tracking_tolerance: float = 0.3, state_age: float = 0.05, blind_time: float = 1.5, command_age: float = 0.02, approval_age: float = 0.02, stale_time: float = 1.0, rest_speed: float = 0.05) -> None: ...

    def __repr__(self) -> str:
        """What differs from the defaults."""

    def to_dict(self) -> dict[str, Any]:
        """
        All settings as a dict of numbers, texts and dicts, for YAML or JSON: SupervisorSettings(**d) gives them again.
        """

    def __getstate__(self) -> dict[str, Any]: ...

    def __setstate__(self, values: dict[str, Any], /) -> None: ...

    def __copy__(self) -> SupervisorSettings: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    @property
    def tolerance(self) -> float: ...

    @tolerance.setter
    def tolerance(self, value: float, /) -> None: ...

    @property
    def position_tolerance(self) -> float: ...

    @position_tolerance.setter
    def position_tolerance(self, value: float, /) -> None: ...

    @property
    def tracking_tolerance(self) -> float: ...

    @tracking_tolerance.setter
    def tracking_tolerance(self, value: float, /) -> None: ...

    @property
    def state_age(self) -> float: ...

    @state_age.setter
    def state_age(self, value: float, /) -> None: ...

    @property
    def blind_time(self) -> float: ...

    @blind_time.setter
    def blind_time(self, value: float, /) -> None: ...

    @property
    def command_age(self) -> float: ...

    @command_age.setter
    def command_age(self, value: float, /) -> None: ...

    @property
    def approval_age(self) -> float: ...

    @approval_age.setter
    def approval_age(self, value: float, /) -> None: ...

    @property
    def stale_time(self) -> float: ...

    @stale_time.setter
    def stale_time(self, value: float, /) -> None: ...

    @property
    def rest_speed(self) -> float: ...

    @rest_speed.setter
    def rest_speed(self, value: float, /) -> None: ...

class SupervisorLink(CycleObserver):
    """
    The loop's side of a supervisor, see `sidestep.loop.Supervisor`: it reports each cycle in memory that two processes share, and
    approves only what the other process has approved.
    """

    def __init__(self, controller: Controller, settings: SupervisorSettings | None = None) -> None: ...

    @property
    def path(self) -> str:
        """The file of the shared memory."""

    def wait_for_supervisor(self, timeout: float) -> bool:
        """
        Waits so long at most [s] until the other process answers; whether it does.
        """

    @property
    def approves(self) -> bool:
        """Whether its last verdict approves."""

    @property
    def why(self) -> str:
        """What it said last to a loop, in words."""

    def reset(self) -> None:
        """What was denied may be tried again."""

def supervise(path: str) -> None:
    """
    The other process of a SupervisorLink: judges what its loop reports until that process is gone, or Ctrl-C.
    """

class Loop:
    """
    Runs a Controller on a robot in a real-time thread of its own: reads the state, steps, writes the command, once a period. See
    `sidestep.run`, which makes one and waits for its end. Before the first motion it checks that controller and robot fit (joints,
    limits, period, output: ValueError), that the state is plausible and free, and that obstacles are known (RuntimeError by `start`).
    However it ends, the arm is brought to rest within its limits and clearances first. RuntimeError if the controller is in use.
    """

    def __init__(self, controller: Controller, driver: Any, settings: LoopSettings | None = None, *, until_arrived: bool | None = None, duration: float | None = None, observers: Sequence[CycleObserver] = ()) -> None: ...

    def start(self) -> None:
        """
        Checks state and world, and begins. Raises RuntimeError that says what is wrong and what to do.
        """

    def stop(self, end: RunEnd | str = 'stopped', why: str = '') -> None:
        """
        Ends the run: brings the arm to rest first. Waits for nothing; the first reason counts.
        """

    def wait(self, seconds: float) -> bool:
        """
        Waits so long at most [s]; whether the run has ended. Ctrl-C raises, the run goes on.
        """

    def finish(self) -> RunReport:
        """
        Waits for the end; the RunReport. Ctrl-C stops the run, and raises once the arm is at rest.
        """

    @property
    def is_running(self) -> bool:
        """Whether the run has not ended."""

    @property
    def is_stopping(self) -> bool:
        """Whether the arm is being brought to rest."""

    def state(self) -> RobotState:
        """The newest RobotState; for one thread."""

    def __repr__(self) -> str: ...

class ModelLoop:
    """
    The loop of a model that you move yourself, such as a simulation: one cycle of `Loop` per call, in your thread and in the model's
    time. Nothing is checked before the first motion: a model shows what the controller does in any state. Without settings nothing
    ends it but `stop`, or a time that jumps by more than 10 s. Between two cycles the controller is free for you.
    """

    def __init__(self, controller: Controller, settings: LoopSettings | None = None) -> None: ...

    def cycle(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, mass_matrix: numpy.typing.ArrayLike | None = None, bias: numpy.typing.ArrayLike | None = None, *, time: float | None = None) -> Command:
        """
        One cycle at a state, see `Controller.step` for what is given; the command, for you to carry out. The first cycle restarts the
        controller's reference at the state. Raises ValueError on wrong shapes, RuntimeError once the run is over or while the
        controller is in use.
        """

    def stop(self, end: RunEnd | str = 'stopped', why: str = '') -> None:
        """
        Ends the run: the cycles that follow bring the arm to rest. The first reason counts.
        """

    @property
    def is_over(self) -> bool:
        """Whether the arm is at rest after the end: no cycle follows."""

    def report(self) -> RunReport:
        """The RunReport: of the run once it is over, before of why it is ending."""

    def __repr__(self) -> str: ...

class ConnectionLost(ConnectionError):
    """The server does not answer, or the connection has ended."""

class Cycle:
    """One cycle of a loop, as a client of its server gets it."""

    @property
    def number(self) -> int:
        """Counts cycles."""

    @property
    def time(self) -> float:
        """Of the server's monotonic clock [s]."""

    @property
    def state(self) -> RobotState:
        """State of the arm."""

    @property
    def command(self) -> Command:
        """What it was told."""

    @property
    def in_command(self) -> int:
        """Number of the client in command; 0: nobody."""

    def __repr__(self) -> str: ...

class Client:
    """
    Moves an arm that another program serves: the methods of a Controller over a connection, see `sidestep.connect`. From any thread;
    each call waits for its answer. Raises ValueError in the server's words where it refuses, ConnectionError where it is gone.
    """

    def __init__(self, address: str, token: str = '', *, name: str = '', rate: float = 100.0, timeout: float = 2.0) -> None: ...

    @staticmethod
    def over(descriptor: int, token: str = '', *, name: str = '', rate: float = 100.0, timeout: float = 2.0) -> Client:
        """
        A client over a stream socket that is connected, which it closes; for bridges.
        """

    def take_command(self, *, force: bool = False, keep_goal: bool = False) -> None:
        """
        Becomes the client that moves the arm. force: also where another one is, which is told. keep_goal: the goal stays when this
        client leaves or is lost; else it is cleared, and the arm comes to rest. Raises ValueError where another one is in command.
        """

    def release_command(self) -> None:
        """
        Hands the command back; see `take_command` for what becomes of the goal.
        """

    def set_goal(self, goal: numpy.typing.ArrayLike | JointGoal | PoseGoal | Sequence[PoseGoal]) -> None:
        """As Controller.set_goal. In command."""

    def set_velocity(self, v: numpy.typing.ArrayLike) -> None:
        """As Controller.set_velocity. In command."""

    def set_twist(self, frame: str, twist: numpy.typing.ArrayLike, local: bool = False, free: TwistFreedom | str = 'none') -> None:
        """As Controller.set_twist. In command."""

    def set_trajectory(self, q: numpy.typing.ArrayLike, times: numpy.typing.ArrayLike, behaviour: TrajectoryBehaviour | str = 'keep_path') -> None:
        """As Controller.set_trajectory. In command."""

    def clear_goal(self) -> None:
        """As Controller.clear_goal. In command."""

    def restart(self) -> None:
        """As Controller.restart. In command."""

    def pause(self) -> None:
        """The arm comes to rest; its goal is kept. With the token."""

    def resume(self) -> None:
        """The arm goes on, after `pause` or after a run has ended. In command."""

    def stop_run(self, why: str = '') -> None:
        """The arm comes to rest, and the run ends. With the token."""

    def set_obstacles(self, obstacles: Obstacles | sidestep.obstacles.Shape | Sequence[Obstacles | sidestep.obstacles.Shape], source: str = 'scene', *, time: float | None = None, valid_for: float | None = None) -> None:
        """
        As Controller.set_obstacles. With the token; the client need not be in command.
        """

    def add_obstacle(self, obstacle: Obstacles | sidestep.obstacles.Shape, source: str = 'scene') -> None:
        """As Controller.add_obstacle. With the token."""

    def move_obstacle(self, name: str, pose: numpy.typing.ArrayLike, source: str = 'scene', *, time: float | None = None, valid_for: float | None = None) -> None:
        """As Controller.move_obstacle. With the token."""

    def remove_obstacle(self, name: str, source: str = 'scene') -> None:
        """As Controller.remove_obstacle. With the token."""

    def remove_obstacles(self, source: str = 'scene') -> None:
        """As Controller.remove_obstacles. With the token."""

    def expect_obstacles(self, source: str) -> None:
        """As Controller.expect_obstacles. With the token."""

    def update(self, camera: str, depth: numpy.typing.ArrayLike, *, time: float, unit: float | None = None, pose: numpy.typing.ArrayLike | None = None) -> None:
        """
        An image of one of the server's cameras, as Perception.update. With the token. The server works on it after it has answered;
        what it then finds wrong is among the `notices`.
        """

    def subscribe(self, rate: float) -> None:
        """How often cycles come [Hz]; inf: every cycle; 0: none."""

    def cycle(self) -> Cycle:
        """The newest Cycle. Raises RuntimeError where none has come yet."""

    def next_cycle(self, after: int = 0, timeout: float = 1.0) -> Cycle | None:
        """
        The newest Cycle once there is one after that number; None: not within timeout [s].
        """

    def state(self) -> RobotState:
        """State of the arm in the newest cycle, a RobotState."""

    def command(self) -> Command:
        """The Command of the newest cycle."""

    def wait(self, until: sidestep.loop.Arrived | Callable[[RobotState], bool], timeout: float = 60.0) -> bool:
        """
        Waits until the arm has arrived, or a function of the state is true, in a cycle that follows this client's last request. False:
        not within timeout [s]. Raises RuntimeError where the run has ended, or another client has taken the command, ConnectionError
        where the server is gone.
        """

    def explain(self) -> str:
        """One sentence: what the arm does and why, as Controller.explain."""

    def ping(self) -> float:
        """Time until the server has answered [s]."""

    def notices(self) -> list[str]:
        """What the server has told all clients since the last call, in words."""

    def close(self) -> None:
        """Ends the connection."""

    def __enter__(self) -> Self: ...

    def __exit__(self, type: Any, value: Any, traceback: Any) -> None: ...

    @property
    def in_command(self) -> bool:
        """Whether this client is the one that moves the arm."""

    @property
    def may_command(self) -> bool:
        """Whether the token was right."""

    @property
    def arm(self) -> str:
        """Name of the arm."""

    @property
    def joints(self) -> list[str]:
        """Names of the joints, in the order of all vectors (nv)."""

    @property
    def frames(self) -> list[str]:
        """Names of the frames that twists may have."""

    @property
    def cameras(self) -> list[str]:
        """Names of the cameras whose images are taken."""

    @property
    def lower(self) -> numpy.typing.NDArray[numpy.float64]:
        """(nv,) position limits [rad | m]."""

    @property
    def upper(self) -> numpy.typing.NDArray[numpy.float64]:
        """(nv,) position limits [rad | m]."""

    @property
    def period(self) -> float:
        """Of a step [s]."""

    def __repr__(self) -> str: ...

class ClientInfo:
    """A client of a Server."""

    @property
    def number(self) -> int: ...

    @property
    def name(self) -> str: ...

    @property
    def may_command(self) -> bool:
        """It has shown the token."""

    @property
    def in_command(self) -> bool:
        """It is the one that moves the arm."""

    @property
    def rate(self) -> float:
        """Of the cycles that it is sent [Hz]."""

    @property
    def left_out(self) -> int:
        """Cycles that it was not sent because it reads too slowly."""

    def __repr__(self) -> str: ...

class Server(CycleObserver):
    """
    Lets other programs of this machine move the arm of a controller: an observer for `sidestep.run`. It listens at a name ('arm'), a
    Unix domain socket ('unix:/PATH') or a port of the loopback ('tcp:5555'; 0: one that is free), until it is forgotten. Clients that
    move the arm show the token in `token_file`, which only this user can read. Raises ValueError on an address that is none, OSError
    where it is taken.
    """

    def __init__(self, controller: Controller, address: str = 'arm', *, token_file: str | os.PathLike[str] | None = None, perception: Perception | None = None, most_clients: int = 16) -> None: ...

    @property
    def address(self) -> str:
        """Where it listens."""

    @property
    def token_file(self) -> pathlib.Path: ...

    @property
    def clients(self) -> list[ClientInfo]: ...

    def run_began(self) -> None:
        """Tells clients that a run has begun."""

    def run_ended(self, why: str) -> None:
        """Tells clients that it has ended."""

    def take_stop(self) -> str | None:
        """
        Why a client has asked to stop the run since the last call; None: none has.
        """

    def take_resume(self) -> bool:
        """Whether the client in command has asked to resume since the last call."""

    def __repr__(self) -> str: ...

def link_address(address: str) -> str:
    """
    An address of a server in full: 'unix:/PATH' or 'tcp:127.0.0.1:PORT'. Raises ValueError that says what is allowed.
    """

def link_token(address: str) -> str:
    """
    The token that a server at this address has left for this user. Raises OSError where there is none.
    """

def link_messages() -> list[dict[str, Any]]:
    """All messages of the protocol, with their fields."""

link_version: int = 1

link_magic: int = 1414743123

class StreamLimiter:
    """
    The command nearest to the wanted one that a robot accepts which judges each command of a stream by the commands before
    it: p+ = p + T (v + T a+) with a+ within jerk and acceleration of what the robot says it goes on from, and v+ within the
    velocity limits. limits: JointLimits; end_deceleration, end_offset (nv,): D, o of velocity limits that fall to
    sqrt(2 D (q_max - q)) - o towards the ends of the joints; margin: share of every limit that stays unused; period [s].
    Raises ValueError on wrong shapes and limits that are not positive.
    """

    def __init__(self, limits: JointLimits, period: float, *, end_deceleration: numpy.typing.ArrayLike | None = None, end_offset: numpy.typing.ArrayLike | None = None, margin: float = 0.05) -> None: ...

    def begin(self, position: numpy.typing.ArrayLike, torque: numpy.typing.ArrayLike) -> None:
        """
        A stream begins: the robot rests at `position` and holds `torque` (nv,).
        """

    def limit_positions(self, told: Sequence[numpy.typing.ArrayLike], wanted: Sequence[numpy.typing.ArrayLike]) -> numpy.typing.NDArray[numpy.float64]:
        """
        The positions (nv,) to send. told, wanted: position, velocity, acceleration (nv,) that the robot goes on from (NaN: what was
        sent), and that are wanted at the end of the period.
        """

    def limit_velocities(self, told: Sequence[numpy.typing.ArrayLike], wanted: Sequence[numpy.typing.ArrayLike]) -> numpy.typing.NDArray[numpy.float64]:
        """The same of velocities."""

    def limit_torques(self, told: numpy.typing.ArrayLike, wanted: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
        """The torques (nv,) to send; told: what the robot holds."""

    @property
    def change(self) -> float:
        """
        Largest difference of a joint between the last command and the wanted one.
        """

class RobotRequest:
    """What a driver says to a robot."""

    @property
    def kind(self) -> str:
        """
        "start", "command", "stop", or "gone" where the connection of the driver in control has ended.
        """

    @property
    def output(self) -> str:
        """
        Of start and command: "torque", "acceleration", "velocity" or "position".
        """

    @property
    def sequence(self) -> int:
        """Number of the message."""

    @property
    def cycle(self) -> int:
        """Of the state that a command answers."""

    @property
    def values(self) -> numpy.typing.NDArray[numpy.float64]:
        """(nv,) of a command, finite."""

class RobotPort:
    """
    Robot's side of a link: a Unix domain socket or a port of this machine's loopback, where drivers and viewers connect. All are told
    what the robot is and how it is; one of them controls it. Who breaks the protocol is told why and cut off. Messages:
    cpp/include/sidestep/link/robot_messages.hpp.
    """

    def __init__(self, address: str, *, name: str, joints: Sequence[str], limits: JointLimits, outputs: Sequence[str], period: float, real_time: bool = True, when_silent: str = 'not told') -> None:
        """
        address: "unix:/PATH", a name, "tcp:PORT" or "tcp:127.0.0.1:PORT". The others: see RobotDescription. Raises ValueError on an address
        or a value that is not allowed, OSError where the address is taken.
        """

    def receive(self, timeout: float) -> RobotRequest | None:
        """
        The next RobotRequest, waiting for at most `timeout` [s]; None: there was none. Ctrl-C raises.
        """

    def send_state(self, cycle: int, time: float, *, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, torque: numpy.typing.ArrayLike | None = None, mode: int = 1, taken: int = 0, taken_cycle: int = 0, lost_cycles: int = 0, told_position: numpy.typing.ArrayLike | None = None, told_velocity: numpy.typing.ArrayLike | None = None, told_acceleration: numpy.typing.ArrayLike | None = None) -> None:
        """
        Tells everybody how the robot is: vectors (nv,); mode: 0 nobody moves it yet, 1 a driver does, 2 nobody any more, 3 it has
        stopped itself; taken: number of the newest command that moves it, 0: none, since taken_cycle; lost_cycles: so far without a command.
        """

    def send_objects(self, names: Sequence[str], poses: numpy.typing.ArrayLike) -> None:
        """
        Tells viewers where objects are: poses (N, 7), position [m] and quaternion (w, x, y, z) in the world.
        """

    def stop(self, words: str) -> None:
        """
        Tells the driver in control that the robot has stopped itself, and why.
        """

    @property
    def address(self) -> str:
        """As text, with the port that was free."""

    @property
    def num_connections(self) -> int:
        """Drivers and viewers that are connected."""

    @property
    def is_controlled(self) -> bool:
        """Whether one of them controls the robot."""

    @property
    def refusals(self) -> list[str]:
        """Why connections were cut off, the last ones first; at most 16."""

class SimulatorDriver(NativeDriver):
    """
    Drives a robot that speaks the messages of a RobotPort, as the simulator of `sidestep simulate` does, without Python in the loop.
    """

    def __init__(self, address: str, *, timeout: float = 5.0) -> None:
        """
        address: as that of a RobotPort; timeout: for the robot's first message [s]. Raises OSError where nobody listens, RuntimeError
        where no robot answers.
        """

    def stop(self) -> None:
        """
        Ends control: the robot comes to rest and holds. Not while a run goes on.
        """

    def close(self) -> None:
        """Ends the connection. Not while a run goes on."""

    @property
    def delay(self) -> float:
        """
        From a state to the cycle in which its command moves the robot [s]; with torque or acceleration output, states that are read
        are moved on by so much.
        """

class CollisionDensity(Embedding):
    """
    The thesis's embedding: the body's Gaussian mixture at the obstacle points (Bosc 2024, T3.1-T3.7),
        psi(q) = sum_points sum_links sum_k pi_k N(x | o_l + R_l mu_k, R_l Sigma_k R_l^T + r^2 I)  [1/m^3].
    `average` divides by the number of points. Links that no joint moves are left out.
    """

    def __init__(self, robot: Robot, body: Body, *, average: bool = False) -> None: ...

    operations_per_pair: Final[int] = ...
    """
    Multiplications and additions for a Gaussian and a point at rest without radius.
    """

class JointLimitPotential(Embedding):
    """
    Smooth steps at the joint limits (Bosc 2024, T5.7, corrected to a sum over the joints),
        zeta(q) = height sum_j [s(slope (q_j - upper_j)) + s(slope (lower_j - q_j))],  s(u) = 1/(1 + exp(-u)).
    slope [1/rad]; height in the unit of the coordinate it is added to.
    """

    def __init__(self, robot: Robot, *, slope: float = 30.0, height: float = 1.0) -> None: ...

class Sum(Embedding):
    """
    Embeddings added into the same coordinates, psi = sum_i psi_i (the thesis's T5.8).
    """

    def __init__(self, terms: Sequence[Embedding]) -> None: ...

class Integrator(enum.Enum):
    """How a step of length dt is taken."""

    semi_implicit_euler = 0
    """v += a dt; q += v dt."""

    second_order = 1
    """q += v dt + a dt^2/2; v += a dt (thesis 6.2.1)."""

    runge_kutta_4 = 2
    """The classical scheme, with the obstacles moved along."""

class Rollout:
    """A kinematic motion: row k is at time k dt, steps + 1 rows."""

    @property
    def time(self) -> numpy.typing.NDArray[numpy.float64]:
        """[s]"""

    @property
    def statuses(self) -> list[StepStatus]:
        """One StepStatus per row."""

    @property
    def step_seconds(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (steps + 1,) wall time [s] of the acceleration of each row; empty without time_steps.
        """

    @property
    def q(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps + 1, nv) [rad]"""

    @property
    def v(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps + 1, nv) [rad/s]"""

    @property
    def acceleration(self) -> numpy.typing.NDArray[numpy.float64]:
        """(steps + 1, nv) [rad/s^2]"""

    @property
    def values(self) -> numpy.typing.NDArray[numpy.float64]:
        """psi (steps + 1, m)"""

    @property
    def switch(self) -> numpy.typing.NDArray[numpy.float64]:
        """Weights of the harmonic part (steps + 1, nv)"""

def rollout(system: GeometricSystem, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, goal: numpy.typing.ArrayLike | JointGoal | PoseGoal, obstacles: Obstacles, *, period: float = 0.001, steps: int, integrator: Integrator | str = 'semi_implicit_euler', time_steps: bool = False) -> Rollout:
    """
    Integrates the system alone from q, v (nv,) towards a goal, obstacles and goal moving at their velocities; nothing holds
    limits or clearances: what has to keep them is a Controller, see `integrate`.
    period dt [s]; steps: the record may have 8 GiB; integrator: an Integrator or its name; time_steps: measure every step, see step_seconds.
    """

def rollout_batch(system: GeometricSystem, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, goals: numpy.typing.ArrayLike, obstacles: Obstacles, *, period: float = 0.001, steps: int, integrator: Integrator | str = 'semi_implicit_euler', threads: int = 0) -> list[Rollout]:
    """
    The motions from N states q, v (N, nv) towards goals (N, nv) as `rollout` gives them, on several threads
    (0: one per processor). Raises ValueError on wrong shapes.
    """

__version__: str
