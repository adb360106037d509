"""Obstacles: points with radii and velocities, from arrays, shapes, meshes and point-cloud files."""

from sidestep._core import Obstacles
from sidestep.math.pose import pose_at
from sidestep.obstacles.cloud import load_point_cloud
from sidestep.obstacles.scene import obstacles_from_shapes
from sidestep.obstacles.voxels import merge_in_voxels
from sidestep.shapes import Box, Capsule, Cylinder, MeshShape, Plane, Shape, Sphere

__all__ = [
    "Box",
    "Capsule",
    "Cylinder",
    "MeshShape",
    "Obstacles",
    "Plane",
    "Shape",
    "Sphere",
    "load_point_cloud",
    "merge_in_voxels",
    "obstacles_from_shapes",
    "pose_at",
]
