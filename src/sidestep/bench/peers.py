"""What other software takes for the work of one control step, on one core, in one run."""

from __future__ import annotations

import json
import platform
import subprocess
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import coal
import numpy as np
import numpy.typing as npt

import sidestep
from sidestep._core import (
    BarrierSettings,
    ClearanceBarrier,
    CollisionDensity,
    Controller,
    ControllerSettings,
    GeometricSystem,
    JointType,
    Obstacles,
    instruction_set,
    integrate,
    rollout,
)
from sidestep.arm import Arm
from sidestep.bench import peers_jax
from sidestep.bench.problems import ProblemGenerator, ProblemSettings
from sidestep.bench.step import cpu_model
from sidestep.body import Body
from sidestep.robot import Robot
from sidestep.robot.mesh import mesh_model
from sidestep.thesis.reproduce import dense_analytic, torch_autograd
from sidestep.thesis.reproduce.serial_chain import SerialChain

Array = npt.NDArray[np.float64]
Call = Callable[[Array, Array], Array]
States = list[tuple[Array, Array, Array]]  # q, v, and what to compare with

TABLE_ROBOT, ROBOT = "fr3_arm", "fr3"  # seven joints, without and with a hand
TABLE_POINT = (0.4, 0.2, 0.5)  # [m] beside the arm
STIFFNESS, DAMPING = 0.5, 1.5  # the thesis's
BALLS = 10
MOTION = 1_000  # steps; the states that every way is asked at
FEWEST = 3  # calls of a way, however long they take
WARM_UP = 10  # calls that do not count, if they take less than a tenth of the time


@dataclass(frozen=True)
class PeerSettings:
    """How long each way is measured.

    Attributes:
        seconds: for each way [s]. seed: of the balls. fabrics: an interpreter that can import `fabrics`, which needs an
            environment of its own; None leaves it out.

    Raises:
        ValueError: seconds is not positive.
    """

    seconds: float = 3.0
    seed: int = 0
    fabrics: str | None = None

    def __post_init__(self) -> None:
        if not self.seconds > 0.0:
            raise ValueError(f"seconds is {self.seconds}, must be positive")


@dataclass(frozen=True)
class _Way:
    """One way of doing the work: what is called at a state, or microseconds that it measures itself, or why neither."""

    name: str
    work: str
    call: Call | None = None
    measured: Callable[[], Array] | None = None
    missing: str = ""
    check: bool = False  # whether the result is that of the first way


def run_peers(settings: PeerSettings, *, progress: Callable[[str], None] | None = None) -> dict[str, Any]:
    """Times every way and returns a document for JSON; ratios are to the first way of a group, in C++.

    Raises:
        RuntimeError: a way that should give the accelerations of the first one does not.
    """
    groups = []
    for name, make in (
        ("Table 6.1, 7 joints", _table),
        (f"whole arm, {BALLS} balls", _whole_arm),
        (f"distances of the arm, {BALLS} balls", _distances),
    ):
        states, ways = make(settings)
        rows = []
        for way in ways:
            if progress is not None:
                progress(f"{name}: {way.name}")
            rows.append({"name": way.name, "work": way.work, **_measure(way, states, settings.seconds)})
        for row in rows:
            if "median_us" in row:
                row["times_slower"] = row["median_us"] / rows[0]["median_us"]
        groups.append({"name": name, "rows": rows})
    return {
        "benchmark": "peers",
        "version": sidestep.__version__,
        "cpu": cpu_model(),
        "instruction_set": instruction_set(),
        "python": platform.python_version(),
        "seconds": settings.seconds,
        "groups": groups,
    }


def _measure(way: _Way, states: States, seconds: float) -> dict[str, Any]:
    if way.missing:
        return {"missing": way.missing}
    times = way.measured() if way.measured is not None else _times(way, states, seconds)
    quantiles = np.quantile(times, (0.5, 0.99))
    return {"calls": len(times), "median_us": float(quantiles[0]), "p99_us": float(quantiles[1])}


