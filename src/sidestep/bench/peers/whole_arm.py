"""The whole arm among balls: a step of the controller, a filter of velocities, fabrics."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from sidestep._core import Controller, ControllerSettings, Obstacles, integrate
from sidestep.arm import Arm
from sidestep.bench.peers import jax_peers
from sidestep.bench.peers.fabrics import fabrics_way
from sidestep.bench.peers.serial_chain import SerialChain
from sidestep.bench.peers.way import MOTION, Array, PeerSettings, States, Way, optional
from sidestep.bench.problems import ProblemGenerator, ProblemSettings
from sidestep.body import Body
from sidestep.robot import Robot

ROBOT = "fr3"  # seven joints, with a hand
BALLS = 10


@dataclass(frozen=True)
class ArmAmongBalls:
    """The covering body among the balls of a problem of `bench reach`, along a motion of the controller."""

    robot: Robot
    body: Body
    controller: Controller
    obstacles: Obstacles
    start: Array
    goal: Array
    states: States

    @classmethod
    def of(cls, settings: PeerSettings) -> ArmAmongBalls:
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
        controller.set_obstacles(obstacles, valid_for=np.inf)
        run = integrate(controller, start, 0.0 * start, steps=MOTION)
        states = [(q, v, q) for q, v in zip(run.q, run.v, strict=True)]
        return cls(robot, body, controller, obstacles, start, goal, states)

    @property
    def balls(self) -> Array:
        return np.column_stack([self.obstacles.points, self.obstacles.radii])


def moving_links(robot: Robot) -> set[str]:
    return {frame.name for frame in robot.frames if frame.joint >= 0}


def whole_arm_ways(settings: PeerSettings) -> tuple[States, list[Way]]:
    """Steps of the controller; planner and look-ahead have threads of their own."""
    arm = ArmAmongBalls.of(settings)
    robot, body, goal, states, balls = arm.robot, arm.body, arm.goal, arm.states, arm.balls
    chain = SerialChain.of(robot, body)
    # Around each ellipsoid: a sphere as large as its longest semi-axis.
    moving = moving_links(robot)
    assert body.levels is not None
    levels = np.array([body.levels[k] for k, link in enumerate(body.links) if link in moving])
    radii = np.sqrt(levels * np.linalg.eigvalsh(chain.covariances)[:, -1])
    spheres = f"{len(radii)} spheres around the same ellipsoids"

    ways = [
        Way(
            "Sidestep, C++",
            f"controller, acceleration: {len(body.links)} ellipsoids, self-collision, limits, quadratic program",
            measured=lambda: _controlled(arm.controller, arm.start, settings.seconds),
        ),
        Way("Sidestep, Python", "the same, one call", lambda q, v: arm.controller.step(q, v).acceleration),
        optional(
            "CBFpy",
            f"the filter of a joint velocity: {spheres}, no self-collision, no limits, quadratic program",
            "cbfpy",
            lambda: jax_peers.barrier_filter(chain, chain.means, radii, list(chain.owners), balls),
        ),
        fabrics_way(settings, robot, chain, radii, balls, states, goal),
    ]
    return states, ways


def _controlled(controller: Controller, start: Array, seconds: float) -> Array:
    """Microseconds of steps of the whole controller in motions of it."""
    times: list[Array] = []
    end = time.perf_counter() + seconds
    while not times or time.perf_counter() < end:
        times.append(1e6 * integrate(controller, start, 0.0 * start, steps=MOTION).step_seconds)
    return np.concatenate(times)
