"""A scenario as two programs: the `Controller` in a loop here, the simulated robot in a process of its own."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import Controller, RunReport
from sidestep.drivers import MuJoCo
from sidestep.loop import LoopSettings, run
from sidestep.scenario.assembly import Assembly
from sidestep.scenario.scenario import Scenario
from sidestep.simulation.link import Link
from sidestep.simulation.run import Arrival, ArrivalWatch

Array = npt.NDArray[np.float64]

ARRIVAL = Arrival(
    position=0.01, speed=0.05, hold=0.2
)  # as the loop has it: `ArrivalSettings`, `LoopSettings.hold`
PATIENCE = 10.0  # [s] of the machine's clock for a state of a simulator that is as fast as it is asked


@dataclass(frozen=True, eq=False)
class TwoProgramsRun:
    """What came of a run.

    Attributes:
        report: of the loop. found: of the simulator, as `sidestep simulate --json` writes it.
        time: (T,) [s]; q, v, torque: (T, nv) of the simulated robot, every cycle until it was at rest and left.
        object_poses: (T, N, 7) position and quaternion (w, x, y, z) in the world.
        time_to_goal: when the true motion had arrived [s], of simulated time; None: it never had for `ARRIVAL.hold`.
        delay: from a state to the cycle in which its command moved the robot, at the end [s].
    """

    report: RunReport
    found: dict[str, Any]
    time: Array
    q: Array
    v: Array
    torque: Array
    object_poses: Array
    time_to_goal: float | None
    delay: float


def run_in_two_programs(
    scenario: Scenario,
    parts: Assembly,
    *,
    link: Link | None = None,
    speed: float = 0.0,
    leap: bool = False,
    start_in_contact: bool = False,
) -> TwoProgramsRun:
    """Runs a scenario until arrival, or for its duration.

    Args:
        scenario: of the method "controller". parts: of it, see `assemble`.
        link: how late and lossy the connection is; by default it is neither.
        speed: of the simulator: 0 as fast as it is asked, which repeats; 1 by the machine's clock.
        leap: see `MuJoCo`. start_in_contact: see `LoopSettings`.

    Raises:
        ValueError: a scenario of the method "custom", which has no `Controller`.
        RuntimeError: the simulator did not start or ended early, or the loop refuses to begin.
    """
    if not isinstance(parts.mover, Controller):
        raise ValueError(f"{scenario.name}: method is {scenario.method!r}; two programs need a controller")
    link = Link() if link is None else link
    with tempfile.TemporaryDirectory(prefix="sidestep-") as folder:
        motion = Path(folder) / "motion.npz"
        with MuJoCo(
            scenario,
            delay=link.delay,
            jitter=link.jitter,
            loss=link.loss,
            seed=link.seed,
            speed=speed,
            leap=leap,
            motion=motion,
        ) as driver:
            # A simulator on its own clock may be slow: what counts is its time, not the machine's.
            loop = LoopSettings(start_in_contact=start_in_contact)
            if speed == 0.0:
                loop.state_timeout = loop.longest_gap = PATIENCE
            report = run(parts.mover, driver, duration=scenario.simulation.duration, settings=loop)
            delay = driver.delay
        failure = driver.report.get("failure", "")
        if failure or not motion.is_file():
            raise RuntimeError(f"{scenario.name}: the simulator ended early: {failure or report.why}")
        with np.load(motion) as rows:
            columns = {name: rows[name] for name in ("time", "q", "v", "torque", "object_poses")}
    return TwoProgramsRun(
        report=report,
        found=driver.report,
        time_to_goal=_time_to_goal(parts, columns["time"], columns["q"], columns["v"]),
        delay=delay,
        **columns,
    )


def _time_to_goal(parts: Assembly, time: Array, q: Array, v: Array) -> float | None:
    """When a motion q, v (T, nv) at `time` (T,) [s] had arrived."""
    watch = ArrivalWatch(parts.goal if parts.pose is None else parts.pose, ARRIVAL, parts.robot)
    for row in zip(time, q, v, strict=True):
        if watch.update(*row):
            return watch.since
    return None