def _times(way: _Way, states: States, seconds: float) -> Array:
    """Microseconds of calls at the states, which hold q, v and the acceleration to compare with."""
    assert way.call is not None
    begin = time.perf_counter()
    for q, v, expected in states[:WARM_UP]:
        found = way.call(q, v)
        if way.check and not np.allclose(found, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max()):
            raise RuntimeError(f"{way.name}: the acceleration is {found}, not {expected}")
        if time.perf_counter() - begin > 0.1 * seconds:
            break
    times: list[float] = []
    end = time.perf_counter() + seconds
    while len(times) < FEWEST or time.perf_counter() < end:
        q, v, _ = states[len(times) % len(states)]
        start = time.perf_counter_ns()
        way.call(q, v)
        times.append(1e-3 * (time.perf_counter_ns() - start))
    return np.array(times)


def _in_cpp(
    system: GeometricSystem,
    start: Array,
    goal: Array,
    obstacles: Obstacles,
    seconds: float,
) -> Array:
    """Microseconds of steps of the system in motions of it."""
    times: list[Array] = []
    end = time.perf_counter() + seconds
    while not times or time.perf_counter() < end:
        run = rollout(system, start, 0.0 * start, goal, obstacles, steps=MOTION, time_steps=True)
        times.append(1e6 * run.step_seconds)
    return np.concatenate(times)


def _controlled(controller: Controller, start: Array, seconds: float) -> Array:
    """The same of steps of the whole controller, in C++."""
    times: list[Array] = []
    end = time.perf_counter() + seconds
    while not times or time.perf_counter() < end:
        times.append(1e6 * integrate(controller, start, 0.0 * start, steps=MOTION).step_seconds)
    return np.concatenate(times)


def _table(settings: PeerSettings) -> tuple[States, list[_Way]]:
    """T5.4 with one Gaussian per link and one point: the setting of the thesis's Table 6.1."""
    robot = Robot.named(TABLE_ROBOT)
    body = Body.fit(robot, components=1, seed=settings.seed)
    chain, point = SerialChain.of(robot, body), np.array(TABLE_POINT)
    obstacles, start, goal = Obstacles(point[None]), robot.neutral, robot.neutral + 0.1
    system = GeometricSystem([CollisionDensity(robot, body)], stiffness=STIFFNESS, damping=DAMPING)
    run = rollout(system, start, 0.0 * start, goal, obstacles, steps=MOTION)
    states = [
        (q, v, system.acceleration(q, v, goal, obstacles).acceleration)
        for q, v in zip(run.q, run.v, strict=True)
    ]
    gains = {"stiffness": STIFFNESS, "damping": DAMPING}
    work = "the acceleration of T5.4"

    def automatic() -> Call:
        peer = torch_autograd.AutogradSystem(chain, point)
        return lambda q, v: peer.acceleration(q, v, goal, **gains)

    ways = [
        _Way(
            "Sidestep, C++",
            f"{work}, around each step of a motion",
            measured=lambda: _in_cpp(system, start, goal, obstacles, settings.seconds),
        ),
        _Way(
            "Sidestep, Python",
            f"{work}, one call",
            lambda q, v: system.acceleration(q, v, goal, obstacles).acceleration,
            check=True,
        ),
        _Way(
            "NumPy, dense analytic",
            f"{work} with dense tensors and Christoffel symbols, as chapter 4 of the thesis",
            lambda q, v: dense_analytic.acceleration(chain, q, v, goal, point, **gains),
            check=True,
        ),
        _optional(
            "torch.autograd",
            f"{work} with the metric's derivative by autograd, as the thesis",
            "torch",
            automatic,
            check=True,
        ),
        _optional(
            "JAX, jitted",
            f"{work} in closed form, psi's derivatives by JAX, compiled",
            "jax",
            lambda: peers_jax.geodesic_system(chain, point, goal, **gains),
            check=True,
        ),
    ]
    return states, ways


def _optional(name: str, work: str, module: str, make: Callable[[], Call], *, check: bool = False) -> _Way:
    if not peers_jax.available(module):
        return _Way(name, work, missing=f"{module} is not installed")
    return _Way(name, work, make(), check=check)


