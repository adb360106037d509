"""A supervisor in a process of its own: nothing is written without its approval."""

from __future__ import annotations

import functools
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import sidestep as ss
from sidestep.loop import RunEnd, Supervisor, SupervisorSettings
from support.busy_machine import PATIENT


@pytest.fixture(scope="module")
def arm() -> ss.Arm:
    return ss.Arm.load("planar3")


def controller_of(arm: ss.Arm) -> ss.Controller:
    controller = ss.Controller(arm, ss.ControllerSettings(output="position"))
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(arm.neutral + 0.3)
    return controller


SUPERVISED = SupervisorSettings(state_age=10.0, command_age=10.0, approval_age=2.0)  # on a busy machine
run = functools.partial(ss.run, settings=PATIENT)


def test_a_supervised_run_arrives_and_a_dead_supervisor_ends_the_next(arm: ss.Arm) -> None:
    controller, robot = controller_of(arm), ss.drivers.Ideal(arm)
    with Supervisor(controller, SUPERVISED) as supervisor:
        process = supervisor.process
        assert process not in (None, os.getpid())
        report = run(controller, robot, supervisor=supervisor)
        assert report.end == RunEnd.arrived, report.why
        assert report.unwritten == 0
        assert supervisor.approves

        controller.set_goal(arm.neutral)
        supervisor.reset()
        killed: list[float] = []

        def kill_on_the_way(state: ss.drivers.RobotState) -> bool:
            if not killed and state.q[0] < arm.neutral[0] + 0.2:
                killed.append(state.q[0])
                os.kill(process, signal.SIGKILL)
            return False

        report = run(controller, robot, until=kill_on_the_way, supervisor=supervisor)
        assert killed
        assert report.end == RunEnd.denied
        assert "the supervisor has not answered" in report.why
        assert report.unwritten > 0
        supervisor.reset()
        assert supervisor.process not in (None, process)  # another one
        assert run(controller, robot, supervisor=supervisor).end == RunEnd.arrived


def test_time_between_two_runs_is_no_silence(arm: ss.Arm) -> None:
    controller, robot = controller_of(arm), ss.drivers.Ideal(arm)
    settings = SupervisorSettings(state_age=10.0, command_age=1.0, approval_age=2.0)
    with Supervisor(controller, settings) as supervisor:
        assert run(controller, robot, supervisor=supervisor).end == RunEnd.arrived
        time.sleep(1.5)
        controller.set_goal(arm.neutral)
        report = run(controller, robot, supervisor=supervisor)
        assert report.end == RunEnd.arrived, report.why


def test_what_exceeds_a_limit_is_denied(arm: ss.Arm) -> None:
    controller, robot = controller_of(arm), ss.drivers.Ideal(arm)
    strict = SupervisorSettings(
        state_age=10.0, command_age=10.0, approval_age=2.0, tracking_tolerance=0.001
    )  # in a period the reference of an arm at speed goes on by more than 1 mm
    with Supervisor(controller, strict) as supervisor:
        report = run(controller, robot, supervisor=supervisor)
    assert report.end == RunEnd.denied
    assert report.why.startswith("a command was not approved: joint '")
    assert "commanded position away from the arm" in report.why


def test_a_supervisor_ends_with_the_process_of_its_loop(arm: ss.Arm) -> None:
    """Its memory goes with it."""
    code = (
        "import os, sidestep as ss; from sidestep.loop import Supervisor\n"
        "arm = ss.Arm.load('planar3'); s = Supervisor(ss.Controller(arm)).__enter__()\n"
        "print(s.process, s.link.path, flush=True); os._exit(1)"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    process, memory = int(said.stdout.split()[0]), Path(said.stdout.split()[1])
    for _ in range(100):
        try:
            os.kill(process, 0)
        except ProcessLookupError:
            break
        if _state_of(process) == "Z":
            break
        time.sleep(0.1)
    else:
        pytest.fail("the supervisor still runs")
    assert not memory.exists()


def test_a_supervisor_of_another_controller_is_refused(arm: ss.Arm) -> None:
    controller = controller_of(arm)
    other = Supervisor(controller_of(arm))
    with pytest.raises(ValueError, match="supervisor is another controller's"):
        run(controller, ss.drivers.Ideal(arm), supervisor=other)


def test_a_supervisor_whose_process_ends_at_once_says_so(
    arm: ss.Arm, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(RuntimeError, match="its process ended at once, with exit status 1"):
        Supervisor(controller_of(arm)).__enter__()


def _state_of(process: int) -> str:
    try:
        with open(f"/proc/{process}/stat", encoding="ascii") as file:
            return file.read().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return "Z"
