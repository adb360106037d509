"""Shapes: the kinds of solids, each in one file that says what obstacles, links, judge and physics ask of it."""

from sidestep.shapes.box import Box
from sidestep.shapes.capsule import Capsule
from sidestep.shapes.cylinder import Cylinder
from sidestep.shapes.mesh import MeshShape, Triangles
from sidestep.shapes.plane import Plane
from sidestep.shapes.shape import FINE, KINDS, Fineness, Shape, is_shape, kind_of, metres, register
from sidestep.shapes.sphere import Sphere

for kind in (Sphere, Box, Cylinder, Capsule, Plane, MeshShape):
    register(kind)

__all__ = [
    "FINE",
    "KINDS",
    "Box",
    "Capsule",
    "Cylinder",
    "Fineness",
    "MeshShape",
    "Plane",
    "Shape",
    "Sphere",
    "Triangles",
    "is_shape",
    "kind_of",
    "metres",
    "register",
]
