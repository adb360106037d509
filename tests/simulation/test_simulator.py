"""`Simulator`: the loop between a simulated robot and a port."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sidestep import Robot
from sidestep.simulation.link import Link
from sidestep.simulation.pace import Pace
from sidestep.simulation.simulated_robot import Mode, SimulatedRobot
from sidestep.simulation.simulator import Simulator

START = np.deg2rad([0.0, 45.0, 0.0, -66.0, 0.0, 66.0, 45.0])


@dataclass
class StubPort:
    """A port whose driver answers each state at once by what `answer` gives of it; None: nothing."""

    answer: Callable[[Any], np.ndarray | None]
    requests: list[Any] = field(default_factory=list)
    states: list[Any] = field(default_factory=list)
    objects: list[Any] = field(default_factory=list)
    stopped: list[str] = field(default_factory=list)
    sequence: int = 1

    def receive(self, timeout: float) -> Any:
        return self.requests.pop(0) if self.requests else None

    def send_state(self, cycle: int, time: float, **fields: Any) -> None:
        state = SimpleNamespace(cycle=cycle, time=time, **fields)
        self.states.append(state)
        if state.mode == Mode.controlled and (values := self.answer(state)) is not None:
            self.say("command", cycle=cycle, values=values)

    def send_objects(self, names: Any, poses: np.ndarray) -> None:
        self.objects.append((list(names), poses))

    def stop(self, words: str) -> None:
        self.stopped.append(words)

    def say(self, kind: str, **fields: Any) -> None:
        self.sequence += 1
        self.requests.append(
            SimpleNamespace(**{"kind": kind, "output": "torque", "sequence": self.sequence, **fields})
        )


def simulator_of(port: StubPort, *, speed: float = 0.0, **link: Any) -> Simulator:
    robot = SimulatedRobot(Robot.named("fr3_arm"), (), START)
    return Simulator(robot, port, link=Link(**link), speed=speed)


def test_asked_it_takes_each_answer_in_the_cycle_of_its_state() -> None:
    port = StubPort(answer=lambda state: np.full(7, 1e-3 * state.cycle))
    simulator = simulator_of(port)
    simulator.cycle()
    assert (simulator.robot.time, port.states[0].mode) == (0.0, Mode.waiting)
    port.say("start")
    for _ in range(40):
        simulator.cycle()
    controlled = [state for state in port.states if state.mode == Mode.controlled]
    assert [state.cycle for state in controlled] == list(range(1, 40))  # the start came in cycle 0
    # The state after the first command says that this moves it: number 3 was the first command.
    assert [state.taken for state in controlled[:3]] == [0, 3, 4]
    assert [state.taken_cycle for state in controlled[1:4]] == [1, 2, 3]
    assert simulator.to_dict()["lost_cycles"] == 0


def test_late_states_are_answered_late_and_losses_are_counted() -> None:
    port = StubPort(answer=lambda _: np.zeros(7))
    simulator = simulator_of(port, delay=(0.002, 0.002), loss=0.2, seed=2)
    port.say("start")
    for _ in range(400):
        simulator.cycle()
    assert simulator.robot.mode == Mode.controlled
    messages = simulator.to_dict()["messages"]
    assert messages["to_driver"]["lost"] == pytest.approx(80, abs=40)  # five standard deviations
    assert messages["to_robot"]["sent"] == pytest.approx(0.8 * 400, abs=45)
    assert simulator.to_dict()["lost_cycles"] > 50


def test_a_silent_driver_is_told_that_the_robot_has_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sidestep.simulation.simulator.PATIENCE", 0.0)
    port = StubPort(answer=lambda state: np.zeros(7) if state.cycle < 10 else None)
    simulator = simulator_of(port)
    port.say("start")
    for _ in range(60):
        simulator.cycle()
    assert port.stopped == ["no command for 20 cycles"]
    assert simulator.robot.mode == Mode.stopped
    port.answer = lambda _: np.zeros(7)
    port.say("start")
    for _ in range(30):
        simulator.cycle()
    assert simulator.robot.mode == Mode.controlled  # another start


@pytest.mark.parametrize("kind", ["stop", "gone"])
def test_who_stops_or_goes_lets_the_arm_rest(kind: str) -> None:
    port = StubPort(answer=lambda _: np.zeros(7))
    simulator = simulator_of(port)
    port.say("start")
    for _ in range(5):
        simulator.cycle()
    port.say(kind)
    simulator.cycle()
    assert simulator.robot.mode == Mode.resting
    assert port.stopped == []


def test_paced_it_keeps_the_machines_time() -> None:
    port = StubPort(answer=lambda _: np.zeros(7))
    simulator = simulator_of(port, speed=1.0)
    port.say("start")
    pace = Pace(1e-3)
    for _ in range(50):
        simulator.cycle()
    assert -pace.left() >= 0.045  # 50 cycles less the first and what is rounded


def test_a_pace_that_falls_far_behind_does_not_hurry() -> None:
    pace = Pace(0.001)
    pace._due -= 1.0
    pace.next()
    assert (pace.late, pace.slips) == (1, 1)
    assert 0.0 < pace.left() <= 0.001


def test_a_speed_that_cannot_be_is_named() -> None:
    with pytest.raises(ValueError, match="speed is -1"):
        simulator_of(StubPort(answer=lambda _: None), speed=-1.0)
