"""Programs around an arm that are killed, and what the arm does then: the kill tests of the hazard list.

A simulated FR3 (`sidestep simulate`), its server (`sidestep serve`, with a supervisor) and clients are programs of
their own. In each case one of them is ended while the arm moves. The simulator's states are read by a connection of
their own: the arm must come to rest within its limits of position and velocity. Then it must be led to its goal again.
"""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from sidestep.bench.kill_programs import READY, Programs, Watcher, own_network, write_front_camera
from sidestep.bench.kill_trial import (
    GOAL,
    LONGEST_REST,
    LONGEST_WAY,
    MOVING,
    NEAR,
    KillOutcome,
    Trial,
    TrialError,
    unrecorded,
)

CLOCK_JUMP = 5.0  # [s]
MOST_TRIES = 3  # of a case that a busy machine disturbs
#: What a case raises that does not come about.
UNTRIED = (RuntimeError, OSError, ValueError, subprocess.SubprocessError)

CLIENT = """
import sys, time
from sidestep.link import connect
client = connect(sys.argv[1], name="planner", rate=100.0, timeout=10.0)
client.take_command()
client.set_goal([float(q) for q in sys.argv[2].split(",")])
while True:
    time.sleep(1.0)
    client.resume()
"""

CAMERA = """
import sys, time
import numpy as np
from sidestep.link import connect
client = connect(sys.argv[1], name="camera", rate=1000.0, timeout=10.0)
depth = np.full((120, 160), 3000, np.uint16)
depth[60:, :40] = 1500
while True:
    try:
        client.update("front", depth, time=client.state().time, unit=0.001)  # on the robot's clock
    except RuntimeError:  # no state has come yet
        pass
    time.sleep(0.033)
"""


def _client(trial: Trial) -> None:
    programs = trial.programs
    client = programs.run("client", CLIENT, ",".join(str(q) for q in GOAL))
    trial.wait_until_moving()
    killed = time.monotonic()
    client.kill()
    trial.watch_rest(killed)
    with programs.connect("other") as other:
        trial.explain(other.explain(), "no goal")
        trial.resume(other)


def _server(trial: Trial) -> None:
    programs = trial.programs
    with programs.connect("planner") as client:
        trial.lead(client)
        trial.wait_until_moving(client)
        killed, at = time.monotonic(), trial.watcher.robot_time
        programs.kill("server")
        trial.watch_rest(killed)
        try:
            client.explain()
        except ConnectionError as error:
            trial.explain(f"the client says: {error}", "has closed the connection", "was lost")
    _resume_with_another_server(trial, at)


def _simulator(trial: Trial) -> None:
    programs = trial.programs
    with programs.connect("planner") as client:
        trial.lead(client)
        trial.wait_until_moving(client)
        killed = time.monotonic()
        programs.kill("simulator")
        programs.processes["simulator"].wait()
        end = killed + LONGEST_REST
        while "the run has ended" not in programs.said("server") and time.monotonic() < end:
            time.sleep(0.01)
        trial.explain(programs.said("server"), "state_lost")
        trial.outcome.rest = time.monotonic() - killed  # of the server: the robot itself is gone
        trial.judge(0.0)
        programs.start_simulator()
        trial.watcher.close()
        trial.seen = Watcher(programs.robot)
        trial.resume(client)


def _supervisor(trial: Trial) -> None:
    programs = trial.programs
    with programs.connect("planner") as client:
        trial.lead(client)
        trial.wait_until_moving(client)
        killed = time.monotonic()
        os.kill(programs.supervisor(), signal.SIGKILL)
        trial.watch_rest(killed)
        trial.explain(programs.said("server"), "the supervisor has not answered")
        trial.resume(client)


def _interrupt(trial: Trial) -> None:
    programs = trial.programs
    with programs.connect("planner") as client:
        trial.lead(client)
        trial.wait_until_moving(client)
        killed, at = time.monotonic(), trial.watcher.robot_time
        programs.kill("server", signal.SIGINT)
        trial.watch_rest(killed)
        code = programs.processes["server"].wait(20.0)
        trial.explain(programs.said("server"), "Ctrl-C")
        trial.outcome.says_why = trial.outcome.says_why and code == 0
    _resume_with_another_server(trial, at)


def _clock_back(trial: Trial) -> None:
    _jump_of_clock(trial, "has jumped back")


def _clock_ahead(trial: Trial) -> None:
    _jump_of_clock(trial, "has jumped ahead")


