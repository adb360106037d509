"""Joint positions between samples."""

from __future__ import annotations

import numpy as np
import pytest

from sidestep.perception.joint_samples import JointSamples


def samples(max_gap: float = 0.5) -> JointSamples:
    """Given out of order; two samples at 1 s, of which the later one counts."""
    times = [1.0, 0.5, 1.0, 3.0]
    return JointSamples(("a", "b"), times, positions=[[9, 9], [0, 4], [2, 0], [5, 5]], max_gap=max_gap)


@pytest.mark.parametrize(
    ("time", "expected"),
    [
        (0.5, [0, 4]),
        (0.75, [1, 2]),
        (0.875, [1.5, 1]),
        (1.0, [2, 0]),
        (3.0, [5, 5]),
        (0.49, None),
        (3.01, None),
        (2.0, None),
    ],
)
def test_positions_are_linear_and_unknown_outside_and_in_gaps(
    time: float, expected: list[float] | None
) -> None:
    q = samples().at(time)
    assert (q if q is None else q.tolist()) == expected


def test_a_gap_is_bridged_up_to_its_longest() -> None:
    q = samples(max_gap=2.0).at(2.0)
    assert q is not None
    assert q.tolist() == [3.5, 2.5]


def test_no_samples_say_nothing_and_bad_ones_are_named() -> None:
    assert JointSamples((), [], positions=[], max_gap=1.0).at(0.0) is None
    with pytest.raises(ValueError, match=r"sample 1 is \[nan\] at 2.0 s, must be finite"):
        JointSamples(("a",), [1.0, 2.0], positions=np.array([[0.0], [np.nan]]), max_gap=1.0)
