"""Time stamps of a camera on the clock of the controller."""

from __future__ import annotations

import math
import time

import pytest

from sidestep.perception.device_clock import DeviceClock


@pytest.fixture
def clocks(monkeypatch: pytest.MonkeyPatch) -> dict[str, float]:
    """What the computer's clocks show [s]."""
    shown = {"monotonic": 500.0, "time": 1_700_000_000.0}
    for name in shown:
        monkeypatch.setattr(time, name, lambda name=name: shown[name])
    return shown


def test_a_stamp_of_the_computer_moves_by_the_offset_of_its_clocks(clocks: dict[str, float]) -> None:
    clock = DeviceClock(0.0)
    assert (clock.domain, math.isnan(clock.offset)) == ("", True)
    stamp = 1_700_000_000.0 - 0.125
    assert clock.captured(stamp, "global_time", arrival=500.0, since_exposure=0.0) == 499.875
    clocks["time"] += 3600.0  # somebody set the clock
    assert clock.captured(stamp + 3600.0, "global_time", arrival=500.0, since_exposure=0.0) == 499.875
    assert (clock.domain, clock.offset) == ("global_time", 500.0 - 1_700_003_600.0)


def test_the_exposure_counts_where_the_stamp_is_of_the_device(clocks: dict[str, float]) -> None:
    clock = DeviceClock(0.25)
    times = [
        clock.captured(clocks["time"], domain, arrival=500.0, since_exposure=0.5)
        for domain in ("global_time", "system_time")
    ]
    assert times == [499.25, 499.75]
    assert DeviceClock(0.25).captured(7.0, "hardware_clock", arrival=500.0, since_exposure=0.5) == 499.25


def test_the_offset_of_a_device_clock_is_the_least_delay_seen() -> None:
    clock = DeviceClock(0.0)
    delays = (0.5, 0.125, 0.75)  # of three images, stamped each second from 10 s on, when 100 s were shown
    times = [
        clock.captured(10.0 + i, "hardware_clock", arrival=100.0 + i + delay, since_exposure=0.0)
        for i, delay in enumerate(delays)
    ]
    assert times == [100.5, 101.125, 102.125]
    assert clock.offset == 90.125


def test_a_latency_that_is_no_number_is_refused() -> None:
    with pytest.raises(ValueError, match="latency is inf s, must be finite"):
        DeviceClock(math.inf)
