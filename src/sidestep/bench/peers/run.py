"""Runs every way and compares its times with those of the core."""

from __future__ import annotations

import platform
from collections.abc import Callable
from typing import Any

import numpy as np

from sidestep._core import __version__, instruction_set
from sidestep.bench.peers.distances import distance_ways
from sidestep.bench.peers.table import table_ways
from sidestep.bench.peers.way import PeerSettings, States, Way, times_of
from sidestep.bench.peers.whole_arm import BALLS, whole_arm_ways
from sidestep.bench.step import cpu_model


def run_peers(settings: PeerSettings, *, progress: Callable[[str], None] | None = None) -> dict[str, Any]:
    """Times every way and returns a document for JSON; ratios are to the first way of a group, in C++.

    Raises:
        RuntimeError: a way that should give the accelerations of the first one does not.
    """
    groups = []
    for name, make in (
        ("Table 6.1, 7 joints", table_ways),
        (f"whole arm, {BALLS} balls", whole_arm_ways),
        (f"distances of the arm, {BALLS} balls", distance_ways),
    ):
        states, ways = make(settings)
        rows = []
        for way in ways:
            if progress is not None:
                progress(f"{name}: {way.name}")
            rows.append({"name": way.name, "work": way.work, **_measure(way, states, settings.seconds)})
        for row in rows:
            if "median_us" in row:
                row["times_slower"] = row["median_us"] / rows[0]["median_us"]
        groups.append({"name": name, "rows": rows})
    return {
        "benchmark": "peers",
        "version": __version__,
        "cpu": cpu_model(),
        "instruction_set": instruction_set(),
        "python": platform.python_version(),
        "seconds": settings.seconds,
        "groups": groups,
    }


def _measure(way: Way, states: States, seconds: float) -> dict[str, Any]:
    if way.missing:
        return {"missing": way.missing}
    times = way.measured() if way.measured is not None else times_of(way, states, seconds)
    quantiles = np.quantile(times, (0.5, 0.99))
    return {"calls": len(times), "median_us": float(quantiles[0]), "p99_us": float(quantiles[1])}
