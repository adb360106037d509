"""Calls that may wait for a robot without end."""

import threading

import pytest

from sidestep.drivers.answer_within import answer_within


def test_it_returns_what_the_call_returns() -> None:
    assert answer_within(5.0, "the robot", divmod, 17, 5) == (3, 2)
    assert answer_within(5.0, "the robot", lambda: None) is None


def test_it_raises_what_the_call_raises() -> None:
    with pytest.raises(ValueError, match="invalid literal for int"):
        answer_within(5.0, "the robot", int, "no number")


def test_a_call_that_waits_is_left_alone() -> None:
    released = threading.Event()
    with pytest.raises(ConnectionError, match=r"^the robot did not answer within 0\.05 s$"):
        answer_within(0.05, "the robot", released.wait)
    released.set()
