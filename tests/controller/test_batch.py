"""Many motions at once are the same as one after the other."""

import numpy as np
import pytest

import sidestep as ss

STARTS = np.array([[0.1, 0.2, 0.3], [-1.0, 0.5, 0.0], [1.2, -0.4, 0.8], [0.0, 0.0, 0.0], [2.0, 0.3, -0.5]])
GOALS = np.array([[1.2, -0.4, 0.8], [0.6, 0.2, 0.4], [-0.8, 0.5, 0.2], [1.0, 0.4, 0.0], [0.1, 0.2, 0.3]])
REST = np.zeros_like(STARTS)


@pytest.fixture(scope="module")
def arm() -> ss.Arm:
    return ss.Arm.from_robot(ss.Robot.named("planar3"))


def controllers(arm: ss.Arm) -> list[ss.Controller]:
    """Each with a goal and obstacles of its own: one has a ball that comes, one none."""
    made = []
    for k, goal in enumerate(GOALS):
        controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True, seed=k))
        controller.set_goal(goal)
        if k > 0:
            controller.set_obstacles(ss.Obstacles([[1.3, 0.3 * k, 0.0]], 0.05, [[-0.1 * (k - 1), 0.0, 0.0]]))
        made.append(controller)
    return made


@pytest.mark.parametrize("threads", [0, 1, 3])
def test_motions_are_those_of_single_runs(arm: ss.Arm, threads: int) -> None:
    together = ss.integrate_batch(
        controllers(arm), STARTS, REST, steps=800, goals=GOALS, tolerance=0.8, threads=threads
    )
    assert len(together) == 5
    for k, controller in enumerate(controllers(arm)):
        alone = ss.integrate(controller, STARTS[k], REST[k], steps=800, goal=GOALS[k], tolerance=0.8)
        for name in ("q", "v", "acceleration", "clearance", "last_q", "last_v"):
            np.testing.assert_array_equal(getattr(together[k], name), getattr(alone, name))
        assert together[k].statuses == alone.statuses
        assert together[k].activities == alone.activities
        assert together[k].arrived == alone.arrived
    assert len({len(motion.q) for motion in together}) > 1  # some arrive before


def test_a_controller_goes_on_afterwards(arm: ss.Arm) -> None:
    (controller,) = controllers(arm)[:1]
    whole = ss.integrate(controllers(arm)[0], STARTS[0], REST[0], steps=100)
    q, v = STARTS[:1], REST[:1]
    for part in range(2):
        (motion,) = ss.integrate_batch([controller], q, v, steps=50)
        np.testing.assert_array_equal(motion.q, whole.q[50 * part : 50 * (part + 1)])
        q, v = motion.last_q[None], motion.last_v[None]


def test_no_controllers_give_no_motions() -> None:
    assert ss.integrate_batch([], np.zeros((0, 3)), np.zeros((0, 3)), steps=1) == []


def test_bad_arguments_are_named(arm: ss.Arm) -> None:
    five = controllers(arm)
    with pytest.raises(ValueError, match="q has 3 rows, needed is one for each of the 5 controllers"):
        ss.integrate_batch(five, STARTS[:3], REST, steps=1)
    with pytest.raises(ValueError, match="goals has 1 rows, needed is one for each of the 5 controllers"):
        ss.integrate_batch(five, STARTS, REST, steps=1, goals=GOALS[:1])
    with pytest.raises(ValueError, match=r"v must have shape \(N, 3\)"):
        ss.integrate_batch(five, STARTS, REST[:, :2], steps=1)
    with pytest.raises(ValueError, match="a controller is there twice"):
        ss.integrate_batch([five[0], five[0]], STARTS[:2], REST[:2], steps=1)
    with pytest.raises(ValueError, match="steps is 0, allowed: 1 to"):
        ss.integrate_batch(five, STARTS, REST, steps=0)
    with pytest.raises(ValueError, match=r"steps is 2147483647, must be at most \d+ for 5 motions"):
        ss.integrate_batch(five, STARTS, REST, steps=2**31 - 1)
    for threads in (-1, 1025):
        with pytest.raises(ValueError, match=f"threads is {threads}, must be from 0 to 1024"):
            ss.integrate_batch(five, STARTS, REST, steps=1, threads=threads)
    threaded = ss.Controller(arm)
    threaded.set_obstacles(ss.Obstacles.none())
    with pytest.raises(
        ValueError, match=r"the controller must be synchronous.*ControllerSettings\(synchronous=True\)"
    ):
        ss.integrate_batch([threaded], STARTS[:1], REST[:1], steps=1)
    with pytest.raises(ValueError, match="finite"):
        ss.integrate_batch(five, STARTS * np.nan, REST, steps=1)
    assert len(ss.integrate_batch(five, STARTS, REST, steps=1)) == 5  # none is held by what failed
