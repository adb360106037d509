"""Pictures of the seven-joint arm among obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from sidestep import Robot
from sidestep.distance import SceneObject
from sidestep.drawing import draw_arm, style
from sidestep.drawing.palette import BLUE
from sidestep.thesis.reproduce.item import Array


def add_scene(
    figure: Figure,
    place: tuple[int, int, int],
    robot: Robot,
    q: Array,
    *,
    objects: Sequence[SceneObject] = (),
    object_poses: Array | None = None,
    title: str = "",
    view: tuple[float, float] = (18.0, 40.0),
    tip_path: Array | None = None,
    goal: Array | None = None,
    labelled: bool = True,
) -> Any:
    """One picture: arm, obstacles, path of the tip, axes in metres.

    Args:
        place: rows, columns, index of the subplot.
        object_poses: of the objects, or where they start.
        view: elevation and azimuth [deg].
        tip_path: (T, 3) [m], or None; its first point is marked as the start.
        goal: configuration (nv,) whose tip is marked, or None.
        labelled: whether the axes carry labels.
    """
    ax: Any = figure.add_subplot(*place, projection="3d", computed_zorder=False)
    draw_arm(ax, robot, q, objects=objects, object_poses=object_poses)
    if tip_path is not None:
        ax.plot(*tip_path.T, color=BLUE, linewidth=1.3, zorder=1)
        style.mark_start(ax, *tip_path[0])
    if goal is not None:
        style.mark_goal(ax, *robot.pose(goal, robot.frames[-1].name)[:3, 3])
    ax.set(xlim=(-0.3, 0.8), ylim=(-0.35, 0.75), zlim=(0.0, 1.1))
    ax.set_box_aspect((1.1, 1.1, 1.1), zoom=0.98 if labelled else 1.45)
    ax.view_init(elev=view[0], azim=view[1])
    ticks = [0.0, 0.4, 0.8]
    ax.set(xticks=[0.0, 0.4, 0.8], yticks=[0.0, 0.4], zticks=ticks)
    if labelled:
        ax.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    else:
        ax.set(xticklabels=[], yticklabels=[], zticklabels=[])
    ax.tick_params(pad=-2, labelsize=6)
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.labelpad = -6
        axis.pane.set_alpha(0.3)
    if title:
        ax.set_title(title, y=0.97 if labelled else 1.0)
    return ax


def tip_path(robot: Robot, q: Array, *, count: int = 300) -> Array:
    """Positions (count, 3) [m] of the last frame along a motion (T, nv)."""
    rows = np.unique(np.linspace(0, len(q) - 1, count).round().astype(int))
    tip = robot.frames[-1].name
    return np.array([robot.pose(q[k], tip)[:3, 3] for k in rows])
