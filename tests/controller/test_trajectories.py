"""Trajectories between their samples: dwells, bunched stamps, turns, limits, and what `deviation` says."""

import itertools
from collections.abc import Callable

import numpy as np
import pytest

import sidestep as ss

ARM = ss.Arm.load("fr3")
NV = ARM.num_coordinates
LIMITS = ARM.robot.limits
HELD = 1e-6  # [rad] a standing reference moves by rounding alone
TRACKING = 5e-3  # [rad] of the reference behind its curve where that jerks harder than the limits allow
CORNER = 0.01  # [rad] what the curve may leave the straight lines between samples by, see JointTrajectory
BEYOND = 1e-3  # [rad] 0.5 mrad where a joint turns, and as much of tracking


class Run:
    """A trajectory that an ideal arm follows until it arrives."""

    def __init__(
        self,
        samples: np.ndarray,
        times: np.ndarray,
        *,
        arm: ss.Arm = ARM,
        behaviour: str = "keep_path",
        more: float = 4.0,
    ) -> None:
        self.controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True, output="position"))
        self.controller.set_obstacles(ss.Obstacles.none())
        self.controller.set_trajectory(samples, times, behaviour=behaviour)
        q, v = samples[0], 0.0 * samples[0]
        rows, speeds, accelerations, self.deviation = [q], [v], [0.0 * v], 0.0
        for _ in range(int(1000 * (times[-1] + more))):
            command = self.controller.step(q, v)
            q, v = command.position, command.velocity
            rows.append(q)
            speeds.append(v)
            accelerations.append(command.acceleration)
            self.deviation = max(self.deviation, command.deviation)
            if command.activity == ss.Activity.arrived:
                break
        self.q, self.v, self.a = np.array(rows), np.array(speeds), np.array(accelerations)
        self.arrived = self.controller.command.activity == ss.Activity.arrived
        self.duration = 1e-3 * (len(rows) - 1)


def off_lines(q: np.ndarray, samples: np.ndarray) -> float:
    """Largest distance of rows of q from the straight lines between samples, in the farthest joint."""
    least = np.full(len(q), np.inf)
    for a, b in itertools.pairwise(samples):
        way = b - a
        share = np.clip((q - a) @ way / max(way @ way, 1e-300), 0.0, 1.0)
        least = np.minimum(least, np.abs(q - a - np.outer(share, way)).max(axis=1))
    return float(least.max())


def along(values: np.ndarray, joints: dict[int, float] | None = None) -> np.ndarray:
    """Samples of the FR3 that move in proportion."""
    way = np.zeros(NV)
    for joint, share in (joints or {0: 1.0}).items():
        way[joint] = share
    return ARM.neutral + np.outer(values, way)


@pytest.mark.parametrize("behaviour", ["keep_path", "steer"])
@pytest.mark.parametrize(
    ("values", "times"),
    [
        ([-0.7, -0.4, 0.0, 0.0], [0.0, 1.0, 1.2, 3.0]),
        ([0.0, 0.0, 0.4, 0.7], [0.0, 2.0, 2.2, 3.2]),
        ([*np.linspace(0.0, 0.9, 11), 0.9], [*np.linspace(0.0, 0.5, 11), 2.5]),
    ],
)
def test_a_dwell_beside_a_quick_move_is_still(
    behaviour: str, values: list[float], times: list[float]
) -> None:
    samples = along(np.array(values), {0: 1.0, 3: 0.3})
    run = Run(samples, np.array(times), behaviour=behaviour)
    assert run.arrived
    assert off_lines(run.q, samples) < BEYOND
    assert (run.q - samples.max(axis=0)).max() < BEYOND
    assert (samples.min(axis=0) - run.q).max() < BEYOND
    assert run.deviation < BEYOND
    if values[0] == values[1]:  # the dwell is first, and nothing lags behind it
        assert np.abs(run.q[:1900] - samples[0]).max() < HELD


