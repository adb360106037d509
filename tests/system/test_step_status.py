"""What a step says and does where the equations do not hold: a status, and a damped stop."""

import numpy as np
import pytest

import sidestep as ss
from sidestep import thesis
from sidestep._core import StepStatus
from sidestep.system import GeometricSystem, is_fallback
from support.random_scene import scene

RATE = 10.0  # [1/s] of the fallback


def system_of(switch: thesis.Unswitched | None = None) -> GeometricSystem:
    case = scene("fr3")
    return GeometricSystem([thesis.CollisionDensity(case.robot, case.body)], switch=switch)


def arguments() -> dict[str, np.ndarray | ss.Obstacles]:
    case = scene("fr3")
    state = case.states[0]
    return {"q": state.q, "v": state.v, "goal": case.robot.neutral, "obstacles": state.obstacles}


def stop(v: np.ndarray) -> np.ndarray:
    limit = scene("fr3").robot.limits.acceleration
    return np.clip(np.where(np.isfinite(v), -RATE * v, 0.0), -limit, limit)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", ["q", "v"])
def test_states_that_are_not_finite_stop_the_arm(name: str, bad: float) -> None:
    system, given = system_of(), arguments()
    for i in range(7):
        value = given[name].copy()
        value[i] = bad
        changed = given | {name: value}
        step = system.acceleration(**changed)
        assert step.status == StepStatus.invalid_state
        assert is_fallback(step.status)
        np.testing.assert_array_equal(step.acceleration, stop(changed["v"]))


def without_pull(given: dict[str, np.ndarray | ss.Obstacles]) -> np.ndarray:
    """What barriers and damping do when the arm is already at its goal."""
    step = system_of().acceleration(**(given | {"goal": given["q"]}))
    assert step.status == StepStatus.ok
    return step.acceleration


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_goal_that_is_not_finite_leaves_everything_but_its_pull(bad: float) -> None:
    system, given = system_of(), arguments()
    expected = without_pull(given)
    for i in range(7):
        goal = given["goal"].copy()
        goal[i] = bad
        step = system.acceleration(**(given | {"goal": goal}))
        assert step.status == StepStatus.invalid_goal
        assert not is_fallback(step.status)
        np.testing.assert_array_equal(step.acceleration, expected)


def test_a_goal_outside_the_limits_leaves_everything_but_its_pull() -> None:
    system, given = system_of(), arguments()
    expected = without_pull(given)
    limits = scene("fr3").robot.limits
    for i in range(7):
        for bound, outwards in ((limits.lower[i], -np.inf), (limits.upper[i], np.inf)):
            goal = given["goal"].copy()
            goal[i] = bound
            assert system.acceleration(**(given | {"goal": goal})).status == StepStatus.ok
            goal[i] = np.nextafter(bound, outwards)  # by rounding: as good as at the limit
            assert system.acceleration(**(given | {"goal": goal})).status == StepStatus.ok
            goal[i] = bound + np.copysign(2e-9, outwards)
            step = system.acceleration(**(given | {"goal": goal}))
            assert step.status == StepStatus.goal_outside_limits
            np.testing.assert_array_equal(step.acceleration, expected)


def test_the_stop_keeps_to_the_acceleration_limits() -> None:
    system, given = system_of(), arguments()
    given["v"] = np.array([5.0, -5.0, 0.1, -0.1, 0.0, 2.0, 0.5])
    given["q"] = np.full(7, np.nan)
    # the FR3's limit is 10 rad/s^2
    np.testing.assert_allclose(
        system.acceleration(**given).acceleration, [-10.0, 10.0, -1.0, 1.0, 0.0, -10.0, -5.0], rtol=1e-15
    )


def test_a_state_outside_the_limits_is_reported_and_computed() -> None:
    system, given = system_of(), arguments()
    inside = system.acceleration(**given)
    assert inside.status == StepStatus.ok
    given["q"] = given["q"].copy()
    given["q"][3] = scene("fr3").robot.limits.upper[3] + 0.01
    step = system.acceleration(**given)
    assert step.status == StepStatus.outside_limits
    assert not is_fallback(step.status)
    np.testing.assert_array_equal(step.acceleration, step.harmonic + step.geodesic)
    assert step.harmonic[3] < 0.0  # pulled back towards the goal


def test_overflow_stops_the_arm() -> None:
    system, given = system_of(), arguments()
    given["v"] = np.full(7, 1e200)  # finite, but its square is not
    step = system.acceleration(**given)
    assert step.status == StepStatus.not_finite
    np.testing.assert_array_equal(step.acceleration, np.full(7, -10.0))


def test_a_step_after_a_fallback_is_as_if_nothing_had_happened() -> None:
    system, given = system_of(), arguments()
    before = system.acceleration(**given)
    for bad in ({"q": np.full(7, np.nan)}, {"v": np.full(7, 1e200)}):
        assert is_fallback(system.acceleration(**(given | bad)).status)
    np.testing.assert_array_equal(system.acceleration(**given).acceleration, before.acceleration)


def test_steps_do_not_share_memory() -> None:
    system, given = system_of(), arguments()
    first = system.acceleration(**given)
    kept = first.acceleration.copy()
    system.acceleration(**(given | {"v": 2.0 * given["v"]}))
    np.testing.assert_array_equal(first.acceleration, kept)


@pytest.mark.parametrize("name", ["q", "v", "goal"])
def test_wrong_shapes_are_errors(name: str) -> None:
    system, given = system_of(), arguments()
    for wrong in (np.zeros(6), np.zeros((7, 1)), np.float64(0.0)):
        with pytest.raises(ValueError, match=rf"{name} has shape .*, expected \(7,\)"):
            system.acceleration(**(given | {name: wrong}))
    with pytest.raises(TypeError, match=f"{name} must be an array of real numbers"):
        system.acceleration(**(given | {name: ["a"] * 7}))


def test_lists_and_other_number_types_are_arrays_too() -> None:
    system, given = system_of(), arguments()
    expected = system.acceleration(**given).acceleration
    as_list = system.acceleration(**(given | {"q": given["q"].tolist(), "v": given["v"][::-1].copy()[::-1]}))
    np.testing.assert_array_equal(as_list.acceleration, expected)
