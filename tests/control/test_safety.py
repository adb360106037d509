"""Clearances in the torque program and in the filter: real arms driven hard at a sphere by a task that ignores it."""

from dataclasses import dataclass

import numpy as np
import pytest

import sidestep as ss
from sidestep import _core
from sidestep._core import ProgramStatus
from sidestep.control import Clearances, MotionProgram, SafetySettings
from sidestep.system import GeometricSystem

MARGIN = SafetySettings().margin
PERIOD = 0.001


@dataclass(frozen=True)
class Scene:
    robot: ss.Robot
    system: GeometricSystem
    start: np.ndarray
    goal: np.ndarray
    obstacles: ss.Obstacles

    def clearances_at(self, q: np.ndarray, v: np.ndarray, obstacles: ss.Obstacles) -> Clearances:
        return self.system.acceleration(q, v, self.goal, obstacles).clearances


def scene(name: str, seed: int, speed: float = 0.0) -> Scene:
    """An ellipsoid on every link, and a ball where a link passes halfway along the straight line to the goal."""
    robot = ss.Robot.named(name)
    rng = np.random.default_rng(seed)
    links = [next(f.name for f in robot.frames if f.joint == j) for j in range(len(robot.joints))]
    body = _core.Body(
        links=links,
        weights=np.ones(len(links)),
        means=np.zeros((len(links), 3)),
        covariances=[np.diag([0.060, 0.048, 0.072]) ** 2] * len(links),
        levels=np.ones(len(links)),
    )
    system = GeometricSystem([_core.ClearanceBarrier(robot, body)])
    while True:
        start, goal = robot.random_configuration(rng), robot.random_configuration(rng)
        link = links[int(rng.integers(len(links) // 2, len(links)))]
        at = robot.pose(0.5 * (start + goal), link)[:3, 3]
        velocity = rng.normal(size=3)
        velocity *= speed / np.linalg.norm(velocity)
        obstacles = ss.Obstacles([at - velocity], [0.07], [velocity])
        values = system.acceleration(start, 0.0 * start, goal, obstacles).clearances.values
        if np.min(values) > 0.05:
            return Scene(robot, system, start, goal, obstacles)


def drive(s: Scene, *, torque: bool, delay: int = 0, steps: int = 2000) -> tuple[float, dict[str, int]]:
    """The smallest clearance under a stiff spring to the goal, and how often each status occurred."""
    controller, filter_ = (
        MotionProgram(s.robot, period=PERIOD),
        MotionProgram(s.robot, period=PERIOD, by_torque=False),
    )
    q, v, obstacles = s.start, 0.0 * s.start, s.obstacles
    lowest, counts, pending = np.inf, {}, []
    for _ in range(steps):
        clearances = s.clearances_at(q, v, obstacles)
        lowest = min(lowest, float(np.min(clearances.values)))
        wanted = 100.0 * (s.goal - q) - 20.0 * v
        if torque:
            mass, bias = s.robot.mass_matrix(q), s.robot.bias(q, v)
            solution = controller.solve(q, v, wanted, mass, bias, clearances=clearances)
            pending.append(solution.torque)
            applied = pending.pop(0) if len(pending) > delay else solution.torque
            acceleration = np.linalg.solve(mass, applied - bias)
        else:
            solution = filter_.solve(q, v, wanted, clearances=clearances)
            acceleration = solution.acceleration
        counts[str(solution.status)] = counts.get(str(solution.status), 0) + 1
        v = v + PERIOD * acceleration
        q = q + PERIOD * v
        obstacles = ss.Obstacles(
            obstacles.points + PERIOD * obstacles.velocities, obstacles.radii, obstacles.velocities
        )
    return lowest, counts


# What one period leaves out of the clearance's motion, T^2 times the change of its second derivative, adds up to
# below 0.2 mm; a period of delay to a little more.
SAMPLING = 0.0002


@pytest.mark.slow
@pytest.mark.parametrize("name", ["planar3", "ur5", "fr3"])
@pytest.mark.parametrize("torque", [False, True])
def test_a_ball_in_the_way_is_not_touched(name: str, torque: bool) -> None:
    bent = 0
    for seed in range(4):
        lowest, counts = drive(scene(name, seed), torque=torque)
        assert lowest > MARGIN - SAMPLING, (seed, counts)
        bent += counts.get("limited", 0) > 0 and lowest < 0.1
        assert not any(status.startswith("fallback") for status in counts)
    assert bent > 0  # the task did want to go further


def test_one_period_of_delay_does_not_undo_it() -> None:
    for seed in range(4):
        lowest, counts = drive(scene("fr3", seed), torque=True, delay=1)
        assert lowest > MARGIN - 2.0 * SAMPLING, (seed, counts)


def test_the_arm_yields_to_a_ball_that_moves() -> None:
    for seed in range(4):
        lowest, counts = drive(scene("fr3", seed, speed=0.3), torque=False)
        assert lowest > MARGIN - SAMPLING, (seed, counts)


def test_without_the_rows_the_ball_is_hit() -> None:
    """The guard can fail: the same task without clearances."""
    s = scene("fr3", 1)
    blind = Scene(s.robot, s.system, s.start, s.goal, ss.Obstacles([[50.0, 0.0, 0.0]]))
    q, v = s.start, 0.0 * s.start
    filter_ = MotionProgram(s.robot, period=PERIOD, by_torque=False)
    lowest = np.inf
    for _ in range(2000):
        lowest = min(lowest, float(np.min(s.clearances_at(q, v, s.obstacles).values)))
        wanted = 100.0 * (s.goal - q) - 20.0 * v
        clearances = blind.clearances_at(q, v, blind.obstacles)
        v = v + PERIOD * filter_.solve(q, v, wanted, clearances=clearances).acceleration
        q = q + PERIOD * v
    assert lowest < 0.0


def test_the_program_that_was_solved_can_be_solved_elsewhere() -> None:
    """Of filter and controller: the rows in use, whose minimiser is the acceleration that they gave."""
    s = scene("fr3", 1)
    filter_, controller = MotionProgram(s.robot, by_torque=False), MotionProgram(s.robot)
    q, v, held = s.start, 0.0 * s.start, 0
    for _ in range(400):
        clearances = s.clearances_at(q, v, s.obstacles)
        wanted = 100.0 * (s.goal - q) - 20.0 * v
        mass, bias = s.robot.mass_matrix(q), s.robot.bias(q, v)
        by_torque = controller.solve(q, v, wanted, mass, bias, clearances=clearances)
        filtered = filter_.solve(q, v, wanted, clearances=clearances)
        for solution, program in ((by_torque, controller.program), (filtered, filter_.program)):
            assert np.all(np.isfinite(program.row_lower) | np.isfinite(program.row_upper))
            found = ss.control.QuadraticProgram(len(program.g), len(program.row_lower)).solve(
                program.H, program.g, lower=program.lower, upper=program.upper,
                A=program.A, row_lower=program.row_lower, row_upper=program.row_upper,
            )  # fmt: skip
            np.testing.assert_allclose(found.x, solution.acceleration, rtol=1e-9, atol=1e-9)
            assert found.seconds > 0.0
            held += found.iterations > 0
        v = v + PERIOD * filtered.acceleration
        q = q + PERIOD * v
    assert held > 50


def test_what_is_reported() -> None:
    robot = ss.Robot.named("planar2")
    clearances = Clearances(
        values=[np.inf, 0.008],
        rates=[0.0, -0.06],
        curvatures=[0.0, 0.0],
        gradients=[[0, 0], [0.3, 0.1]],
        nearest=[-1, 7],
    )
    solution = MotionProgram(robot, by_torque=False).solve(
        [0, 0], [-0.18, -0.06], [-5.0, -5.0], clearances=clearances
    )
    assert solution.status == ProgramStatus.limited
    (row,) = solution.safety
    assert (row.coordinate, row.nearest, row.slack) == (1, 7, 0.0)
    assert row.multiplier > 0.0
    assert solution.dominant.coordinate == 1
    np.testing.assert_allclose([0.3, 0.1] @ solution.acceleration, row.required, rtol=1e-12)
    # The nearest point of a half-plane: what is added to the wanted acceleration is along the gradient.
    added = solution.acceleration + 5.0
    np.testing.assert_allclose(added[0] * 0.1, added[1] * 0.3, rtol=1e-9)


def test_bad_settings_and_arguments_raise() -> None:
    robot = ss.Robot.named("planar2")
    with pytest.raises(ValueError, match="safety: margin is -1"):
        SafetySettings(margin=-1.0)
    with pytest.raises(ValueError, match="period is 0"):
        MotionProgram(robot, period=0.0, by_torque=False)
    with pytest.raises(TypeError, match="clearances must be Clearances or a Step"):
        MotionProgram(robot, by_torque=False).solve([0, 0], [0, 0], [0, 0], clearances=np.zeros(3))
