"""What a controller gets of something that comes, and when."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from sidestep.bench import Told, tracker
from sidestep.bench.tracker import GONE, SEEN_EVERY, VALID_FOR, Tracker
from sidestep.distance import SceneObject

SPEED = np.array([0.5, 0.0, 0.0])
LAG = 0.08  # [s]
FAILS = 10 * SEEN_EVERY  # step


@dataclass
class Listener:
    """A controller that notes what it is told: step, x of the solid or None, its velocity, source and stamp."""

    told: list[tuple[int, float | None, float | None, str, float | None]] = field(default_factory=list)
    step: int = 0

    def set_obstacles(
        self, what: Any, source: str = "scene", *, time: float | None = None, valid_for: float = 0.0
    ) -> None:
        assert (source == "tracker") == (valid_for == VALID_FOR)
        empty = not hasattr(what, "pose")
        x, vx = (None, None) if empty else (float(what.pose[0, 3]), float(what.velocity[0]))
        self.told.append((self.step, x, vx, source, time))


def listen(told: Told, *, stands: bool = False, steps: int = 2000) -> Listener:
    begins = FAILS * 1e-3
    solid = SceneObject.ball(
        "solid",
        [0.0, 0.0, 0.5],
        radius=0.05,
        motion="moving",
        velocity=SPEED.tolist(),
        moves_during=(0.0, begins if stands else math.inf),
    )
    lost = np.arange(steps // SEEN_EVERY + 1) % 3 == 1
    fault = told.fault_at(begins) if told.fails else None
    velocity = SPEED if told.has_velocity else np.zeros(3)
    listener, sender = Listener(), Tracker(solid, told, velocity, LAG, lost, fault)
    for step in range(steps):
        listener.step = step
        sender.tell(listener, step)  # type: ignore[arg-type]
    return listener


@pytest.mark.parametrize("told", [Told.exact, Told.untold, Told.late])
def test_sets_without_stamps_are_of_the_scene(told: Told) -> None:
    for step, x, vx, source, time in listen(told).told:
        assert step % SEEN_EVERY == 0
        assert x == pytest.approx(0.5 * max(0.0, 1e-3 * step - (LAG if told is Told.late else 0.0)))
        assert vx == (0.0 if told is Told.untold else 0.5)
        assert (source, time) == ("scene", None)


@pytest.mark.parametrize("told", [Told.late_stamped, Told.arrival])
def test_late_sets_have_the_time_of_capture_or_of_arrival(told: Told) -> None:
    heard = listen(told).told
    assert heard[0] == (0, 0.0, 0.5, "tracker", 0.0)
    assert heard[1][0] == 3 * SEEN_EVERY  # the first that was captured since the start: after 80 ms
    for step, x, _, source, time in heard[1:]:
        assert x == pytest.approx(0.5 * (1e-3 * step - LAG))
        assert time == pytest.approx(1e-3 * step - (LAG if told is Told.late_stamped else 0.0))
        assert source == "tracker"


def test_lost_sets_do_not_come() -> None:
    steps = [step for step, *_ in listen(Told.lost30).told]
    assert steps == [k * SEEN_EVERY for k in range(2000 // SEEN_EVERY + 1) if k % 3 != 1]


@pytest.mark.parametrize("stands", [False, True])
def test_frozen_sets_are_the_last_true_one_with_new_stamps(stands: bool) -> None:
    heard = listen(Told.frozen, stands=stands).told
    assert [step for step, *_ in heard] == list(range(0, 2000, SEEN_EVERY))
    for step, x, vx, _, time in heard:
        assert x == pytest.approx(0.5e-3 * min(step, FAILS))
        assert (vx, time) == (0.5, pytest.approx(1e-3 * step))


@pytest.mark.parametrize("told", [Told.vanished, Told.vanished_untold])
@pytest.mark.parametrize("stands", [False, True])
def test_vanished_sets_are_empty_for_a_second(told: Told, stands: bool) -> None:
    for step, x, vx, source, time in listen(told, stands=stands).told:
        assert (source, time) == ("tracker", pytest.approx(1e-3 * step))
        if FAILS < step < FAILS + round(1e3 * GONE):
            assert x is None
        else:
            moves = step <= FAILS or not stands
            assert x == pytest.approx(0.5e-3 * (min(step, FAILS) if stands else step))
            assert vx == (0.5 if told.has_velocity and moves else 0.0)


@pytest.mark.parametrize("told", [Told.dead, Told.dead_untold])
def test_nothing_comes_from_a_dead_tracker(told: Told) -> None:
    heard = listen(told).told
    assert [step for step, *_ in heard] == list(range(0, FAILS + 1, SEEN_EVERY))
    assert heard[-1][1] == pytest.approx(0.5e-3 * FAILS)
    assert heard[-1][2] == (0.5 if told.has_velocity else 0.0)


def test_a_set_is_valid_for_longer_than_the_oldest_stamp_between_two_sets() -> None:
    assert VALID_FOR > max(tracker.LATE) + 2e-3 * SEEN_EVERY
