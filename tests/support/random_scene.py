"""Seeded random bodies, states and obstacles for every named robot, with the oracle's answers, made once."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sidestep as ss
from support.thesis_density import ThesisDensity

NUM_STATES = 200
ROBOTS = [
    pytest.param(entry.name, marks=() if entry.available else pytest.mark.skip(reason=entry.reason))
    for entry in ss.robots()
]


@dataclass(frozen=True)
class State:
    """A random state with random obstacles, and what automatic differentiation of the density says there."""

    q: np.ndarray
    v: np.ndarray
    obstacles: ss.Obstacles
    psi: float
    gradient: np.ndarray
    hessian: np.ndarray
    curvature: float

    def at(self, time: float) -> tuple[np.ndarray, ss.Obstacles]:
        """Configuration and obstacles after `time` [s] at constant velocities."""
        o = self.obstacles
        return self.q + time * self.v, ss.Obstacles(o.points + time * o.velocities, o.radii, o.velocities)

    def at_rest(self) -> ss.Obstacles:
        """The obstacles without their velocities."""
        return ss.Obstacles(self.obstacles.points, self.obstacles.radii)


@dataclass(frozen=True)
class Scene:
    robot: ss.Robot
    body: ss.Body
    states: tuple[State, ...]


def random_body(robot: ss.Robot, rng: np.random.Generator) -> ss.Body:
    """1 to 3 Gaussians on every link, standard deviations of 3 to 12 cm, as fitted ones have."""
    links, weights, means, covariances = [], [], [], []
    for frame in robot.frames:
        num = int(rng.integers(1, 4))
        links += [frame.name] * num
        weights += list(rng.dirichlet(np.full(num, 5.0)))
        means += list(rng.uniform(-0.1, 0.1, (num, 3)))
        for _ in range(num):
            R = Rotation.random(random_state=rng).as_matrix()
            covariances.append(R @ np.diag(rng.uniform(0.03, 0.12, 3) ** 2) @ R.T)
    symmetric = [0.5 * (c + c.T) for c in covariances]
    return ss.Body(links=links, weights=weights, means=means, covariances=symmetric)


def random_obstacles(
    robot: ss.Robot, body: ss.Body, q: np.ndarray, rng: np.random.Generator, num: int
) -> ss.Obstacles:
    """Points within two decimetres of the arm, a third of them without radius, all moving."""
    moving = [frame.name for frame in robot.frames if frame.joint >= 0]
    places = [robot.pose(q, str(rng.choice(moving)))[:3, 3] for _ in range(num)]
    radii = np.where(rng.random(num) < 1 / 3, 0.0, rng.uniform(0.0, 0.1, num))
    points = np.array(places) + rng.normal(scale=0.1, size=(num, 3))
    return ss.Obstacles(points, radii, rng.normal(scale=0.5, size=(num, 3)))


@cache
def scene(name: str) -> Scene:
    """The robot, one random body, and NUM_STATES states of 1 to 3 obstacle points each."""
    robot = ss.Robot.named(name)
    rng = np.random.default_rng(7)
    body = random_body(robot, rng)
    oracle = ThesisDensity(robot, body)
    states = []
    for _ in range(NUM_STATES):
        q = robot.random_configuration(rng)
        v = rng.normal(size=robot.num_coordinates)
        obstacles = random_obstacles(robot, body, q, rng, int(rng.integers(1, 4)))
        states.append(State(q, v, obstacles, *oracle(q, v, obstacles)))
    return Scene(robot, body, tuple(states))
