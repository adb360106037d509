"""`sidestep bench kills`: what counts as passed, and one program that is killed for real."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sidestep.bench.kill_programs import Programs
from sidestep.bench.kill_trial import KillOutcome, Trial, unrecorded
from sidestep.bench.kills import CASES, run_case

pytest.importorskip("mujoco")

GOOD = KillOutcome("server", 0, speed=0.5, rest=0.3, limits=True, says_why=True, resumed=True, lost=0.01)
PERIOD = 0.001  # [s]


def test_everything_must_hold() -> None:
    assert GOOD.passed
    assert replace(GOOD, lost=None).passed  # nothing was recorded in this case
    for wrong in (
        {"rest": None},
        {"rest": 5.1},
        {"limits": False},
        {"says_why": False},
        {"resumed": False},
        {"lost": 1.1},
        {"lost": float("inf")},
        {"error": "RuntimeError: the arm did not move"},
    ):
        assert not replace(GOOD, **wrong).passed, wrong


@pytest.mark.parametrize(
    "said",
    [
        "the loop was woken too late: the machine is too busy",
        "age of the state [s] 0.0506, allowed 0.05",
        "time without a report of the loop [s] 0.0304, allowed 0.02",
    ],
)
def test_a_case_is_tried_again_only_where_a_busy_machine_came_first(said: str) -> None:
    stopped = replace(GOOD, says_why=False)
    assert stopped.was_disturbed(f"the run has ended (denied): {said}; the arm was not at rest")
    assert replace(stopped, limits=False, error="RuntimeError: the arm did not move").was_disturbed(said)
    assert not GOOD.was_disturbed(said)  # it says what has happened as well
    assert not replace(stopped, limits=False).was_disturbed(said)  # a fault, whatever came first
    assert not stopped.was_disturbed("the run has ended (arrived)")


def braking(tmp_path: Path, fastest: float) -> Trial:
    """A trial whose simulator wrote a motion at that speed [rad/s] for 0.5 s, then 0.25 s of braking, then rest."""
    programs = Programs(tmp_path)
    t = np.arange(0.0, 1.5, PERIOD)
    speed = fastest * np.clip((0.75 - t) / 0.25, 0.0, 1.0)
    v = np.zeros((len(t), 7))
    v[:, 0] = speed
    q = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785]) + np.cumsum(v, axis=0) * PERIOD
    np.savez(programs.motion, time=t, q=q, v=v)
    return Trial(KillOutcome("network", 0, speed=fastest), programs, None)


def test_a_written_motion_is_judged_from_its_last_fast_moment(tmp_path: Path) -> None:
    trial = braking(tmp_path, 1.0)
    trial.judge_motion()
    assert trial.outcome.limits
    # From 0.9 of the speed at 0.525 s to 0.01 rad/s at 0.7475 s.
    assert trial.outcome.rest == pytest.approx(0.2225, abs=2 * PERIOD)
    assert trial.outcome.moved == pytest.approx(0.5 * (0.9 + 0.01) * 0.2225, rel=0.02)


def test_a_motion_beyond_a_limit_is_seen(tmp_path: Path) -> None:
    trial = braking(tmp_path, 3.0)  # the limit is 2.62 rad/s
    trial.judge_motion()
    assert not trial.outcome.limits


def test_what_is_said_must_name_what_happened(tmp_path: Path) -> None:
    trial = braking(tmp_path, 1.0)
    trial.explain("the run has ended\n(state_lost)", "state_lost")
    assert trial.outcome.says_why
    assert trial.outcome.why == "the run has ended (state_lost)"
    trial.explain("the run has ended (arrived)", "state_lost")
    assert not trial.outcome.says_why


def test_a_recording_that_is_not_there_is_lost_as_a_whole(tmp_path: Path) -> None:
    assert unrecorded(tmp_path / "none.mcap", 3.0) == float("inf")


def test_every_case_has_a_name_that_the_command_lists() -> None:
    from sidestep.cli.bench_kills_command import kills

    listed = kills.__annotations__["case"]
    assert all(name in str(listed) for name in CASES), listed
    assert {"client", "server", "simulator", "supervisor", "network", "camera", "ctrl-c"} < set(CASES)
    assert {"clock-back", "clock-ahead"} < set(CASES)


@pytest.mark.slow
def test_an_arm_whose_supervisor_is_killed_stops_and_goes_on() -> None:
    outcome = run_case("supervisor", 0)
    assert outcome.error == ""
    assert outcome.passed, outcome
    assert "the supervisor has not answered" in outcome.why
    assert 0.0 < (outcome.rest or 0.0) < 2.0


@pytest.mark.slow
@pytest.mark.parametrize("case", ["clock-back", "clock-ahead"])
def test_an_arm_whose_clock_jumps_stops_and_goes_on(case: str) -> None:
    outcome = run_case(case, 0)
    assert outcome.error == ""
    assert outcome.passed, outcome
    assert f"the clock of the robot's states has jumped {case[6:]}" in outcome.why
    assert 0.0 < (outcome.rest or 0.0) < 2.0
