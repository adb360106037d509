"""Times of other software: what is measured, what is missing, and that peers compute the same."""

import importlib.util
import sys

import numpy as np
import pytest

from sidestep.bench import PeerSettings, run_peers
from sidestep.bench.peers import dense_analytic

OPTIONAL = {"torch.autograd": "torch", "JAX, jitted": "jax", "CBFpy": "cbfpy"}


@pytest.fixture(scope="module")
def document():
    return run_peers(PeerSettings(seconds=0.05))


@pytest.mark.slow
def test_every_way_is_measured_or_said_to_be_missing(document):
    assert [len(group["rows"]) for group in document["groups"]] == [5, 4, 2]
    for row in (row for group in document["groups"] for row in group["rows"]):
        module = OPTIONAL.get(row["name"])
        if row["name"] == "fabrics":
            assert "--fabrics" in row["missing"]
        elif module is not None and importlib.util.find_spec(module) is None:
            assert row["missing"] == f"{module} is not installed"
        else:
            assert 0.0 < row["median_us"] <= row["p99_us"]
            assert row["calls"] >= 3


def test_ratios_are_to_the_core_in_the_same_group(document):
    for group in document["groups"]:
        first, *others = group["rows"]
        assert first["times_slower"] == 1.0
        for row in others:
            if "missing" not in row:
                assert row["times_slower"] == pytest.approx(row["median_us"] / first["median_us"])


def test_an_acceleration_that_differs_is_an_error(monkeypatch):
    def wrong(chain, q, v, goal, point, *, stiffness, damping):
        return np.zeros_like(q)

    monkeypatch.setattr(dense_analytic, "acceleration", wrong)
    with pytest.raises(RuntimeError, match="NumPy, dense analytic: the acceleration is"):
        run_peers(PeerSettings(seconds=0.05))


def test_settings_are_checked():
    with pytest.raises(ValueError, match=r"seconds is 0\.0, must be positive"):
        PeerSettings(seconds=0.0)


def test_an_interpreter_without_fabrics_is_named():
    if importlib.util.find_spec("fabrics") is not None:
        pytest.skip("fabrics is installed here")
    with pytest.raises(RuntimeError, match=f"fabrics, by {sys.executable}: .*No module named"):
        run_peers(PeerSettings(seconds=0.05, fabrics=sys.executable))