def recording(stamps: Callable[[np.ndarray], np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """3 s at 30 Hz, with stamps as a recorder wrote them."""
    true = np.arange(91) / 30.0
    return along(0.4 * np.sin(2.0 * np.pi * true / 3.0), {0: 1.0, 3: 0.5}), stamps(true)


def pairs(gap: float) -> Callable[[np.ndarray], np.ndarray]:
    def stamps(true: np.ndarray) -> np.ndarray:
        late = true.copy()
        late[1::2] = true[2::2] - gap
        return late

    return stamps


def one_late(gap: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda true: np.where(np.arange(91) == 45, true[46] - gap, true)


def bursts_of_three(true: np.ndarray) -> np.ndarray:
    late = true.copy()
    for k in range(3, 91, 3):
        late[k - 2 : k] = true[k] - np.array([2e-3, 1e-3])
    return late


@pytest.mark.parametrize(
    "stamps",
    [one_late(1e-3), one_late(1e-6), pairs(1.5e-3), pairs(1e-6), bursts_of_three],
    ids=["one late", "one late by all but a microsecond", "pairs", "pairs of a microsecond", "threes"],
)
def test_bunched_stamps_are_followed_on_the_line(stamps: Callable[[np.ndarray], np.ndarray]) -> None:
    samples, times = recording(stamps)
    run = Run(samples, times)
    assert run.arrived
    assert off_lines(run.q, samples) < TRACKING
    # True stamps take 3.12 s; uneven speeds are left where stamps only just became feasible.
    assert run.duration < 3.4


def test_a_sample_that_is_there_twice_counts_once() -> None:
    samples, times = recording(lambda true: true)
    twice = np.sort(np.concatenate([times, times + 1e-6]))
    for stamps in (twice, np.repeat(times, 2)):
        run = Run(np.repeat(samples, 2, axis=0), stamps)
        assert run.arrived
        assert run.duration == pytest.approx(Run(samples, times).duration, abs=1e-3)  # a period


def test_a_sinusoid_takes_no_longer_than_it_did() -> None:
    samples, times = recording(lambda true: true)
    run = Run(samples, times)
    assert run.duration < 3.13  # 3.124 in 0.2.0, which flew over samples
    lag = np.minimum(1e-3 * np.arange(len(run.q)), 3.0)
    wanted = along(0.4 * np.sin(2.0 * np.pi * lag / 3.0), {0: 1.0, 3: 0.5})
    assert np.abs(run.q - wanted).max() < 0.04  # 0.0388 in 0.2.0: the start, from rest


def test_limits_hold_and_the_lines_are_kept_over_random_spans() -> None:
    for seed in range(6):
        rng = np.random.default_rng(seed)
        spans = 10.0 ** rng.uniform(-3.0, 0.2, rng.integers(4, 12))
        times = np.concatenate([[0.0], np.cumsum(spans)])
        rests = rng.uniform(size=(len(spans), 1)) < 0.3
        ways = rng.uniform(-0.4, 0.4, (len(spans), NV)) * LIMITS.velocity * np.minimum(spans, 0.3)[:, None]
        samples = ARM.neutral + np.vstack([np.zeros(NV), np.cumsum(np.where(rests, 0.0, ways), axis=0)])
        samples = np.clip(samples, LIMITS.lower + 0.1, LIMITS.upper - 0.1)
        run = Run(samples, times)
        off = off_lines(run.q, samples)
        assert run.arrived, seed
        assert off < CORNER + TRACKING, seed
        # The last row is where the last command leads, which nothing says any more.
        assert run.deviation > off_lines(run.q[:-1], samples) - 1e-9, seed  # rounding
        assert (np.abs(run.v) <= LIMITS.velocity).all(), seed
        assert (np.abs(run.a) <= LIMITS.acceleration).all(), seed
        jerks = 1000.0 * np.abs(np.diff(run.a, axis=0))
        assert (jerks <= (1.0 + 1e-9) * LIMITS.jerk).all(), seed  # rounding of a difference


def test_a_long_way_to_the_first_sample_neither_swings_nor_starts_early() -> None:
    times = 2.0 + np.linspace(0.0, 1.0, 21)
    samples = along(np.linspace(0.0, 0.8, 21))
    run = Run(samples, times)
    assert run.arrived
    assert np.abs(run.q[:2000] - samples[0]).max() < CORNER
    assert (samples.min(axis=0) - run.q).max() < CORNER
    assert run.duration < 3.2  # from rest at 2 s: the ramp to 0.8 rad/s and back costs 0.1 s


def test_deviation_counts_from_the_samples_and_not_from_a_curve() -> None:
    # Pushed off by an obstacle, the arm is off the lines by what the deviation says.
    samples, times = along(np.linspace(0.0, 1.2, 61)), np.linspace(0.0, 3.0, 61)
    controller = ss.Controller(ARM, ss.ControllerSettings(synchronous=True, output="position"))
    above = ARM.robot.pose(samples[30], "fr3_hand_tcp")[:3, 3] + np.array([0.0, 0.0, 0.05])
    controller.set_obstacles(ss.Obstacles([above], radii=0.04))
    controller.set_trajectory(samples, times, behaviour="steer")
    q, v, largest = samples[0], np.zeros(NV), 0.0
    for step in range(4000):
        command = controller.step(q, v)
        if step % 50 == 0:
            assert command.deviation > off_lines(q[None], samples) - 1e-6  # rounding of the reference
        q, v, largest = command.position, command.velocity, max(largest, command.deviation)
    assert largest > 0.02


def continuous_arm(velocity: str = 'velocity="2"') -> ss.Arm:
    """Two links whose joints turn without end."""
    link = """<link name="l{0}"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0"
        iyz="0"/></inertial><collision><origin xyz="0.2 0 0"/><geometry><box size="0.4 0.05 0.05"/></geometry>
        </collision></link>"""
    joint = """<joint name="j{1}" type="continuous"><parent link="l{0}"/><child link="l{1}"/><origin xyz="{2} 0 0"/>
        <axis xyz="0 0 1"/><limit {3} effort="50"/></joint>"""
    text = f"""<robot name="turning"><link name="l0"/>{link.format(1)}{link.format(2)}
        {joint.format(0, 1, 0.0, velocity)}{joint.format(1, 2, 0.5, velocity)}</robot>"""
    return ss.Arm.load(text)


def test_samples_of_joints_without_limits_are_unwound() -> None:
    times = np.linspace(0.0, 3.0, 31)
    true = np.column_stack([2.5 + 1.3 * (1.0 - np.cos(np.pi * times / 3.0)) / 2.0, 0.3 + 0.0 * times])
    wrapped = (true + np.pi) % (2.0 * np.pi) - np.pi
    assert np.abs(np.diff(wrapped[:, 0])).max() > 6.0  # it wraps
    run = Run(wrapped, times, arm=continuous_arm())
    assert run.arrived
    assert run.duration < 3.2
    assert off_lines(run.q, true) < BEYOND
    assert run.deviation < BEYOND


@pytest.mark.filterwarnings("ignore:.*no velocity limit is given")
def test_bunched_stamps_without_velocity_limits() -> None:
    samples, times = recording(bursts_of_three)
    samples = samples[:, [0, 3]] - samples[0, [0, 3]]
    run = Run(samples, times, arm=continuous_arm(velocity=""))
    assert run.arrived
    assert off_lines(run.q, samples) < TRACKING
    assert run.duration < 3.5  # true stamps take 3.14 s; 4.95 s where they stay as they are


def test_stamps_that_are_dates_and_stamps_that_go_back_are_named() -> None:
    controller = ss.Controller(ARM, ss.ControllerSettings(synchronous=True))
    samples = along(np.array([0.0, 0.1, 0.2]))
    with pytest.raises(
        ValueError, match=r"time 0 is 1700000000.* s from now on, allowed: up to 3600.*subtract"
    ):
        controller.set_trajectory(samples, 1.7e9 + np.array([0.0, 0.1, 0.2]))
    with pytest.raises(ValueError, match=r"time 2 is 0\.1.* s, allowed: more than the one before"):
        controller.set_trajectory(samples, [0.0, 0.1, 0.1])
