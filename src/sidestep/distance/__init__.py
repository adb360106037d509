"""Exact distances on meshes: the judge of every motion, apart from the ellipsoids the controller sees."""

from sidestep.distance.clearance import Clearance, ExactClearance, PathClearance
from sidestep.distance.ellipsoid_clearance import EllipsoidClearance
from sidestep.distance.scene import SceneObject, seen_obstacles
from sidestep.distance.self_collision import SelfClearance, SelfCollision

__all__ = [
    "Clearance",
    "EllipsoidClearance",
    "ExactClearance",
    "PathClearance",
    "SceneObject",
    "SelfClearance",
    "SelfCollision",
    "seen_obstacles",
]
