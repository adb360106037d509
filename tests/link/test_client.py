"""A client in Python: the Controller's methods, its errors as ValueError, and who is in command."""

from __future__ import annotations

import gc
import signal
import stat
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import sidestep as ss
from sidestep.link import Client, ConnectionLost, Server
from support.programs import program
from support.served_arm import Served

GOAL = np.array([0.4, 0.5, -0.3])
ARRIVED = 0.01  # [rad] ArrivalSettings


def at(x: float) -> np.ndarray:
    pose = np.eye(4)
    pose[0, 3] = x
    return pose


def test_a_client_moves_the_arm(served: Served) -> None:
    with ss.connect(served.address) as client:
        client.take_command()
        client.set_goal(GOAL)
        assert client.in_command
        assert client.wait(ss.arrived, timeout=20.0)
        assert client.state().q == pytest.approx(GOAL, abs=ARRIVED)
        assert client.command().activity == ss.Activity.arrived
        assert "arriv" in client.explain()
        client.set_goal(-GOAL)
        assert client.wait(lambda state: bool(state.q[0] < 0.0), timeout=20.0)
        assert (client.arm, client.joints, client.cameras) == (
            "planar3",
            served.controller.arm.robot.coordinate_names,
            ["front"],
        )


def test_cycles_come_at_the_rate_that_was_asked_for(served: Served) -> None:
    with ss.connect(served.address, rate=0.0) as client:
        assert client.next_cycle(timeout=0.05) is None
        client.subscribe(np.inf)
        first = client.next_cycle()
        assert first is not None
        second = client.next_cycle(after=first.number)
        assert second is not None
        assert second.number > first.number
        assert second.time > first.time
        assert second.command.position.shape == (3,)


def test_all_requests_reach_the_controller(served: Served) -> None:
    with ss.connect(served.address) as client:
        client.take_command()
        client.set_velocity([0.1, 0.0, 0.0])
        assert client.wait(lambda state: bool(state.v[0] > 0.05), timeout=10.0)
        client.set_twist(client.frames[-1], [0.0, 0.1, 0.0, 0.0, 0.0, 0.0], free="rotation")
        client.clear_goal()
        assert client.wait(lambda state: bool(abs(state.v).max() < 1e-3), timeout=10.0)
        q = client.state().q
        client.set_trajectory([q, q + 0.1], [0.5, 1.5])
        client.set_goal(
            ss.PoseGoal(served.controller.arm.robot, client.frames[-1], [0.5, 0.3, 0.0], position_only=True)
        )
        client.restart()
        client.pause()
        client.resume()
        client.set_obstacles([ss.Sphere(0.1, pose=at(5.0), name="ball")], "tracker", valid_for=np.inf)
        client.add_obstacle(ss.Sphere(0.1, pose=at(6.0), name="other"), "tracker")
        client.move_obstacle("ball", np.eye(4), "tracker", valid_for=np.inf)
        client.remove_obstacle("other", "tracker")
        client.remove_obstacles("tracker")
        client.expect_obstacles("side")
        assert client.wait(
            lambda state: "'side' was expected and has not come yet" in client.explain(), timeout=10.0
        )
        client.remove_obstacles("side")
        client.stop_run("a test")
        assert served.server.take_stop() == f"{served.server.clients[0].name} asked for it: a test"


def test_refusals_are_value_errors_in_the_controllers_words(served: Served) -> None:
    with ss.connect(served.address) as client:
        with pytest.raises(ValueError, match="nobody is in command"):
            client.set_goal(GOAL)
        client.take_command()
        with pytest.raises(ValueError, match="joint 'joint1' is 100"):
            client.set_goal([100.0, 0.0, 0.0])
        with pytest.raises(ValueError, match="there is no source 'nobody'"):
            client.remove_obstacles("nobody")
        with pytest.raises(ValueError, match="source"):
            client.expect_obstacles("")
        with pytest.raises(TypeError, match="until is 3"):
            client.wait(3)  # type: ignore[arg-type]
        with pytest.warns(RuntimeWarning, match="rad/s"):
            client.set_velocity([80.0, 0.0, 0.0])


def told(client: Client, words: str, within: float = 5.0) -> list[str]:
    """The notices until one has these words, or the time [s] is over."""
    until = time.monotonic() + within
    said: list[str] = []
    while time.monotonic() < until and not any(words in one for one in said):
        client.ping()
        said += client.notices()
    return said