@dataclass(frozen=True)
class _Arm:
    """The covering body among the balls of a problem of `bench reach`, along a motion of the controller."""

    robot: Robot
    body: Body
    controller: Controller
    obstacles: Obstacles
    start: Array
    goal: Array
    states: States

    @classmethod
    def of(cls, settings: PeerSettings) -> _Arm:
        robot = Robot.named(ROBOT)
        body = Body.cover(robot)
        problem = ProblemGenerator(
            ProblemSettings(robot=ROBOT, obstacles=BALLS, seed=settings.seed), robot=robot
        ).problem(0)
        obstacles, start, goal = problem.obstacles_at(0.0), problem.start, problem.goal
        controller = Controller(
            Arm.from_robot(robot, body),
            ControllerSettings(planner=None, look_ahead=None, synchronous=True, output="acceleration"),
        )
        controller.set_goal(goal)
        controller.set_obstacles(obstacles)
        run = integrate(controller, start, 0.0 * start, steps=MOTION)
        states = [(q, v, q) for q, v in zip(run.q, run.v, strict=True)]
        return cls(robot, body, controller, obstacles, start, goal, states)

    @property
    def balls(self) -> Array:
        return np.column_stack([self.obstacles.points, self.obstacles.radii])


def _whole_arm(settings: PeerSettings) -> tuple[States, list[_Way]]:
    """Steps of the controller; planner and look-ahead have threads of their own."""
    arm = _Arm.of(settings)
    robot, body, goal, states, balls = arm.robot, arm.body, arm.goal, arm.states, arm.balls
    chain = SerialChain.of(robot, body)
    # Around each ellipsoid: a sphere as large as its longest semi-axis.
    moving = _moving(robot)
    assert body.levels is not None
    levels = np.array([body.levels[k] for k, link in enumerate(body.links) if link in moving])
    radii = np.sqrt(levels * np.linalg.eigvalsh(chain.covariances)[:, -1])
    spheres = f"{len(radii)} spheres around the same ellipsoids"

    ways = [
        _Way(
            "Sidestep, C++",
            f"controller, acceleration: {len(body.links)} ellipsoids, self-collision, limits, quadratic program",
            measured=lambda: _controlled(arm.controller, arm.start, settings.seconds),
        ),
        _Way("Sidestep, Python", "the same, one call", lambda q, v: arm.controller.step(q, v).acceleration),
        _optional(
            "CBFpy",
            f"the filter of a joint velocity: {spheres}, no self-collision, no limits, quadratic program",
            "cbfpy",
            lambda: peers_jax.barrier_filter(chain, chain.means, radii, list(chain.owners), balls),
        ),
        _fabrics(settings, robot, chain, radii, balls, states, goal),
    ]
    return states, ways


def _moving(robot: Robot) -> set[str]:
    return {frame.name for frame in robot.frames if frame.joint >= 0}


def _distances(settings: PeerSettings) -> tuple[States, list[_Way]]:
    """How far the arm is from the balls, at the states of `_whole_arm`."""
    arm = _Arm.of(settings)
    activation = BarrierSettings().activation
    clearances = GeometricSystem([ClearanceBarrier(arm.robot, arm.body, activation=activation)])
    moving = sum(link in _moving(arm.robot) for link in arm.body.links)
    ways = [
        _Way(
            "Sidestep, C++",
            f"clearances of {moving} ellipsoids with derivatives, where below {100.0 * activation:.0f} cm or soon so, "
            "kinematics and the acceleration, around each step of a motion",
            measured=lambda: _in_cpp(clearances, arm.start, arm.goal, arm.obstacles, settings.seconds),
        ),
        _Way(
            "Coal",
            "the smallest distance of all moving links' meshes, by two trees of boxes, poses given; no derivatives",
            measured=lambda: _coal(arm.robot, arm.balls, arm.states, settings.seconds),
        ),
    ]
    return arm.states, ways


def _coal(robot: Robot, balls: Array, states: States, seconds: float) -> Array:
    """Microseconds of one distance between arm and balls; what sets the poses from Python does not count."""
    meshes = {name: robot.collision_mesh(name) for name in sorted(_moving(robot))}
    links = {
        name: coal.CollisionObject(mesh_model(mesh)) for name, mesh in meshes.items() if mesh is not None
    }
    arm, scene = coal.DynamicAABBTreeCollisionManager(), coal.DynamicAABBTreeCollisionManager()
    kept = [
        coal.CollisionObject(coal.Sphere(ball[3]), coal.Transform3s(np.eye(3), ball[:3])) for ball in balls
    ]
    for item in kept:  # the managers do not hold them
        scene.registerObject(item)
    for item in links.values():
        arm.registerObject(item)
    scene.setup()
    arm.setup()
    callback = coal.DistanceCallBackDefault()
    times: list[float] = []
    end = time.perf_counter() + seconds
    while len(times) < FEWEST or time.perf_counter() < end:
        q, _, _ = states[len(times) % len(states)]
        for name, item in links.items():
            pose = robot.pose(q, name)
            item.setTransform(coal.Transform3s(pose[:3, :3], pose[:3, 3]))
            item.computeAABB()
        start = time.perf_counter_ns()
        arm.update()
        callback.init()
        arm.distance(scene, callback)
        times.append(1e-3 * (time.perf_counter_ns() - start))
    return np.array(times)


