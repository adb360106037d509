"""The points that `sidestep bench step` puts around an arm."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sidestep._core import Obstacles

Array = npt.NDArray[np.float64]

REACH = (0.4, 1.2)  # [m] inner and outer radius of the shell that uniform points fill
TABLE_HEIGHT = 0.05  # [m]
TABLE = ((0.25, -0.6), (1.05, 0.6))  # [m] corners (x, y) of the table top
BOXES = (  # [m] centre (x, y) and size (x, y, z) of what stands on it
    ((0.45, 0.35), (0.12, 0.18, 0.20)),
    ((0.70, -0.30), (0.20, 0.14, 0.12)),
    ((0.55, 0.02), (0.08, 0.08, 0.25)),
    ((0.85, 0.25), (0.10, 0.30, 0.10)),
)
NOISE = 0.001  # [m] standard deviation of a depth camera at 1 m


def uniform_cloud(num: int, rng: np.random.Generator) -> Obstacles:
    """`num` points, uniform in the shell of the arm's workspace above the floor."""
    inner, outer = REACH
    points = np.empty((0, 3))
    while len(points) < num:
        drawn = rng.uniform((-outer, -outer, 0.0), outer, size=(2 * num + 16, 3))
        radius = np.linalg.norm(drawn, axis=1)
        points = np.concatenate([points, drawn[(radius > inner) & (radius < outer)]])
    return Obstacles(points[:num])


def table_cloud(num: int, rng: np.random.Generator) -> Obstacles:
    """`num` points as a camera sees a table with boxes on it: on the upper and side faces, with noise."""
    (x0, y0), (x1, y1) = TABLE
    faces = [(np.array([x0, y0, TABLE_HEIGHT]), np.array([x1 - x0, 0.0, 0.0]), np.array([0.0, y1 - y0, 0.0]))]
    for (x, y), (dx, dy, dz) in BOXES:
        low = np.array([x - dx / 2, y - dy / 2, TABLE_HEIGHT])
        a, b, c = np.diag([dx, dy, dz])
        faces += [(low + c, a, b), (low, b, c), (low + a, b, c), (low, a, c), (low + b, a, c)]
    areas = np.array([np.linalg.norm(np.cross(a, b)) for _, a, b in faces])
    chosen = rng.choice(len(faces), size=num, p=areas / areas.sum())
    corner, a, b = (np.array([face[i] for face in faces])[chosen] for i in range(3))
    u, v = rng.random((2, num, 1))
    return Obstacles(corner + u * a + v * b + rng.normal(scale=NOISE, size=(num, 3)))
