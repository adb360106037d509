"""`Channel`: what is late, lost and overtaken, in simulated time."""

from __future__ import annotations

import numpy as np
import pytest

from sidestep.simulation.channel import DRAWN_EVERY, Channel
from sidestep.simulation.link import Link

PERIOD = 1e-3


def passed(link: Link, count: int, direction: int = 0) -> tuple[Channel[int], list[tuple[int, int]]]:
    """Message k leaves in cycle k; (cycle, message) of what arrives."""
    channel: Channel[int] = Channel(link, direction)
    arrived = []
    for k in range(count):
        channel.send(k, k * PERIOD)
        message = channel.arrived(k * PERIOD)
        if message is not None:
            arrived.append((k, message))
    return channel, arrived


def test_without_delay_each_message_arrives_in_its_cycle() -> None:
    channel, arrived = passed(Link(), 500)
    assert arrived == [(k, k) for k in range(500)]
    assert (channel.sent, channel.lost, channel.overtaken) == (500, 0, 0)


def test_a_fixed_delay_moves_all_messages() -> None:
    assert passed(Link(delay=(0.003, 0.003)), 100)[1] == [(k, k - 3) for k in range(3, 100)]


def test_delays_stay_in_their_range_and_change_once_a_second() -> None:
    count = 5000
    _, arrived = passed(Link(delay=(0.001, 0.005), seed=3), count)
    late = np.array([k - message for k, message in arrived])
    assert late.min() >= 1
    assert late.max() <= 6  # the cycle after 5 ms
    each = round(DRAWN_EVERY / PERIOD)
    middles = [set(late[k * each + 10 : (k + 1) * each - 10]) for k in range(count // each)]
    assert all(len(values) <= 2 for values in middles)  # one delay, rounded up to cycles
    assert len(set(map(frozenset, middles))) > 1


def test_the_share_that_is_lost_and_the_mean_of_the_jitter() -> None:
    count = 20_000
    channel, arrived = passed(Link(loss=0.1, jitter=0.002, seed=1), count)
    # five standard deviations of a binomial share
    assert channel.lost / count == pytest.approx(0.1, abs=5 * np.sqrt(0.1 * 0.9 / count))
    assert channel.lost + channel.overtaken + len(arrived) <= count
    assert channel.overtaken > 0
    messages = [message for _, message in arrived]
    assert messages == sorted(set(messages))  # never an old one after a new one


def test_the_same_seed_repeats_and_directions_differ() -> None:
    link = Link(delay=(0.001, 0.005), jitter=0.001, loss=0.1, seed=7)
    assert passed(link, 1000)[1] == passed(link, 1000)[1]
    assert passed(link, 1000, 0)[1] != passed(link, 1000, 1)[1]


def test_what_is_forgotten_never_arrives() -> None:
    channel: Channel[int] = Channel(Link(delay=(0.002, 0.002)), 0)
    channel.send(0, 0.0)
    channel.clear()
    assert channel.arrived(1.0) is None


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"delay": (0.005, 0.001)}, "delay is"),
        ({"delay": (-0.001, 0.0)}, "delay is"),
        ({"jitter": float("nan")}, "jitter is nan"),
        ({"loss": 1.0}, "loss is 1.0"),
        ({"seed": -1}, "seed is -1"),
    ],
)
def test_values_out_of_range_are_named(values: dict, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        Link(**values)
