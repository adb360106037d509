"""The thesis's Table 6.1 again: one acceleration of its system, by several ways."""

from __future__ import annotations

import numpy as np

from sidestep._core import CollisionDensity, GeometricSystem, Obstacles, rollout
from sidestep.bench.peers import dense_analytic, jax_peers, torch_autograd
from sidestep.bench.peers.serial_chain import SerialChain
from sidestep.bench.peers.way import MOTION, Call, PeerSettings, States, Way, optional, steps_in_cpp
from sidestep.body import Body
from sidestep.robot import Robot

TABLE_ROBOT = "fr3_arm"  # seven joints, without a hand
TABLE_POINT = (0.4, 0.2, 0.5)  # [m] beside the arm
STIFFNESS, DAMPING = 0.5, 1.5  # the thesis's


def table_ways(settings: PeerSettings) -> tuple[States, list[Way]]:
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
        Way(
            "Sidestep, C++",
            f"{work}, around each step of a motion",
            measured=lambda: steps_in_cpp(system, start, goal, obstacles, settings.seconds),
        ),
        Way(
            "Sidestep, Python",
            f"{work}, one call",
            lambda q, v: system.acceleration(q, v, goal, obstacles).acceleration,
            check=True,
        ),
        Way(
            "NumPy, dense analytic",
            f"{work} with dense tensors and Christoffel symbols, as chapter 4 of the thesis",
            lambda q, v: dense_analytic.acceleration(chain, q, v, goal, point, **gains),
            check=True,
        ),
        optional(
            "torch.autograd",
            f"{work} with the metric's derivative by autograd, as the thesis",
            "torch",
            automatic,
            check=True,
        ),
        optional(
            "JAX, jitted",
            f"{work} in closed form, psi's derivatives by JAX, compiled",
            "jax",
            lambda: jax_peers.geodesic_system(chain, point, goal, **gains),
            check=True,
        ),
    ]
    return states, ways
