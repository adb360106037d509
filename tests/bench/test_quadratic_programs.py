"""Solvers of quadratic programs side by side: what is measured, what is missing, and that minimisers are compared."""

import importlib.util

import numpy as np
import pytest

from sidestep.bench import QuadraticProgramSettings, quadratic_programs, run_quadratic_programs

OPTIONAL = {"DAQP": "daqp", "PIQP": "piqp", "ProxQP": "proxsuite"}


def test_every_solver_is_measured_or_said_to_be_missing():
    document = run_quadratic_programs(QuadraticProgramSettings(programs=100))
    assert 0 < document["constrained"] < document["programs"]
    assert document["programs"] % 100 == 0  # whole motions
    assert document["step_median_us"] > 0.0
    for row in document["rows"]:
        module = OPTIONAL.get(row["name"])
        if module is not None and importlib.util.find_spec(module) is None:
            assert row["missing"] == f"{module} is not installed"
            continue
        assert row["wrong"] <= 0.01 * document["programs"]
        for part in ("all", "constrained"):
            assert 0.0 < row[part]["median_us"] <= row[part]["p99_us"] <= row[part]["max_us"]
    core = document["rows"][0]
    assert (core["name"], core["wrong"], core["times_slower"]) == ("Sidestep", 0, 1.0)


def test_minimisers_that_differ_are_counted(monkeypatch):
    core = quadratic_programs._SOLVERS[0]

    def shifted(program):
        x, seconds = core.solve(program)
        return x + 1e-3 * (1.0 + np.abs(x).max()), seconds

    def gives_up(program):
        return None, 1e-6

    solvers = [core, *(quadratic_programs._Solver(f.__name__, "", None, f) for f in (shifted, gives_up))]
    monkeypatch.setattr(quadratic_programs, "_SOLVERS", solvers)
    document = run_quadratic_programs(QuadraticProgramSettings(programs=100))
    assert [row["wrong"] for row in document["rows"]] == [0, document["programs"], document["programs"]]


def test_settings_are_checked():
    with pytest.raises(ValueError, match="programs is 0, must be at least 1"):
        QuadraticProgramSettings(programs=0)
