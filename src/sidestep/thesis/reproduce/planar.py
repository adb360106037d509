"""The thesis's two-joint arm: links of 1 m along y when q = 0, one Gaussian each; and ψ over its joints.

Source: Bosc (2024), figures 3.7 and 5.1 to 5.9; start, goal, gains and obstacle are its numbers.
"""

from __future__ import annotations

import tempfile
from functools import lru_cache
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from sidestep import Body, Obstacles, Robot
from sidestep._core import Embedding
from sidestep.robot import planar_arm
from sidestep.thesis import CollisionDensity
from sidestep.thesis.reproduce.item import Array

LINK_LENGTH = 1.0  # [m]
LINK_WIDTH = 0.08  # [m] of the boxes that planar_arm makes
OBSTACLE_RADIUS = 0.05  # [m] of the ball that stands for a point, for judging contact
LENGTH_DEVIATION, WIDTH_DEVIATION = 0.29, 0.15  # [m] of the Gaussian, as wide as the ridge in figure 3.7
LOW = 0.15  # [m] deviation out of the plane: ψ peaks at 9.75 / m³, the end of the scale of figure 3.7
HIGH = 0.01  # [m] the same as thin as the thesis's toy links: ψ peaks at 146 / m³
OBSTACLE = np.array([-0.5, 1.4, 0.0])  # [m]
START = np.array([-0.5, -1.2])  # [rad]
GOAL = np.array([1.0, 0.15])  # [rad]
STIFFNESS, DAMPING = 1.0, 1.5  # [1/s²], [1/s]


@lru_cache(maxsize=4)
def arm(num_joints: int = 2) -> Robot:
    """A planar arm that points along y at q = 0."""
    base = np.eye(4)
    base[:2, :2] = [[0.0, -1.0], [1.0, 0.0]]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"planar{num_joints}.urdf"
        path.write_text(planar_arm(num_joints, LINK_LENGTH), encoding="utf-8")
        return Robot.from_urdf(path, base_pose=base)


@lru_cache(maxsize=8)
def body(num_joints: int = 2, *, thickness: float = LOW) -> Body:
    """One Gaussian in the middle of each link, with a standard deviation out of the plane [m]."""
    names = [f"link{i}" for i in range(1, num_joints + 1)]
    return Body(
        links=names,
        weights=np.ones(num_joints),
        means=np.tile([LINK_LENGTH / 2.0, 0.0, 0.0], (num_joints, 1)),
        covariances=np.tile(
            np.diag(np.square([LENGTH_DEVIATION, WIDTH_DEVIATION, thickness])), (num_joints, 1, 1)
        ),
    )


def density(*, thickness: float = LOW) -> CollisionDensity:
    """ψ of the two-joint arm."""
    return CollisionDensity(arm(), body(thickness=thickness))


def point(position: Array = OBSTACLE) -> Obstacles:
    """One obstacle point, or several (N, 3)."""
    return Obstacles(np.atleast_2d(position))


def field(
    embedding: Embedding, obstacles: Obstacles, *, limit: float = np.pi, count: int = 121
) -> tuple[tuple[Array, Array], Array]:
    """ψ over a square of joint angles.

    Returns:
        The grid (q1 (n,), q2 (n,)) [rad] and the sum of ψ over its coordinates (n, n), row for q2.
    """
    axis = np.linspace(-limit, limit, count)
    rest = np.zeros(2)
    values = np.array(
        [[embedding.evaluate([a, b], rest, obstacles).values.sum() for a in axis] for b in axis]
    )
    return (axis, axis), values


def joints(q: Array) -> Array:
    """Positions (nv + 1, 2) [m] of base, joints and tip in the plane."""
    robot = arm(len(q))
    names = [f"link{i}" for i in range(1, len(q) + 1)] + ["tip"]
    return np.array([robot.pose(q, name)[:2, 3] for name in names])


def clearance(q: Array, position: Array = OBSTACLE, *, radius: float = OBSTACLE_RADIUS) -> float:
    """Distance [m] between a ball in the plane of the arm and the arm, a chain of capsules LINK_WIDTH wide.

    Args:
        q: configuration (nv,).
        position: centre (3,) [m].
        radius: of the ball [m].
    """
    chain = joints(q)
    start, span = chain[:-1], np.diff(chain, axis=0)
    offset = position[:2] - start
    share = np.clip(np.einsum("ij,ij->i", offset, span) / np.einsum("ij,ij->i", span, span), 0.0, 1.0)
    distances = np.linalg.norm(offset - share[:, None] * span, axis=1)
    return float(distances.min()) - LINK_WIDTH / 2.0 - radius


def least_clearance(q: Array, positions: Array = OBSTACLE, *, count: int = 2000) -> float:
    """The least clearance [m] along a motion (T, nv), at up to `count` of its rows, to any of the balls."""
    rows = np.unique(np.linspace(0, len(q) - 1, count).round().astype(int))
    return min(clearance(q[k], position) for k in rows for position in np.atleast_2d(positions))


def draw_arm(ax: Axes, q: Array, *, color: str = "0.25", alpha: float = 1.0, width: float = 2.5) -> None:
    """The arm in the plane of the task: base, links, joints and tip."""
    chain = joints(q)
    ax.plot(*chain.T, color=color, alpha=alpha, linewidth=width, solid_capstyle="round", zorder=3)
    ax.plot(*chain[1:-1].T, "o", color="white", markeredgecolor=color, markersize=4, alpha=alpha, zorder=4)
    ax.plot(*chain[0], "s", color="0.25", markersize=6, zorder=4)


def task_axes(ax: Axes, *, title: str | None = None) -> None:
    """Labels and equal scales for the plane of the task."""
    ax.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    if title is not None:
        ax.set_title(title)
