"""`run_in_two_programs`: what came of a run, and why there is none."""

from __future__ import annotations

import os
import signal
import threading
import time

import numpy as np
import pytest

from sidestep.drivers import MuJoCo
from sidestep.scenario import two_programs
from sidestep.scenario.two_programs import ARRIVAL, run_in_two_programs
from sidestep.simulation import Simulation
from sidestep.simulation.link import Link
from support.planar_scenario import planar_scenario

pytest.importorskip("mujoco")


def test_the_time_is_that_of_arrival_also_over_a_lossy_link() -> None:
    scenario, parts = planar_scenario()
    ran = run_in_two_programs(scenario, parts, link=Link(loss=0.2, seed=1))
    alone = Simulation(parts.robot, timestep=0.001, visuals=False).run(
        planar_scenario()[1].driver, parts.start, parts.goal, 20.0, arrival=ARRIVAL
    )
    assert ran.time_to_goal is not None
    assert ran.time_to_goal == pytest.approx(alone.time_to_goal, abs=0.1)
    assert ran.time[-1] > ran.time_to_goal + ARRIVAL.hold  # until it was left, at rest
    at = np.searchsorted(ran.time, ran.time_to_goal - 1e-9)
    assert np.abs(ran.q[at] - parts.goal).max() < ARRIVAL.position
    assert not (
        np.abs(ran.q[at - 1] - parts.goal).max() < ARRIVAL.position and np.abs(ran.v[at - 1]).max() < 0.05
    )


def test_a_simulator_that_ends_early_is_named_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    class Killed(MuJoCo):
        def __enter__(self) -> MuJoCo:
            threading.Thread(target=self._kill).start()
            return self

        def _kill(self) -> None:
            time.sleep(0.1)
            os.kill(self.pid, signal.SIGKILL)

    monkeypatch.setattr(two_programs, "MuJoCo", Killed)
    scenario, parts = planar_scenario()
    with pytest.raises(
        RuntimeError,
        match=r"planar-one-obstacle: the simulator ended early: the connection to the robot is gone",
    ):
        run_in_two_programs(scenario, parts)
