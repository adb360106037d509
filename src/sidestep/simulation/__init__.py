"""Physics, exact clearance, and what a run achieved."""

from sidestep.simulation.clearance import Clearance, ExactClearance, PathClearance
from sidestep.simulation.driver import ControllerDriver, Drive, Driver, SystemDriver
from sidestep.simulation.ellipsoid_clearance import EllipsoidClearance
from sidestep.simulation.evaluation import Evaluation, LimitViolations, evaluate
from sidestep.simulation.kinematic import run_kinematically
from sidestep.simulation.model import SimulationModel, build_model
from sidestep.simulation.run import Arrival, Contact, KinematicRun, Run, SimulationRun
from sidestep.simulation.scene import SceneObject, seen_obstacles
from sidestep.simulation.self_collision import SelfClearance, SelfCollision
from sidestep.simulation.simulation import Simulation

__all__ = [
    "Arrival",
    "Clearance",
    "Contact",
    "ControllerDriver",
    "Drive",
    "Driver",
    "EllipsoidClearance",
    "Evaluation",
    "ExactClearance",
    "KinematicRun",
    "LimitViolations",
    "PathClearance",
    "Run",
    "SceneObject",
    "SelfClearance",
    "SelfCollision",
    "Simulation",
    "SimulationModel",
    "SimulationRun",
    "SystemDriver",
    "build_model",
    "evaluate",
    "run_kinematically",
    "seen_obstacles",
]
