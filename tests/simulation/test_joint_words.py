"""Errors in words."""

import math

import pytest

from sidestep.simulation.joint_words import pose_in_words


@pytest.mark.parametrize(
    ("distance", "angle", "words"),
    [(1.2283, 0.97, "1228 mm and 56°"), (0.00042, math.radians(0.31), "0.4 mm and 0.3°")],
)
def test_a_pose_is_in_millimetres_and_degrees(distance: float, angle: float, words: str) -> None:
    assert pose_in_words(distance, angle) == words
