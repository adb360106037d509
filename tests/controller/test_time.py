"""A loop that is not called as often as it was told: limits hold, what is late is said, and replays repeat."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import pytest

import sidestep as ss
from sidestep.bench.encounters import TorquePlant

TOLD = 1e-3  # [s] period of the settings
OVERRUN = 1.05  # velocity over its limit that an arm under torque may have
BEYOND = 2e-3  # [rad] that a measured position may be beyond its limit, under torque
ROUNDING = 1e-6  # relative
STOOD_STILL = 0.06  # [s] between two steps of a loop of 125 Hz at least, by a machine that does not run it


@pytest.fixture(scope="module")
def arm() -> ss.Arm:
    return ss.Arm.load("fr3")


class IdealArm:
    """Has the commanded acceleration until it is told another, in steps of 0.25 ms at most."""

    def __init__(self, q: np.ndarray) -> None:
        self.q, self.v = q.copy(), np.zeros_like(q)

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        return self.q.copy(), self.v.copy()

    def hold(self, command: ss.Command, seconds: float) -> None:
        steps = max(1, int(np.ceil(seconds / 0.25e-3)))
        for _ in range(steps):
            self.v = self.v + seconds / steps * command.acceleration
            self.q = self.q + seconds / steps * self.v


class TorqueArm:
    """In MuJoCo under torque, in steps of 0.5 ms; what is left of one is for the next time."""

    STEP = 0.5e-3

    def __init__(self, arm: ss.Arm, q: np.ndarray) -> None:
        self._left = 0.0
        self._plant = TorquePlant(arm.robot, q, edit=lambda model: setattr(model.opt, "timestep", self.STEP))

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        return self._plant.state()

    def hold(self, command: ss.Command, seconds: float) -> None:
        self._left += seconds
        while self._left > 0.5 * self.STEP:
            self._plant.apply(command)
            self._left -= self.STEP


@dataclass
class Motion:
    q: list[np.ndarray] = field(default_factory=list)
    v: list[np.ndarray] = field(default_factory=list)
    torque: list[np.ndarray] = field(default_factory=list)
    commands: list[ss.Command] = field(default_factory=list)

    def check(self, arm: ss.Arm, output: str, torque_period: float, moves: float = 0.5) -> None:
        """Limits hold; `moves`: share of the velocity limits that some joint reaches at least."""
        limits, q, v = arm.limits, np.array(self.q), np.array(self.v)
        beyond = BEYOND if output == "torque" else ROUNDING
        assert np.abs(v / limits.velocity).max() > moves
        assert np.abs(v / limits.velocity).max() <= OVERRUN
        assert (q >= limits.lower - beyond).all()
        assert (q <= limits.upper + beyond).all()
        if output == "torque":
            changes = np.abs(np.diff(np.array(self.torque), axis=0)) / (torque_period * limits.effort_rate)
            assert changes.max() <= 1.0 + ROUNDING


def goals_of(arm: ss.Arm) -> Iterator[np.ndarray]:
    rng = np.random.default_rng(1)
    low, high = arm.limits.lower, arm.limits.upper
    while True:
        yield 0.5 * (low + high) + 0.45 * rng.choice([-1.0, 1.0], len(low)) * (high - low)


def controller_of(arm: ss.Arm, output: str, **settings: object) -> ss.Controller:
    controller = ss.Controller(arm, ss.ControllerSettings(output=output, planner=None, **settings))
    controller.set_obstacles(ss.Obstacles.none())
    return controller


def plant_of(arm: ss.Arm, output: str) -> IdealArm | TorqueArm:
    return TorqueArm(arm, arm.neutral) if output == "torque" else IdealArm(arm.neutral)


def drive_told(arm: ss.Arm, output: str, period: float, seconds: float = 4.0) -> Motion:
    """A loop of that period that tells its time."""
    controller, plant = controller_of(arm, output, synchronous=True), plant_of(arm, output)
    goals, motion = goals_of(arm), Motion()
    steps = round(seconds / period)
    for k in range(steps):
        if k % round(1.0 / period) == 0:
            controller.set_goal(next(goals))
        q, v = plant.state()
        command = controller.step(q, v, time=17.0 + k * period)
        motion.q.append(q), motion.v.append(v), motion.torque.append(command.torque)
        motion.commands.append(command)
        plant.hold(command, period)
    return motion


def drive_by_the_clock(arm: ss.Arm, output: str, period: float, moves: float, seconds: float = 2.5) -> Motion:
    """The same in real time without telling it; the arm moves on for as long as the machine really took.

    A busy machine is given up to ten times as long until some joint reaches the share `moves` of its velocity limit.
    Where it stood still, the motion ends, or begins anew: nothing limits an arm that goes on so long with one command.
    """
    controller, plant = controller_of(arm, output), plant_of(arm, output)
    goals, motion, begin = goals_of(arm), Motion(), time.perf_counter()
    last, command, k, fastest = begin, None, 0, 0.0
    while (now := time.perf_counter()) < begin + (seconds if fastest > moves else 10.0 * seconds):
        if now - begin >= 1.0 * k:
            controller.set_goal(next(goals))
            k += 1
        if now - last > STOOD_STILL and fastest > moves:
            break
        if now - last > STOOD_STILL:
            return drive_by_the_clock(arm, output, period, moves, seconds)
        if command is not None:
            plant.hold(command, now - last)
        q, v = plant.state()
        fastest = max(fastest, np.abs(v / arm.limits.velocity).max())
        last, command = now, controller.step(q, v)
        motion.q.append(q), motion.v.append(v), motion.torque.append(command.torque)
        motion.commands.append(command)
        time.sleep(max(0.0, now + period - time.perf_counter()))
    return motion


def moves_at(output: str, rate: int) -> float:
    """Torques that change by a quarter or an eighth of their rate are for a slower arm: one at full speed ran away."""
    return {125: 0.1, 250: 0.3}.get(rate, 0.4) if output == "torque" else 0.4


@pytest.mark.parametrize("rate", [125, 250, 500])
@pytest.mark.parametrize("output", ["acceleration", "torque"])
def test_a_slow_loop_that_tells_its_time_keeps_the_limits(arm: ss.Arm, output: str, rate: int) -> None:
    motion = drive_told(arm, output, 1.0 / rate)
    motion.check(arm, output, TOLD, moves_at(output, rate))
    last = motion.commands[-1]
    assert last.measured_period == pytest.approx(1.0 / rate, rel=1e-6)
    assert last.late_steps == len(motion.commands) - 1
    assert last.missed_periods == last.late_steps * (1000 // rate - 1)


@pytest.mark.parametrize("rate", [125, 250, 500])
@pytest.mark.parametrize("output", ["acceleration", "torque"])
def test_a_slow_loop_that_tells_nothing_keeps_the_limits(arm: ss.Arm, output: str, rate: int) -> None:
    moves = moves_at(output, rate)
    motion = drive_by_the_clock(arm, output, 1.0 / rate, moves)
    motion.check(arm, output, TOLD, moves)
    assert motion.commands[-1].late_steps > 0.8 * len(motion.commands)


@pytest.mark.parametrize("output", ["acceleration", "torque"])
def test_a_fast_loop_that_tells_its_time_keeps_the_limits(arm: ss.Arm, output: str) -> None:
    motion = drive_told(arm, output, 0.5e-3)
    motion.check(arm, output, 0.5e-3)
    assert motion.commands[-1].measured_period == pytest.approx(0.5e-3, rel=1e-6)
    assert motion.commands[-1].late_steps == 0


@pytest.mark.parametrize("seed", [0, 3])
def test_paths_of_the_planner_leave_slow_torques_their_time(arm: ss.Arm, seed: int) -> None:
    """At 125 Hz gravity asked a fast arm for more than an eighth of its rate: it reached 8 times its velocity limit."""
    controller = ss.Controller(arm, ss.ControllerSettings(output="torque", synchronous=True, seed=seed))
    controller.set_obstacles(ss.Obstacles.none())
    plant, motion, rng = TorqueArm(arm, arm.neutral), Motion(), np.random.default_rng(seed)
    low, high = np.maximum(arm.limits.lower, -2.8), np.minimum(arm.limits.upper, 2.8)
    for k in range(375):
        if k % 125 == 0:
            controller.set_goal(0.5 * (low + high) + 0.45 * rng.uniform(-1, 1, 7) * (high - low))
        q, v = plant.state()
        command = controller.step(q, v, time=0.008 * k)
        motion.q.append(q), motion.v.append(v), motion.torque.append(command.torque)
        plant.hold(command, 0.008)
    motion.check(arm, "torque", TOLD, moves=0.2)


def test_a_rate_that_falls_while_the_arm_moves(arm: ss.Arm) -> None:
    controller, plant, motion = (
        controller_of(arm, "torque", synchronous=True),
        TorqueArm(arm, arm.neutral),
        Motion(),
    )
    goals, now, rng = goals_of(arm), 0.0, np.random.default_rng(0)
    for k in range(3000):
        if k % 500 == 0:
            controller.set_goal(next(goals))
        q, v = plant.state()
        command = controller.step(q, v, time=now)
        motion.q.append(q), motion.v.append(v), motion.torque.append(command.torque)
        period = [1e-3, 4e-3, 2e-3, 1e-3][k // 400 % 4] * rng.uniform(0.8, 1.2) + (
            0.01 if k % 97 == 0 else 0.0
        )
        plant.hold(command, period)
        now += period
    motion.check(arm, "torque", TOLD)


def test_it_says_that_it_is_called_too_rarely(arm: ss.Arm) -> None:
    controller = controller_of(arm, "position", synchronous=True)
    for k in range(6):
        controller.step(arm.neutral, 0.0 * arm.neutral, time=0.004 * k)
    assert controller.explain().startswith("called every 4.0 ms, told 1.0 ms; ")


@pytest.mark.parametrize("output", ["position", "velocity", "acceleration", "torque"])
def test_a_pause_is_one_and_ages_what_is_seen(arm: ss.Arm, output: str) -> None:
    controller = controller_of(arm, output, synchronous=True, obstacle_timeout=0.9)
    rest = np.zeros(7)
    for k in range(5):
        command = controller.step(arm.neutral, rest, time=0.001 * k)
    assert command.status == ss.SafetyStatus.ok
    command = controller.step(arm.neutral, rest, time=0.004 + 0.8)
    assert command.status == ss.SafetyStatus.ok
    assert controller.step(arm.neutral, rest, time=0.004 + 1.0).status == ss.SafetyStatus.stale
    controller.set_obstacles(ss.Obstacles.none())
    away = arm.neutral + np.array([0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 0.0])
    command = controller.step(away, rest, time=3.0)  # meanwhile something else has moved the arm
    assert np.abs(command.position - away).max() < 1e-2
    assert "moved by something else" in controller.explain()


def test_a_pause_by_the_machines_clock_ages_what_is_seen(arm: ss.Arm) -> None:
    controller = controller_of(arm, "position", obstacle_timeout=0.9)
    assert controller.step(arm.neutral, np.zeros(7)).status == ss.SafetyStatus.ok
    time.sleep(1.0)
    assert controller.step(arm.neutral, np.zeros(7)).status == ss.SafetyStatus.stale


@pytest.mark.parametrize("output", ["position", "velocity", "acceleration", "torque"])
def test_a_time_that_goes_back_is_a_stop_that_says_so(arm: ss.Arm, output: str) -> None:
    controller = controller_of(arm, output, synchronous=True)
    controller.set_goal(arm.neutral + 0.3)
    plant: IdealArm | TorqueArm = plant_of(arm, output)
    for k in range(300):
        q, v = plant.state()
        command = controller.step(q, v, time=5.0 + 0.001 * k)
        plant.hold(command, TOLD)
    q, v = plant.state()
    command = controller.step(q, v, time=5.299 - 0.3)
    assert command.status == ss.SafetyStatus.stopping
    assert "time went back by 0.3 s" in controller.explain()
    fastest = np.abs(v).argmax()
    assert command.acceleration[fastest] * v[fastest] < 0.0  # it brakes
    plant.hold(command, TOLD)
    q, v = plant.state()
    command = controller.step(q, v, time=5.0)
    assert command.status < ss.SafetyStatus.tracking_lost
    assert controller.step(q, v, time=5.0).status == ss.SafetyStatus.stopping
    assert "time stands still" in controller.explain()
    assert np.isfinite(command.torque).all()
    assert np.isfinite(command.position).all()


def test_no_time_and_the_exact_one_are_the_same_motion(arm: ss.Arm) -> None:
    """Bit for bit: a simulation that tells its time repeats as one that does not."""
    motions = []
    for told in (None, np.nan, "exact"):
        controller, plant = controller_of(arm, "torque", synchronous=True), IdealArm(arm.neutral)
        controller.set_goal(arm.neutral + 0.4)
        rows = []
        for k in range(400):
            command = controller.step(*plant.state(), time=1e5 + 0.001 * k if told == "exact" else told)
            rows.append(np.concatenate([command.torque, command.position, command.velocity]))
            plant.hold(command, TOLD)
        motions.append(rows)
    np.testing.assert_array_equal(motions[0], motions[1])
    np.testing.assert_array_equal(motions[0], motions[2])


def test_a_time_is_a_number(arm: ss.Arm) -> None:
    controller = controller_of(arm, "position", synchronous=True)
    with pytest.raises(TypeError, match=r"time .*a number of seconds, or None"):
        controller.step(arm.neutral, np.zeros(7), time="now")  # type: ignore[arg-type]


@pytest.mark.parametrize("synchronous", [True, False])
def test_a_replay_has_the_same_time(arm: ss.Arm, tmp_path, synchronous: bool) -> None:
    path, rng = tmp_path / "run.mcap", np.random.default_rng(3)
    controller, plant = controller_of(arm, "torque", synchronous=synchronous), IdealArm(arm.neutral)
    with controller.record(path):
        controller.set_goal(arm.neutral + 0.4)
        now = 3.0
        for k in range(400):
            told = None if k % 50 < 10 else now
            command = controller.step(*plant.state(), time=told)
            period = rng.choice([0.0005, 0.001, 0.004, 0.01])
            plant.hold(command, period)
            now += period - (0.2 if k == 200 else 0.0)
    result = ss.replay(path)
    assert result.equal, result.difference
    assert result.steps == 400