def test_images_are_taken_and_what_is_wrong_is_told(served: Served) -> None:
    depth = np.full((3, 4), 1000, np.uint16)
    with ss.connect(served.address) as client:
        client.next_cycle()
        client.update("front", depth, time=time.monotonic())
        with pytest.raises(ValueError, match="there is no camera 'back', there are: 'front'"):
            client.update("back", depth, time=1.0)
        with pytest.raises(ValueError, match="has 4 × 3 pixels, not 3 × 4"):
            client.update("front", depth.T, time=1.0)
        client.update("front", depth, time=1e6)  # in the future
        said = told(client, "was not used")
        assert any("was not used" in one for one in said), said


def test_an_image_that_shows_nothing_is_told_as_such(served: Served) -> None:
    with ss.connect(served.address) as client:
        client.next_cycle()
        client.update("front", np.zeros((3, 4), np.uint16), time=time.monotonic())
        said = told(client, "camera 'front' sees nothing")
        assert any("camera 'front' sees nothing" in one for one in said), said


def test_who_waits_is_told_of_a_command_that_was_lost(served: Served) -> None:
    with ss.connect(served.address) as planner, ss.connect(served.address) as joystick:

        def take(number: int, frame: object) -> None:  # where the wait looks for signals
            joystick.take_command(force=True)
            while planner.in_command:
                planner.ping()

        planner.take_command()
        before = signal.signal(signal.SIGALRM, take)
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        try:
            with pytest.raises(RuntimeError, match="this client is in command no more"):
                planner.wait(ss.arrived, timeout=2.0)
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before)


def test_two_clients_hand_over(served: Served) -> None:
    with (
        ss.connect(served.address, name="planner") as planner,
        ss.connect(served.address, name="joystick") as joystick,
    ):
        planner.take_command()
        with pytest.raises(ValueError, match="planner is in command"):
            joystick.take_command()
        joystick.take_command(force=True)
        planner.ping()
        assert not planner.in_command
        assert "joystick has taken it by force" in planner.notices()
        joystick.release_command()
        planner.take_command()
        assert planner.in_command


def test_without_the_token_a_client_only_looks(served: Served) -> None:
    with ss.connect(served.address, "") as visitor:
        assert not visitor.may_command
        assert visitor.state().q.shape == (3,)
        with pytest.raises(ValueError, match="needs the token"):
            visitor.take_command()
    with pytest.raises(ValueError, match="the token is wrong"):
        ss.connect(served.address, "guess")
    assert stat.S_IMODE(served.server.token_file.stat().st_mode) == 0o600


def test_a_client_that_is_killed_leaves_the_arm_at_rest(served: Served) -> None:
    code = f"""
import sidestep as ss, time
client = ss.connect({served.address!r})
client.take_command()
client.set_goal({GOAL.tolist()})
print("moves", flush=True)
time.sleep(60)
"""
    with program([sys.executable, "-c", code]) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "moves\n"
        process.kill()
        with ss.connect(served.address) as watcher:
            assert watcher.wait(lambda state: bool(abs(state.v).max() < 1e-3), timeout=10.0)
            assert watcher.wait(lambda state: watcher.command().activity == ss.Activity.no_goal, timeout=10.0)
            watcher.take_command()


def test_a_server_that_is_gone_is_a_connection_error(tmp_path: Path) -> None:
    controller = ss.Controller(ss.Arm.load("planar3"))
    address = str(tmp_path / "arm.sock")
    with pytest.raises(ConnectionError, match="nobody serves an arm at unix:"):
        ss.connect(address)
    server = Server(controller, address)
    client = ss.connect(address)
    with pytest.raises(RuntimeError, match="no cycle has come yet"):
        Client(server.address, rate=0.0, timeout=0.1).state()
    with pytest.raises(OSError, match=r"another program listens|in use"):
        Server(controller, address)
    del server
    gc.collect()
    with pytest.raises(ConnectionLost, match=r"the server ends|closed"):
        client.ping()


@pytest.mark.parametrize("address", ["tcp:0.0.0.0:5", "tcp:x", "a b", "tcp:10.0.0.1:9"])
def test_an_address_that_is_none_is_refused(address: str) -> None:
    with pytest.raises(ValueError, match="allowed are a name such as arm"):
        ss.connect(address)


def test_a_port_of_the_loopback_serves_as_well() -> None:
    controller = ss.Controller(ss.Arm.load("planar3"))
    server = Server(controller, "tcp:0")
    with ss.connect(server.address) as client:
        assert client.may_command
        assert client.ping() < 1.0
