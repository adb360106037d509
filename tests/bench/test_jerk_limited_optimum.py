"""The shortest motions with a limit of jerk, against closed forms and bounds."""

from types import SimpleNamespace

import numpy as np
import pytest

from sidestep.bench import jerk_limited_optimum as module
from sidestep.bench.executed_path import ExecutedPath
from sidestep.bench.jerk_limited_optimum import EXCESS, jerk_limited_optimum
from sidestep.bench.path_timing import topp_ra_timing


def seven_segments(way: float, velocity: float, acceleration: float, jerk: float) -> float:
    """The shortest time over a way from rest to rest: seven segments of constant jerk, some of them empty."""
    ramp = acceleration / jerk
    rise = (
        velocity / acceleration + ramp if velocity >= acceleration * ramp else 2.0 * np.sqrt(velocity / jerk)
    )
    if way >= velocity * rise:
        return way / velocity + rise
    if way >= 2.0 * acceleration * ramp**2:
        peak = 0.5 * acceleration * (np.sqrt(ramp**2 + 4.0 * way / acceleration) - ramp)
        return 2.0 * (peak / acceleration + ramp)
    return 4.0 * np.cbrt(way / (2.0 * jerk))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("velocity", "acceleration", "jerk"),
    [
        (1.0, 5.0, 50.0),  # velocity and acceleration saturate
        (1.0, 20.0, 20.0),  # velocity alone
        (9.0, 4.0, 50.0),  # acceleration alone
        (9.0, 50.0, 30.0),  # neither: four ramps
        (2.0, 10.0, 5000.0),  # a jerk limit as loose as the Panda's
    ],
)
@pytest.mark.parametrize("way", [1.0, 2.5])
def test_a_straight_line_takes_what_the_closed_form_says(
    way: float, velocity: float, acceleration: float, jerk: float
):
    q = np.linspace(0.0, way, 1000)[:, None]
    path = ExecutedPath.through(q)
    assert path is not None
    one = np.ones(1)
    limits = SimpleNamespace(velocity=velocity * one, acceleration=acceleration * one, jerk=jerk * one)
    found = jerk_limited_optimum(path, limits)
    assert found is not None
    exact = seven_segments(way, velocity, acceleration, jerk)
    # Never faster, but for the path's deviation; slower because jerk switches at nodes alone.
    assert -1e-3 < found.timing.duration / exact - 1.0 < 0.01
    assert found.excess <= EXCESS


@pytest.mark.parametrize("seed", range(4))
def test_no_motion_is_faster_than_without_the_limit_of_jerk_nor_breaks_one(seed: int):
    rng = np.random.default_rng(seed)
    s = np.linspace(0.0, 2.0, 2000)
    waves = rng.uniform(-0.4, 0.4, (3, 4))
    q = np.column_stack([s * rng.uniform(-1, 1) + wave @ np.sin(np.outer([1, 2, 3, 4], s)) for wave in waves])
    path = ExecutedPath.through(q)
    assert path is not None
    limits = SimpleNamespace(
        velocity=rng.uniform(1.0, 2.0, 3),
        acceleration=rng.uniform(4.0, 9.0, 3),
        jerk=rng.uniform(40.0, 400.0, 3),
    )
    found, fastest = jerk_limited_optimum(path, limits), topp_ra_timing(path, limits)
    assert found is not None
    assert fastest is not None
    assert found.timing.duration > fastest.duration
    # Derivatives of the sampled motion itself, rather than what the program says they are.
    timing = found.timing
    t = np.linspace(0.0, timing.duration, 20_001)
    k = np.minimum(np.searchsorted(timing.times, t, side="right") - 1, len(timing.h) - 1)
    after = t - timing.times[k]
    sigma = timing.sigma[k] + after * (timing.v[k] + after * (timing.a[k] / 2 + after * timing.u[k] / 6))
    motion, period = path(np.clip(sigma, 0.0, 1.0)), t[1]
    assert np.abs(motion[[0, -1]] - q[[0, -1]]).max() < 2e-3  # twice DEVIATION
    for order, limit in ((1, limits.velocity), (2, limits.acceleration)):
        assert np.abs(np.diff(motion, order, axis=0) / period**order / limit).max() < 1.0 + EXCESS
    coarse, step = motion[::10], 10 * period  # third differences of fine samples are rounding
    assert np.abs(np.diff(coarse, 3, axis=0) / step**3 / limits.jerk).max() < 1.0 + EXCESS


def test_a_program_that_does_not_converge_gives_none(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(module, "ITERATIONS", 2)
    path = ExecutedPath.through(np.linspace(0.0, 1.0, 500)[:, None] * np.ones(2))
    assert path is not None
    pair = np.ones(2)
    limits = SimpleNamespace(velocity=pair, acceleration=5.0 * pair, jerk=50.0 * pair)
    assert jerk_limited_optimum(path, limits) is None


def test_a_second_guess_is_tried(monkeypatch: pytest.MonkeyPatch):
    tried = []
    solve = module._solve

    def first_fails(path, limits, nodes, guess):
        tried.append(guess)
        return None if len(tried) == 1 else solve(path, limits, nodes, guess)

    monkeypatch.setattr(module, "_solve", first_fails)
    path = ExecutedPath.through(np.linspace(0.0, 1.0, 500)[:, None])
    assert path is not None
    one = np.ones(1)
    limits = SimpleNamespace(velocity=one, acceleration=5.0 * one, jerk=50.0 * one)
    assert jerk_limited_optimum(path, limits) is not None
    assert len(tried) == 2
