"""Percentiles of many steps, by value."""

from __future__ import annotations

import numpy as np
import pytest

from sidestep.bench.step_times import StepTimes


def test_percentiles_match_numpy_and_add_up() -> None:
    times = np.random.default_rng(0).lognormal(-12.0, 0.5, size=20_000)
    whole, part = StepTimes(), StepTimes()
    whole.add(times[:5000])
    part.add(times[5000:])
    whole.merge(part)
    assert whole.total == len(times)
    found = whole.microseconds()
    for name, percent in {"median": 50, "p95": 95, "p99": 99, "p99.9": 99.9}.items():
        # 1 %: twice the width of a bin
        assert found[name] == pytest.approx(1e6 * np.percentile(times, percent), rel=1e-2)
    assert found["max"] == pytest.approx(1e6 * times.max(), abs=1e-3)  # written to 1 ns


def test_no_steps_have_no_percentiles() -> None:
    assert StepTimes().microseconds() == {
        "median": None,
        "p95": None,
        "p99": None,
        "p99.9": None,
        "max": None,
    }
