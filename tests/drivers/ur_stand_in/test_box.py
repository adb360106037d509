"""The stand-in's box: programs, safety, dashboard and RTDE, without sockets."""

import struct

import numpy as np
import pytest

from sidestep import Arm
from sidestep.drivers.ur_stand_in.box import EMERGENCY, NORMAL, POWER_OFF, PROTECTIVE, RUNNING, Box
from sidestep.drivers.ur_stand_in.dashboard import Dashboard
from sidestep.drivers.ur_stand_in.program import NOTHING, READY, SPEED_J, STOP_J, STOP_SCRIPT, WATCHDOG
from sidestep.drivers.ur_stand_in.rtde import DATA, INPUTS, OUTPUTS, START, VERSION, RtdeClient

SCRIPT = "def rtde_control():\n  sync()\nend\n"
HOME = np.array([0.0, -1.6, 1.6, -1.6, -1.6, 0.0])


@pytest.fixture(scope="module")
def arm() -> Arm:
    return Arm.load("ur10")


@pytest.fixture
def said() -> list[str]:
    return []


@pytest.fixture
def box(arm: Arm, said: list[str]) -> Box:
    return Box(arm, HOME, period=0.002, unlock_after=0.1, log=said.append)


def run(box: Box, seconds: float) -> None:
    for _ in range(round(seconds / box.period)):
        box.step()


def command(box: Box, number: int, *values: float) -> None:
    box.registers.values["input_int_register_0"] = number
    for index, value in enumerate(values):
        box.registers.values[f"input_double_register_{index}"] = value
    box.registers.written = box.time


def test_a_program_is_ready_moves_and_ends(box: Box) -> None:
    box.run_script(SCRIPT)
    run(box, 0.01)
    assert box.playing
    assert box.registers.values["output_int_register_0"] == READY
    command(box, SPEED_J, 0.5, 0, 0, 0, 0, 0, 10.0)
    run(box, 0.1)
    assert box.value("actual_qd")[0] == pytest.approx(0.5, abs=1e-6)
    command(box, STOP_J, 5.0)
    run(box, 0.2)
    assert not box.value("target_qd").any()
    command(box, NOTHING)  # between two commands that are answered
    run(box, 0.01)
    command(box, STOP_SCRIPT)
    run(box, 0.01)
    assert not box.playing


def test_the_watchdog_ends_the_program_and_brakes(box: Box, said: list[str]) -> None:
    box.run_script(SCRIPT)
    command(box, WATCHDOG, 20.0)
    run(box, 0.01)
    command(box, SPEED_J, 0.5, 0, 0, 0, 0, 0, 10.0)
    run(box, 0.048)
    assert box.playing
    run(box, 0.01)
    assert not box.playing
    assert "the watchdog ended the program: no input for 52 ms, at most 50 ms are allowed" in said[1]
    run(box, 0.1)
    assert box.joints.resting


def test_what_it_does_not_know_is_an_error_of_the_program(box: Box, said: list[str]) -> None:
    box.run_script(SCRIPT)
    command(box, 77)
    run(box, 0.01)
    assert said[1] == "program error: command 77 is not known to the stand-in"
    assert not box.playing
    box.run_script("def mine():\nend\n")
    assert said[-1].startswith("script refused: not that of ur-rtde")


def test_a_protective_stop_holds_until_it_is_unlocked(box: Box, said: list[str]) -> None:
    dashboard = Dashboard(box, model="UR10", version="5.12.0.1")
    box.run_script(SCRIPT)
    box.protective_stop("a test")
    assert (box.safety, box.playing) == (PROTECTIVE, False)
    assert dashboard.answer("safetystatus") == "Safetystatus: PROTECTIVE_STOP"
    assert dashboard.answer("unlock protective stop").startswith(
        "Cannot unlock protective stop until 0.1s after"
    )
    box.run_script(SCRIPT)
    assert said[-1].startswith("script refused: PROTECTIVE_STOP")
    run(box, 0.11)
    assert dashboard.answer("unlock protective stop") == "Protective stop releasing"
    assert box.safety == NORMAL


def test_an_emergency_stop_switches_the_power_off(box: Box) -> None:
    dashboard = Dashboard(box, model="UR10", version="5.12.0.1")
    box.emergency_stop(True)
    assert box.safety == EMERGENCY
    box.emergency_stop(False)
    assert (box.safety, box.mode) == (NORMAL, POWER_OFF)
    assert [dashboard.answer(line) for line in ("power on", "brake release")] == [
        "Powering on",
        "Brake releasing",
    ]
    assert box.mode == RUNNING


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("get robot model", "UR10"),
        ("PolyscopeVersion", "URSoftware 5.12.0.1 (stand-in)"),
        ("is in remote control", "true"),
        ("stop", "Stopped"),
        ("dance", "could not understand: 'dance'"),
    ],
)
def test_the_dashboard_answers(box: Box, line: str, answer: str) -> None:
    assert Dashboard(box, model="UR10", version="5.12.0.1").answer(line) == answer


def package(kind: int, payload: bytes) -> bytes:
    return struct.pack(">HB", 3 + len(payload), kind) + payload


def test_rtde_sends_what_was_asked_for_and_takes_inputs(box: Box) -> None:
    client = RtdeClient(box, (5, 12, 0, 1))
    assert client.receive(package(VERSION, struct.pack(">H", 2))) == package(VERSION, b"\x01")
    asked = struct.pack(">d", 250.0) + b"timestamp,actual_q"
    assert client.receive(package(OUTPUTS, asked)) == package(OUTPUTS, b"\x01DOUBLE,VECTOR6D")
    inputs = package(INPUTS, b"input_int_register_0,input_double_register_0")
    assert client.receive(inputs[:5]) == b""  # packages may come in pieces
    assert client.receive(inputs[5:]) == package(INPUTS, b"\x01INT32,DOUBLE")
    assert client.package() == b""
    client.receive(package(START, b""))
    assert client.package() == b""  # every second period
    sent = struct.unpack(">HBB7d", client.package())
    assert sent[:3] == (60, DATA, 1)
    assert sent[3:] == (0.0, *HOME)
    client.receive(package(DATA, struct.pack(">Bid", 1, 9, 0.25)))
    assert box.registers.command == 9
    assert box.registers.doubles(1) == 0.25


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (struct.pack(">HB", 2, DATA), "a package of 2 bytes"),
        (struct.pack(">HB", 60000, DATA), "a package of 60000 bytes, allowed are 3 to 4096"),
        (package(ord("?"), b""), "a package of type 63"),
        (package(DATA, b"\x07"), "inputs by recipe 7, known are 1 to 0"),
        (package(OUTPUTS, struct.pack(">d", 125.0) + b"shoe_size"), "'shoe_size' is no variable"),
    ],
)
def test_what_is_not_rtde_is_refused(box: Box, data: bytes, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        RtdeClient(box, (5, 12, 0, 1)).receive(data)


def test_the_flange_is_where_a_ur10_says_it_is(box: Box) -> None:
    box.joints.position = np.zeros(6)
    # The manufacturer's Denavit-Hartenberg parameters of a UR10: a2 + a3, -d4 - d6, d1 - d5.
    expected = (-0.612 - 0.5723, -0.163941 - 0.0922, 0.1273 - 0.1157)
    np.testing.assert_allclose(
        box.value("actual_TCP_pose")[:3], expected, atol=1e-4
    )  # the digits of the description
