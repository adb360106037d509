"""The motion program on the models of real arms. The C++ tests cover every path and status."""

import numpy as np
import pytest

import sidestep as ss
from sidestep._core import ProgramStatus
from sidestep.control import AccelerationFilter, Limit, MotionProgram, TorqueController

ROBOTS = ["fr3", "panda", "ur5", "planar2"]


@pytest.fixture(scope="module", params=ROBOTS)
def robot(request):
    return ss.Robot.named(request.param)


def test_holds_the_arm_against_gravity(robot):
    controller = MotionProgram(robot)
    rng = np.random.default_rng(0)
    zero = np.zeros(robot.num_coordinates)
    for _ in range(20):
        q = robot.random_configuration(rng)
        bias = robot.bias(q, zero)
        if np.any(np.abs(bias) > 0.9 * robot.limits.effort):
            continue
        solution = controller.solve(q, zero, zero, robot.mass_matrix(q), bias)
        assert solution.status == ProgramStatus.ok
        # M R torque / Q: below 1e-6 of (5 kg m^2 * 100 Nm)/(100 Nm)^2, and the torque differs by M of that.
        assert np.max(np.abs(solution.acceleration)) < 1e-6
        np.testing.assert_allclose(solution.torque, bias, atol=1e-5)


def test_wild_demands_never_break_a_limit(robot):
    limits = robot.limits
    controller = MotionProgram(robot)
    rng = np.random.default_rng(1)
    q, v = robot.neutral.copy(), np.zeros(robot.num_coordinates)
    for k in range(2000):
        if k % 200 == 0:
            demand = rng.normal(size=robot.num_coordinates) * 30.0
        mass, bias = robot.mass_matrix(q), robot.bias(q, v)
        solution = controller.solve(q, v, demand, mass, bias)
        assert not solution.status.is_fallback
        assert np.all(np.abs(solution.torque) <= limits.effort)
        acceleration = np.linalg.solve(mass, solution.torque - bias)
        # Rounding of 100 Nm over the smallest inertia, 1e-3 kg m^2, times the conditioning of M, 1e3.
        np.testing.assert_allclose(acceleration, solution.acceleration, atol=1e-7)
        v = v + 0.001 * acceleration
        q = q + 0.001 * v
        if solution.status != ProgramStatus.relaxed:
            assert np.all(np.abs(v) <= limits.velocity + 1e-9)  # the error above, over one period
        if controller.count(ProgramStatus.relaxed) == 0:
            assert np.all((q <= limits.upper + 1e-9) & (q >= limits.lower - 1e-9))
    assert controller.count(ProgramStatus.limited) > 0


def test_limits_in_the_way_are_named():
    robot = ss.Robot.named("planar2")
    q, v = robot.neutral, np.zeros(2)
    mass, bias = robot.mass_matrix(q), robot.bias(q, v)
    # Carrying joint 2 along while joint 1 accelerates takes all its torque; for more, all its deceleration.
    for demand, expected in [
        (20.0, Limit.torque_upper),
        (1e6, Limit.torque_upper | Limit.acceleration_lower),
    ]:
        solution = MotionProgram(robot).solve(q, v, [demand, 0.0], mass, bias)
        assert solution.status == ProgramStatus.limited
        assert str(solution.status) == "limited"
        assert solution.active == (Limit(0), expected)
        assert solution.torque[1] == robot.limits.effort[1]
        if expected & Limit.acceleration_lower:
            assert solution.acceleration[1] == -robot.limits.acceleration[1]


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("argument", ["position", "velocity", "acceleration", "mass_matrix", "bias"])
def test_values_that_are_not_finite_give_a_damped_stop(argument, bad):
    robot = ss.Robot.named("fr3")
    controller = MotionProgram(robot)
    v = np.full(robot.num_coordinates, 0.1)
    inputs = {
        "position": robot.neutral.copy(),
        "velocity": v.copy(),
        "acceleration": np.zeros(robot.num_coordinates),
        "mass_matrix": robot.mass_matrix(robot.neutral),
        "bias": robot.bias(robot.neutral, v),
    }
    assert controller.solve(*inputs.values()).status == ProgramStatus.ok
    known_bias = inputs["bias"].copy()
    inputs[argument].flat[0] = bad
    solution = controller.solve(*inputs.values())
    assert solution.status == ProgramStatus.fallback_invalid_input
    assert solution.status.is_fallback
    assert str(solution.fault) == argument
    assert controller.count(ProgramStatus.fallback_invalid_input) == 1
    assert np.all(np.abs(solution.torque) <= robot.limits.effort)
    if argument == "velocity":  # nothing to damp: hold against gravity
        np.testing.assert_array_equal(solution.torque, known_bias)
    elif argument == "mass_matrix":
        assert np.all(solution.torque < known_bias)
        assert np.all(np.isnan(solution.acceleration))
    else:  # the mass matrix is known: -v/stop_time
        braking = known_bias + inputs["mass_matrix"] @ np.full(robot.num_coordinates, -1.0)
        # The quadratic program trades 1e-8 /s^2 of it for torque where it is used.
        np.testing.assert_allclose(solution.torque, braking, atol=1e-6)


def test_bad_settings_and_shapes_raise():
    robot = ss.Robot.named("planar2")
    with pytest.raises(ValueError, match="period is 0"):
        MotionProgram(robot, period=0.0)
    with pytest.raises(ValueError, match="tracking_weight"):
        MotionProgram(robot, tracking_weight=-1.0)
    with pytest.raises(ValueError, match="position_margin is 100"):
        MotionProgram(robot, position_margin=100.0)
    with pytest.raises(ValueError, match=r"mass_matrix has shape \(3, 3\), expected \(2, 2\)"):
        MotionProgram(robot).solve([0, 0], [0, 0], [0, 0], np.eye(3), [0, 0])


def test_the_names_of_0_2_give_the_same():
    robot = ss.Robot.named("planar2")
    bias, mass = np.zeros(2), np.eye(2)
    program = MotionProgram(robot, by_torque=False, period=0.002)
    old = AccelerationFilter(robot, period=0.002)
    assert (old.period, old.num_coordinates) == (0.002, 2)
    for wanted in ([1.0, -2.0], [1e3, 0.0]):
        given = old.apply([0, 0], [0, 0], wanted)
        np.testing.assert_array_equal(given.acceleration, program.solve([0, 0], [0, 0], wanted).acceleration)
        solved = TorqueController(robot).solve([0, 0], [0, 0], wanted, mass, bias)
        np.testing.assert_array_equal(
            solved.torque, MotionProgram(robot).solve([0, 0], [0, 0], wanted, mass, bias).torque
        )


def test_an_arm_moved_by_torque_needs_its_dynamics():
    robot = ss.Robot.named("planar2")
    with pytest.raises(ValueError, match="mass_matrix and bias must be given"):
        MotionProgram(robot).solve([0, 0], [0, 0], [0, 0])