def _jump_of_clock(trial: Trial, words: str) -> None:
    programs = trial.programs
    with programs.connect("planner") as client:
        trial.lead(client)
        trial.wait_until_moving(client)
        killed = time.monotonic()
        programs.kill("simulator", signal.SIGUSR1)
        trial.watch_rest(killed)
        trial.explain(programs.said("server"), words)
        trial.resume(client)


def _network(trial: Trial) -> None:
    """The network is cut: nobody outside sees the robot, so its true motion is read afterwards."""
    programs = trial.programs
    with programs.connect("planner") as client:
        trial.lead(client)
        end, next_resume = time.monotonic() + READY, time.monotonic() + 1.0
        while np.abs(client.state().v).max() < MOVING and time.monotonic() < end:
            if time.monotonic() > next_resume:
                client.resume()
                next_resume += 1.0
            time.sleep(0.005)
        trial.outcome.speed = float(np.abs(client.state().v).max())
        programs.set_network("down")
        time.sleep(2.0)
        trial.explain(programs.said("server"), "state_lost")
        programs.set_network("up")
        trial.lead(client)
        end = time.monotonic() + LONGEST_WAY
        while not trial.outcome.resumed and time.monotonic() < end:
            client.resume()
            time.sleep(1.0)
            trial.outcome.resumed = bool(np.abs(client.state().q - GOAL).max() < NEAR)
    programs.end()
    trial.judge_motion()


def _camera(trial: Trial) -> None:
    programs = trial.programs
    camera = programs.run("camera", CAMERA)
    with programs.connect("planner") as client:
        trial.lead(client)
        trial.wait_until_moving(client)
        killed = time.monotonic()
        camera.kill()
        trial.watch_rest(killed)
        trial.explain(client.explain(), "front")
        programs.run("camera", CAMERA)
        trial.resume(client)


def _resume_with_another_server(trial: Trial, killed: float) -> None:
    """Goes on with another server, after a look at what the recording lacks of the time before the kill.

    killed: on the robot's clock [s].
    """
    programs = trial.programs
    trial.outcome.lost = unrecorded(programs.record, killed)
    programs.record = programs.record.with_name("second.mcap")
    programs.start_server()
    with programs.connect("planner") as client:
        trial.resume(client)


CASES: dict[str, Callable[[Trial], None]] = {
    "client": _client,
    "server": _server,
    "simulator": _simulator,
    "supervisor": _supervisor,
    "camera": _camera,
    "clock-back": _clock_back,
    "clock-ahead": _clock_ahead,
    "network": _network,
    "ctrl-c": _interrupt,
}


def run_kills(
    cases: list[str], runs: int, *, progress: Callable[[int, int, str], None] | None = None
) -> list[dict[str, Any]]:
    """Each case so many times; what became of each."""
    rows: list[dict[str, Any]] = []
    for case in cases:
        for number in range(runs):
            if progress is not None:
                progress(len(rows), len(cases) * runs, f"{case} {number}")
            outcome = run_case(case, number)
            rows.append({**asdict(outcome), "passed": outcome.passed})
    return rows


def run_case(case: str, number: int) -> KillOutcome:
    """One case in a folder of its own; again where a busy machine had stopped the arm before anything was killed."""
    for busy in range(MOST_TRIES):
        outcome = KillOutcome(case, number, busy=busy)
        said = ""
        try:
            with (
                TemporaryDirectory(prefix="sidestep-kill-") as folder,
                own_network(case == "network") as prefix,
            ):
                said = _run(_programs(Path(folder), case, prefix), outcome)
        except UNTRIED as error:
            outcome.error = f"{type(error).__name__}: {error}"
        if not outcome.was_disturbed(said):
            break
    return outcome


def _programs(folder: Path, case: str, prefix: tuple[str, ...]) -> Programs:
    camera = write_front_camera(folder) if case == "camera" else None
    jump = {"clock-back": -CLOCK_JUMP, "clock-ahead": CLOCK_JUMP}.get(case, 0.0)
    return Programs(folder, tcp=case == "network", camera=camera, clock_jump=jump, prefix=prefix)


def _run(programs: Programs, outcome: KillOutcome) -> str:
    """Runs the case and returns what the server has printed. A case that did not come about has an error."""
    try:
        programs.start_simulator()
        programs.start_server()
        # Nobody outside of a network of its own sees the robot.
        trial = Trial(outcome, programs, None if programs.prefix else Watcher(programs.robot))
        try:
            CASES[outcome.case](trial)
        except TrialError as error:
            outcome.error = str(error)
        except UNTRIED as error:
            outcome.error = f"{type(error).__name__}: {error}"
        if trial.seen is not None:
            trial.seen.close()
        return programs.said("server")
    finally:
        programs.end()
