"""Robots: URDF in, kinematic tree with links, limits, inertias and meshes out."""

from sidestep.robot.catalogue import RobotEntry, robots
from sidestep.robot.link import Geometry, Inertial, Link
from sidestep.robot.model import Robot
from sidestep.robot.planar import planar_arm
from sidestep.robot.srdf import read_srdf
from sidestep.robot.tip import tip_of

__all__ = [
    "Geometry",
    "Inertial",
    "Link",
    "Robot",
    "RobotEntry",
    "planar_arm",
    "read_srdf",
    "robots",
    "tip_of",
]
