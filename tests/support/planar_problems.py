"""Problems for the arm `planar3` among balls in its plane."""

from __future__ import annotations

import numpy as np

import sidestep as ss
from sidestep.planning import PathPlanner

# One ellipsoid along each link of 0.5 m; its box is not covered, which nothing here needs.
BODY = {
    "links": ["link1", "link2", "link3"],
    "weights": np.ones(3),
    "means": np.tile([0.25, 0.0, 0.0], (3, 1)),
    "covariances": np.tile(np.diag([0.27, 0.05, 0.05]) ** 2, (3, 1, 1)),
    "levels": np.ones(3),
}


def balls(seed: int, count: int = 6) -> ss.Obstacles:
    """Balls of 6 to 12 cm in the plane, clear of the base."""
    rng = np.random.default_rng(seed)
    angle, distance = rng.uniform(-np.pi, np.pi, count), rng.uniform(0.5, 1.4, count)
    centers = np.column_stack([distance * np.cos(angle), distance * np.sin(angle), np.zeros(count)])
    return ss.Obstacles(centers, rng.uniform(0.06, 0.12, count))


def free_ends(
    robot: ss.Robot, planner: PathPlanner, obstacles: ss.Obstacles, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Two random configurations with the planner's margin."""
    rng = np.random.default_rng((seed, 1))
    found: list[np.ndarray] = []
    while len(found) < 2:
        q = robot.random_configuration(rng)
        if planner.is_free(q, obstacles):
            found.append(q)
    return found[0], found[1]
