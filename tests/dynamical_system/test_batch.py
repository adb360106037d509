"""Many states or motions at once are the same as one after the other."""

import numpy as np
import pytest

import sidestep as ss


def scene() -> tuple[ss.Robot, ss.GeometricSystem, ss.Obstacles]:
    robot = ss.Robot.named("planar3")
    links = [next(f.name for f in robot.frames if f.joint == j) for j in range(len(robot.joints))]
    body = ss.Body(
        links=links, weights=np.ones(3), means=np.zeros((3, 3)), covariances=[0.2**2 * np.eye(3)] * 3
    )
    return robot, ss.GeometricSystem([ss.CollisionDensity(robot, body)]), ss.Obstacles([[0.5, 0.4, 0.0]])


def states(robot: ss.Robot, num: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(7)
    draw = lambda: np.array([robot.random_configuration(rng) for _ in range(num)])  # noqa: E731
    return draw(), rng.normal(size=(num, robot.num_coordinates)), draw()


@pytest.mark.parametrize("threads", [0, 1, 3])
def test_evaluations_are_those_of_single_steps(threads: int) -> None:
    robot, system, obstacles = scene()
    q, v, goals = states(robot, 25)
    v[3] = np.nan
    batch = ss.evaluate_batch(system, q, v, goals, obstacles, threads=threads)
    for k in range(25):
        step = system.acceleration(q[k], v[k], goals[k], obstacles)
        assert batch.statuses[k] == step.status
        if k == 3:
            np.testing.assert_array_equal(batch.accelerations[k], step.acceleration)
        else:  # rounding: states are taken side by side
            np.testing.assert_allclose(batch.accelerations[k], step.acceleration, rtol=1e-12, atol=1e-12)
            np.testing.assert_allclose(batch.values[k], step.values, rtol=1e-12)
    assert np.isnan(batch.values[3]).all()
    assert batch.statuses[3] == ss.StepStatus.invalid_state


@pytest.mark.parametrize("threads", [1, 3])
def test_rollouts_are_those_of_single_motions(threads: int) -> None:
    robot, system, obstacles = scene()
    q, v, goals = states(robot, 7)
    motions = ss.rollout_batch(system, q, v, goals, obstacles, steps=50, threads=threads)
    assert len(motions) == 7
    for k, motion in enumerate(motions):
        alone = ss.rollout(system, q[k], v[k], goals[k], obstacles, steps=50)
        np.testing.assert_allclose(motion.q, alone.q, rtol=0.0, atol=1e-11)  # rounding of 50 steps
        assert motion.statuses == alone.statuses


def test_says_which_argument_has_the_wrong_shape() -> None:
    robot, system, obstacles = scene()
    q, v, goals = states(robot, 4)
    with pytest.raises(ValueError, match=r"v must have shape \(N, 3\)"):
        ss.evaluate_batch(system, q, v[0], goals, obstacles)
    with pytest.raises(ValueError, match="goals is 3 × 3, expected 4 × 3"):
        ss.evaluate_batch(system, q, v, goals[:3], obstacles)
    with pytest.raises(ValueError, match="threads is -1"):
        ss.evaluate_batch(system, q, v, goals, obstacles, threads=-1)
    with pytest.raises(ValueError, match="steps is 0"):
        ss.rollout_batch(system, q, v, goals, obstacles, steps=0)
