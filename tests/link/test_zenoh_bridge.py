"""The same client over Zenoh, on the loopback."""

from __future__ import annotations

import socket
import struct
import sys
import time
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import pytest

import sidestep as ss
from sidestep.link import ZenohBridge, link_version
from sidestep.link.core import link_magic
from support.programs import program
from support.served_arm import Served

zenoh = pytest.importorskip("zenoh")
GOAL = [0.4, 0.5, -0.3]


def free_endpoint() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


@pytest.fixture
def endpoint(served: Served) -> Iterator[str]:
    at = free_endpoint()
    with ZenohBridge(served.address, "planar", endpoint=at):
        yield at


def token(served: Served) -> str:
    return served.server.token_file.read_text().strip()


def looker(endpoint: str) -> Any:
    """A session of somebody else."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", f'["{endpoint}"]')
    config.insert_json5("scouting/multicast/enabled", "false")
    return zenoh.open(config)


def comes_true(condition: Callable[[], bool], *, within: float = 5.0) -> bool:
    """Whether a condition holds within so long [s]."""
    until = time.monotonic() + within
    while not (holds := condition()) and time.monotonic() < until:
        time.sleep(0.02)
    return holds


def test_a_client_moves_the_arm_over_zenoh(served: Served, endpoint: str) -> None:
    with ss.connect("zenoh/planar", token(served), endpoint=endpoint) as client:
        client.take_command()
        client.set_goal(GOAL)
        assert client.wait(ss.arrived, timeout=20.0)
        assert client.state().q == pytest.approx(GOAL, abs=0.01)  # [rad] ArrivalSettings
        with pytest.raises(ValueError, match="joint 'joint1' is 100"):
            client.set_goal([100.0, 0.0, 0.0])


def test_without_the_token_a_client_only_looks(served: Served, endpoint: str) -> None:
    with ss.connect("zenoh/planar", endpoint=endpoint) as visitor:
        assert visitor.state().q.shape == (3,)
        with pytest.raises(ValueError, match="needs the token"):
            visitor.take_command()


def test_a_client_that_is_killed_is_given_up(served: Served, endpoint: str) -> None:
    code = f"""
import sidestep as ss, time
client = ss.connect("zenoh/planar", {token(served)!r}, endpoint={endpoint!r}, name="lost")
client.take_command()
print("in command", flush=True)
time.sleep(60)
"""
    with program([sys.executable, "-c", code]) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "in command\n"
        with ss.connect(served.address) as watcher:
            assert any(one.name == "lost" and one.in_command for one in served.server.clients)
            process.kill()
            assert watcher.wait(
                lambda state: not any(one.name == "lost" for one in served.server.clients), timeout=10.0
            )


def test_whoever_listens_gets_cycles(served: Served, endpoint: str) -> None:
    with looker(endpoint) as session:
        cycles: list[Any] = []
        listener = session.declare_subscriber("sidestep/planar/cycle", cycles.append)
        assert comes_true(lambda: len(cycles) > 0)
        assert bytes(cycles[0].payload)[:4] == b"SDST"
        listener.undeclare()


def test_nobody_ends_the_cycles_of_others(served: Served, endpoint: str) -> None:
    cycles: list[Any] = []
    with looker(endpoint) as session:
        listener = session.declare_subscriber("sidestep/planar/cycle", cycles.append)
        assert comes_true(lambda: len(cycles) > 0)
        session.put("sidestep/planar/request/cycle", b"this is no message of Sidestep")
        with session.liveliness().declare_token("sidestep/planar/client/cycle"):
            pass
        # Whoever it was is refused and gone; the watcher of the bridge is not.
        assert comes_true(lambda: [one.name for one in served.server.clients] == ["zenoh"])
        count = len(cycles)
        assert comes_true(lambda: len(cycles) > count + 20)
        listener.undeclare()


def test_an_endpoint_in_use_is_a_connection_error(served: Served, endpoint: str) -> None:
    assert comes_true(lambda: [one.name for one in served.server.clients] == ["zenoh"])
    with pytest.raises(ConnectionError, match=f"Zenoh cannot listen at {endpoint}"):
        ZenohBridge(served.address, "second", endpoint=endpoint)
    assert comes_true(lambda: [one.name for one in served.server.clients] == ["zenoh"])


def test_a_request_that_comes_while_a_bridge_closes_leaves_nothing(served: Served) -> None:
    hello = struct.pack("<IHHIQII", link_magic, link_version, 16, 8, 1, 0, 0)
    bridge = ZenohBridge(served.address, "planar", endpoint=free_endpoint(), rate=0.0)

    def last_request() -> None:
        bridge._on_request(
            SimpleNamespace(key_expr="sidestep/planar/request/late", payload=hello),
        )
        assert comes_true(lambda: len(served.server.clients) == 1)

    bridge._declared.insert(0, SimpleNamespace(undeclare=last_request))
    bridge.close()
    assert comes_true(lambda: not served.server.clients)
    last = SimpleNamespace(key_expr="sidestep/planar/request/later", payload=hello)
    bridge._on_request(last)  # as Zenoh may still deliver one
    assert not comes_true(lambda: len(served.server.clients) > 0, within=0.3)


def test_nobody_there_is_a_connection_error(endpoint: str) -> None:
    with pytest.raises(ConnectionError, match="no arm is served as 'other'"):
        ss.connect("zenoh/other", endpoint=endpoint)
    with pytest.raises(ConnectionError, match="no Zenoh can be reached"):
        ss.connect("zenoh/planar", endpoint=free_endpoint())
    with pytest.raises(ValueError, match="name is 'a/b'"):
        ss.connect("zenoh/a/b")
    with pytest.raises(ConnectionError, match="nobody serves an arm at"):
        ZenohBridge("/nowhere/arm.sock", "planar", endpoint=free_endpoint())
