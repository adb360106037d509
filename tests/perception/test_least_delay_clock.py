"""A device's stamps on the machine's clock."""

import pytest

from sidestep.perception.least_delay_clock import WINDOW, LeastDelayClock


def test_the_least_delayed_sample_gives_the_offset() -> None:
    clock = LeastDelayClock()
    assert clock.measured(10.0, arrival=110.004) == pytest.approx(110.004)
    assert clock.measured(10.1, arrival=110.101) == pytest.approx(110.101)  # 3 ms sooner
    assert clock.measured(10.2, arrival=110.250) == pytest.approx(110.201)  # 49 ms late, and known to be
    assert clock.offset == pytest.approx(100.001)


def test_it_follows_a_clock_that_drifts() -> None:
    clock, drift = LeastDelayClock(), 1e-3
    for number in range(100_000):
        stamp = number * 0.002
        time = clock.measured(stamp, arrival=50.0 + stamp * (1.0 + drift))
    # The least of up to two windows ago; without forgetting it were 200 ms.
    assert 50.0 + stamp * (1.0 + drift) - time == pytest.approx(0.0, abs=2.0 * WINDOW * drift)


def test_a_sample_that_comes_after_a_newer_one_keeps_the_offset() -> None:
    clock = LeastDelayClock()
    clock.measured(10.0, arrival=110.0)
    assert clock.measured(9.9, arrival=110.1) == pytest.approx(109.9)


def test_a_device_that_begins_anew_is_a_new_clock() -> None:
    clock = LeastDelayClock()
    clock.measured(1000.0, arrival=2000.0)
    assert clock.measured(0.5, arrival=2003.0) == pytest.approx(2003.0)