def _fabrics(
    settings: PeerSettings,
    robot: Robot,
    chain: SerialChain,
    radii: Array,
    balls: Array,
    states: States,
    goal: Array,
) -> _Way:
    name, work = (
        "fabrics",
        f"one action: a sphere per link, the {BALLS} balls, limits, to a position; no self-collision",
    )
    if settings.fabrics is None:
        return _Way(name, work, missing="needs an environment of its own: --fabrics PYTHON")
    of_link = [radii[np.array(chain.owners) == j].max(initial=0.05) for j in range(chain.num_joints)]
    scene = {
        "urdf": _plain_urdf(robot),
        "root": "link0",
        "links": [f"link{j + 1}" for j in range(chain.num_joints)],
        "radii": {f"link{j + 1}": float(radius) for j, radius in enumerate(of_link)},
        "moved": [f"link{j + 1}" for j in range(chain.num_joints) if _origin_moves(robot, j)],
        "balls": balls.tolist(),
        "limits": [robot.limits.lower.tolist(), robot.limits.upper.tolist()],
        "q": [q.tolist() for q, _, _ in states],
        "v": [v.tolist() for _, v, _ in states],
        "goal": goal.tolist(),
        "goal_position": robot.pose(goal, robot.links[-1].name)[:3, 3].tolist(),
        "seconds": settings.seconds,
    }

    def measured() -> Array:
        script = Path(__file__).with_name("peer_fabrics.py")
        done = subprocess.run(
            [str(settings.fabrics), str(script)], input=json.dumps(scene), capture_output=True, text=True
        )
        if done.returncode != 0:
            last = (done.stderr.strip().splitlines() or ["no message"])[-1]
            raise RuntimeError(f"fabrics, by {settings.fabrics}: {last}")
        return np.array(json.loads(done.stdout.splitlines()[-1]))

    return _Way(name, work, measured=measured)


def _origin_moves(robot: Robot, joint: int) -> bool:
    """Whether any joint moves the origin of the frame of another one."""
    frame = next(frame for frame in robot.frames if frame.joint == joint)
    poses = [
        robot.pose(q, frame.name) @ np.linalg.inv(frame.placement)
        for q in (robot.neutral, robot.neutral + 0.3)
    ]
    return bool(np.abs(poses[0][:3, 3] - poses[1][:3, 3]).max() > 1e-9)


def _plain_urdf(robot: Robot) -> str:
    """Joints alone, for readers that know no more."""
    from scipy.spatial.transform import Rotation

    def numbers(values: Array) -> str:
        return " ".join(f"{x:.17g}" for x in values)

    def joints() -> Iterator[str]:
        limits = robot.limits
        for j, joint in enumerate(robot.joints):
            if joint.type != JointType.revolute:
                raise ValueError(f"joint {joint.name!r} of robot {robot.name!r} is not revolute")
            rpy = Rotation.from_matrix(joint.placement[:3, :3]).as_euler("xyz")
            yield (
                f'<joint name="joint{j + 1}" type="revolute"><parent link="link{j}"/><child link="link{j + 1}"/>'
                f'<origin rpy="{numbers(rpy)}" xyz="{numbers(joint.placement[:3, 3])}"/>'
                f'<axis xyz="{numbers(joint.axis)}"/><limit lower="{limits.lower[j]}" upper="{limits.upper[j]}" '
                f'effort="{limits.effort[j]}" velocity="{limits.velocity[j]}"/></joint>'
            )

    links = "".join(f'<link name="link{j}"/>' for j in range(len(robot.joints) + 1))
    return f'<robot name="{robot.name}">{links}{"".join(joints())}</robot>'
