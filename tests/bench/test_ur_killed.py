"""What a kill of a UR's program counts as: benchmarks/ur_killed.py."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")
sys.path.insert(0, BENCHMARKS)
import ur_killed  # noqa: E402

sys.path.remove(BENCHMARKS)  # its studio.py would hide the folder of tests of that name


class Resting:
    """A stand-in whose arm does not move."""

    def __init__(self) -> None:
        self.time = 0.0

    def say(self, line: str) -> None:
        pass

    def tell(self) -> dict[str, Any]:
        self.time += 0.1
        return {"time": self.time, "position": [0.0] * 6, "velocity": [0.0] * 6, "protective stops": 0}

    def save(self, path: Path) -> None:
        np.savez(path, target_acceleration=np.zeros((100, 6)))


def test_an_arm_that_did_not_move_proves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ur_killed, "PROGRAM", "print('moves', flush=True); import time; time.sleep(60)")
    monkeypatch.setattr(ur_killed, "REST_TIME", 0.0)
    run = ur_killed.killed(Resting(), "position", 0.0)
    assert run["speed"] == 0.0
    assert run["rests"]
    assert not ur_killed.is_good(run)


@pytest.mark.parametrize(
    ("found", "good"),
    [({}, True), ({"speed": 0.1}, False), ({"rests": False}, False), ({"protective_stops": 1}, False)],
)
def test_a_kill_is_good_where_the_arm_moved_and_rests(found: dict[str, Any], good: bool) -> None:
    assert ur_killed.is_good({"speed": 1.0, "rests": True, "protective_stops": 0} | found) is good


def test_a_program_that_does_not_begin_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ur_killed, "PROGRAM", "print('no robot')")
    with pytest.raises(RuntimeError, match="did not begin; it said b'no robot"):
        ur_killed.killed(Resting(), "position", 0.0)
