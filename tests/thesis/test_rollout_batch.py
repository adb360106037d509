"""Many motions at once are the same as one after the other."""

import numpy as np
import pytest

import sidestep as ss
from sidestep import thesis
from sidestep.system import GeometricSystem


def scene() -> tuple[ss.Robot, GeometricSystem, ss.Obstacles]:
    robot = ss.Robot.named("planar3")
    links = [next(f.name for f in robot.frames if f.joint == j) for j in range(len(robot.joints))]
    body = ss.Body(
        links=links, weights=np.ones(3), means=np.zeros((3, 3)), covariances=[0.2**2 * np.eye(3)] * 3
    )
    return robot, GeometricSystem([thesis.CollisionDensity(robot, body)]), ss.Obstacles([[0.5, 0.4, 0.0]])


def states(robot: ss.Robot, num: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(7)
    draw = lambda: np.array([robot.random_configuration(rng) for _ in range(num)])  # noqa: E731
    return draw(), rng.normal(size=(num, robot.num_coordinates)), draw()


@pytest.mark.parametrize("threads", [0, 1, 3])
def test_rollouts_are_those_of_single_motions(threads: int) -> None:
    robot, system, obstacles = scene()
    q, v, goals = states(robot, 7)
    motions = thesis.rollout_batch(system, q, v, goals, obstacles, steps=50, threads=threads)
    assert len(motions) == 7
    for k, motion in enumerate(motions):
        alone = thesis.rollout(system, q[k], v[k], goals[k], obstacles, steps=50)
        np.testing.assert_array_equal(motion.q, alone.q)
        np.testing.assert_array_equal(motion.v, alone.v)
        np.testing.assert_array_equal(motion.values, alone.values)
        assert motion.statuses == alone.statuses


def test_says_which_argument_has_the_wrong_shape() -> None:
    robot, system, obstacles = scene()
    q, v, goals = states(robot, 4)
    with pytest.raises(ValueError, match=r"v must have shape \(N, 3\)"):
        thesis.rollout_batch(system, q, v[0], goals, obstacles, steps=1)
    with pytest.raises(ValueError, match="goals is 3 × 3, expected 4 × 3"):
        thesis.rollout_batch(system, q, v, goals[:3], obstacles, steps=1)
    with pytest.raises(ValueError, match="threads is -1"):
        thesis.rollout_batch(system, q, v, goals, obstacles, steps=1, threads=-1)
    with pytest.raises(ValueError, match="steps is 0"):
        thesis.rollout_batch(system, q, v, goals, obstacles, steps=0)
