"""Sidestep: reactive whole-arm obstacle avoidance on the curved configuration space of a manipulator."""

import importlib
from typing import TYPE_CHECKING

from sidestep._core import __version__

if TYPE_CHECKING:  # what type checkers and editors see; at run time a name is imported on first use
    from sidestep.body import Body as Body
    from sidestep.control import Limit as Limit
    from sidestep.control import TorqueController as TorqueController
    from sidestep.control import TorqueFault as TorqueFault
    from sidestep.control import TorqueSolution as TorqueSolution
    from sidestep.control import TorqueStatus as TorqueStatus
    from sidestep.control import acceleration_bounds as acceleration_bounds
    from sidestep.robot import Geometry as Geometry
    from sidestep.robot import Inertial as Inertial
    from sidestep.robot import Link as Link
    from sidestep.robot import Robot as Robot
    from sidestep.robot import planar_arm as planar_arm
    from sidestep.robot import robots as robots
    from sidestep.scenario import Scenario as Scenario
    from sidestep.scenario import ScenarioError as ScenarioError
    from sidestep.scenario import shipped_scenarios as shipped_scenarios
    from sidestep.simulation import Arrival as Arrival
    from sidestep.simulation import Evaluation as Evaluation
    from sidestep.simulation import ExactClearance as ExactClearance
    from sidestep.simulation import KinematicRun as KinematicRun
    from sidestep.simulation import SceneObject as SceneObject
    from sidestep.simulation import Simulation as Simulation
    from sidestep.simulation import SimulationRun as SimulationRun
    from sidestep.simulation import evaluate as evaluate
    from sidestep.simulation import run_kinematically as run_kinematically

# A public name and the module it comes from. Loaded on first use, so that the command line starts at once.
_EXPORTS: dict[str, str] = {
    "run_kinematically": "sidestep.simulation",
    "evaluate": "sidestep.simulation",
    "SimulationRun": "sidestep.simulation",
    "Simulation": "sidestep.simulation",
    "SceneObject": "sidestep.simulation",
    "KinematicRun": "sidestep.simulation",
    "ExactClearance": "sidestep.simulation",
    "Evaluation": "sidestep.simulation",
    "Arrival": "sidestep.simulation",
    "Limit": "sidestep.control",
    "TorqueController": "sidestep.control",
    "TorqueFault": "sidestep.control",
    "TorqueSolution": "sidestep.control",
    "TorqueStatus": "sidestep.control",
    "acceleration_bounds": "sidestep.control",
    "Body": "sidestep.body",
    "Geometry": "sidestep.robot",
    "Inertial": "sidestep.robot",
    "Link": "sidestep.robot",
    "Robot": "sidestep.robot",
    "Scenario": "sidestep.scenario",
    "ScenarioError": "sidestep.scenario",
    "planar_arm": "sidestep.robot",
    "robots": "sidestep.robot",
    "shipped_scenarios": "sidestep.scenario",
}

__all__ = [
    "Arrival",
    "Body",
    "Evaluation",
    "ExactClearance",
    "Geometry",
    "Inertial",
    "KinematicRun",
    "Limit",
    "Link",
    "Robot",
    "Scenario",
    "ScenarioError",
    "SceneObject",
    "Simulation",
    "SimulationRun",
    "TorqueController",
    "TorqueFault",
    "TorqueSolution",
    "TorqueStatus",
    "__version__",
    "acceleration_bounds",
    "evaluate",
    "planar_arm",
    "robots",
    "run_kinematically",
    "shipped_scenarios",
]


def __getattr__(name: str) -> object:
    if name not in _EXPORTS:
        raise AttributeError(f"module 'sidestep' has no attribute {name!r}")
    value = getattr(importlib.import_module(_EXPORTS[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(set(globals()) | set(_EXPORTS))
