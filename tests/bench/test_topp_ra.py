"""Time-optimal motions without a limit of jerk."""

from types import SimpleNamespace

import numpy as np
import pytest

from sidestep.bench.topp_ra import fastest_along


@pytest.mark.parametrize(("velocity", "expected"), [(5.0, 1.0), (1.0, 1.25)])
def test_a_straight_line_takes_what_the_closed_form_says(velocity: float, expected: float):
    """1 rad at 4 rad/s²: 2 √(1/4) s; at most 1 rad/s, 1 s and 0.25 s to get there and back."""
    limits = SimpleNamespace(velocity=np.array([velocity]), acceleration=np.array([4.0]))

    def line(s: np.ndarray, order: int) -> np.ndarray:
        return (np.asarray(s) if order == 0 else np.full(np.shape(s), float(order == 1)))[..., None]

    grid = np.linspace(0.0, 1.0, 1001)
    found = fastest_along(line, grid, limits)
    assert found is not None
    speed, _ = found
    duration = np.sum(2.0 * np.diff(grid) / (speed[1:] + speed[:-1]))
    assert duration == pytest.approx(expected, rel=1e-3)  # the grid
