"""Upper bounds of what one call records and of its threads."""

import numpy as np
import pytest

import sidestep as ss
from sidestep import thesis
from sidestep._core import QuadraticProgram
from sidestep.control import SafetySettings
from sidestep.controller import controller_settings_fields
from sidestep.planning import PlannerSettings
from sidestep.system import GeometricSystem


@pytest.fixture(scope="module")
def system() -> GeometricSystem:
    return GeometricSystem([], robot=ss.Robot.named("planar2"))


Q = np.zeros((3, 2))


@pytest.mark.parametrize("steps", [2**31 - 1, 2**31 - 2, 200_000_000])
def test_records_that_would_be_too_large_are_refused(system, steps):
    none = ss.Obstacles.none()
    with pytest.raises(ValueError, match=f"steps is {steps}, must be at most .* for 1 motions"):
        thesis.rollout(system, Q[0], Q[0], Q[0], none, steps=steps)
    with pytest.raises(ValueError, match=f"steps is {steps}, must be at most .* for 3 motions"):
        thesis.rollout_batch(system, Q, Q, Q, none, steps=steps)


def test_motions_count_together(system):
    none, many = ss.Obstacles.none(), np.zeros((100_000, 2))
    with pytest.raises(ValueError, match=r"steps is 10000, must be at most .* for 100000 motions"):
        thesis.rollout_batch(system, many, many, many, none, steps=10_000)


@pytest.mark.parametrize("threads", [-1, 1025, 2**31 - 1])
def test_threads_are_bounded(system, threads):
    message = f"threads is {threads}, must be from 0 to 1024"
    with pytest.raises(ValueError, match=message):
        thesis.rollout_batch(system, Q, Q, Q, ss.Obstacles.none(), steps=2, threads=threads)


def test_rows_nodes_and_programs_have_an_upper_bound():
    with pytest.raises(ValueError, match="max_rows is 100000, allowed: 1 to 256"):
        SafetySettings(max_rows=100_000)
    assert SafetySettings(max_rows=256).max_rows == 256
    with pytest.raises(ValueError, match="max_nodes is 2147483647, allowed: 2 to 1000000"):
        PlannerSettings(max_nodes=2**31 - 1)
    stated = {field["name"]: field["most"] for field in controller_settings_fields()}
    nodes = int(stated["planner.search.max_nodes"])  # what the controller states, its planner takes
    assert PlannerSettings(max_nodes=nodes).max_nodes == nodes
    with pytest.raises(ValueError, match="a size is 100000, must be at most 4096"):
        QuadraticProgram(100_000)
