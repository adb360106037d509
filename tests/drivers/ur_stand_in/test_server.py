"""The stand-in as a process: who may connect, and what it does with clients that do not know its protocols."""

import os
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from sidestep import Arm
from sidestep.drivers.ur_stand_in.box import Box
from sidestep.drivers.ur_stand_in.process import StandInProcess
from sidestep.drivers.ur_stand_in.server import DASHBOARD, RTDE, SCRIPT, Server

ADDRESS = f"127.{171 + os.getpid() // 65000 % 50}.{os.getpid() // 255 % 255}.{1 + os.getpid() % 250}"


@pytest.fixture(scope="module")
def robot() -> Iterator[StandInProcess]:
    with StandInProcess("--address", ADDRESS, "--record", "--robot", "ur5", "--frequency", "125") as process:
        yield process


def connect(port: int) -> socket.socket:
    return socket.create_connection((ADDRESS, port), timeout=10.0)


def test_it_listens_on_this_machine_only() -> None:
    box = Box(Arm.load("ur5"), np.zeros(6), period=0.008, unlock_after=5.0, log=print)
    with pytest.raises(ValueError, match=r"addresses of this machine only \(127.x.x.x\), not at 0.0.0.0"):
        Server(box, address="0.0.0.0", model="UR5", version=(3, 15, 8, 0))


def test_a_box_that_is_behind_its_time_hears() -> None:
    address = ADDRESS.rpartition(".")[0] + ".254"
    box = Box(Arm.load("ur5"), np.zeros(6), period=0.002, unlock_after=5.0, log=print)
    reader, writer = os.pipe()  # the end of what is watched
    behind = threading.Event()

    def tick() -> None:
        time.sleep(2.0 * box.period)
        behind.set()

    with Server(box, address=address, model="UR5", version=(5, 12, 0, 0), on_tick=tick) as server:
        server.watched[reader] = lambda: False
        thread = threading.Thread(target=server.serve, daemon=True)
        thread.start()
        assert behind.wait(10.0)
        with socket.create_connection((address, DASHBOARD), timeout=10.0) as client:
            assert client.recv(100) == b"Connected: Universal Robots Dashboard Server\n"
        os.write(writer, b"x")
        thread.join(10.0)
        assert not thread.is_alive()
    assert box.time > 0.0
    for end in (reader, writer):
        os.close(end)


def test_the_dashboard_greets_and_answers_lines(robot: StandInProcess) -> None:
    with connect(DASHBOARD) as client, client.makefile("r") as lines:
        client.sendall(b"get robot ")
        client.sendall(b"model\nPolyscopeVersion\n")
        answers = [lines.readline() for _ in range(3)]
    assert answers[0] == "Connected: Universal Robots Dashboard Server\n"
    assert answers[1:] == ["UR5\n", "URSoftware 3.15.8.106339 (stand-in)\n"]


def says(robot: StandInProcess, words: str) -> bool:
    """Whether its log, which comes through a pipe, says so within a few seconds."""
    end = time.monotonic() + 10.0
    while time.monotonic() < end:
        if any(words in line for line in robot.log):
            return True
        time.sleep(0.02)
    return False


def test_what_is_not_rtde_is_dropped_and_others_are_served(robot: StandInProcess) -> None:
    with connect(RTDE) as client:
        client.sendall(b"GET / HTTP/1.1\r\n\r\n")
        assert client.recv(100) == b""
    assert says(robot, "a client is refused: a package of 18245 bytes")
    with connect(RTDE) as client:
        client.sendall(b"\x00\x05V\x00\x02")
        assert client.recv(100) == b"\x00\x04V\x01"


def test_a_script_that_has_no_end_is_dropped(robot: StandInProcess) -> None:
    with connect(SCRIPT) as client:
        try:
            for _ in range(40):
                client.sendall(b"#" * 65536)
            assert client.recv(100) == b""
        except (ConnectionResetError, BrokenPipeError):
            pass
    assert says(robot, "a script without an end")


def test_what_the_joints_did_is_in_a_file(robot: StandInProcess, tmp_path: Path) -> None:
    robot.save(tmp_path / "first.npz")
    robot.save(tmp_path / "moved.npz")
    moved = np.load(tmp_path / "first.npz")
    assert len(moved["position"]) > len(np.load(tmp_path / "moved.npz")["position"])  # begun anew
    np.testing.assert_array_equal(moved["position"][-1], [0.0, -1.6, 1.6, -1.6, -1.6, 0.0])
    assert not moved["playing"].any()


def test_what_it_cannot_do_is_said_at_once(robot: StandInProcess) -> None:
    with pytest.raises(RuntimeError, match="Address already in use"):
        StandInProcess("--address", ADDRESS)
    robot.say("dance")
    assert robot.tell()["mode"] == "RUNNING"
    assert "'dance' is unknown; help lists what is known" in robot.log
