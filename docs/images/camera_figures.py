"""Pictures of what becomes of a depth image, from a simulated camera; see make.py."""

from __future__ import annotations

from functools import cache

import mujoco
import numpy as np
from figures import save
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch

import sidestep as ss
from sidestep.obstacles import pose_at
from sidestep.perception import DepthCamera, Perception, PerceptionSettings
from sidestep.perception.colours import MEANINGS, PIXELS
from sidestep.perception.pictures import (
    cell_legend,
    cell_picture,
    depth_picture,
    label_picture,
    view_from_beside,
)
from sidestep.perception.seen_stages import SeenStages
from sidestep.simulation import SimulatedCamera, build_model, look_at

IMAGES = 45  # 1.5 s at 30 Hz
TURN = (0.9, -0.1)  # [rad] of the first joint, at the first and the last image
FAR, SEES = 2.4, 6.0  # [m] depths that are believed, and those that the device gives: the wall is between
WIDTH = 9.0  # [inch] of a picture
TABLE = ss.SceneObject("table", "box", (0.7, 1.4, 0.04), pose=pose_at([0.55, 0.0, 0.08]))
THINGS = [
    TABLE,
    ss.SceneObject("cup", "cylinder", (0.04, 0.12), pose=pose_at([0.62, 0.35, 0.16])),
    ss.SceneObject("box", "box", (0.12, 0.3, 0.25), pose=pose_at([0.35, -0.42, 0.225])),
    ss.SceneObject("pole", "cylinder", (0.03, 0.9), pose=pose_at([-0.35, -0.15, 0.45])),
    ss.SceneObject("wall", "box", (0.05, 4.0, 2.4), pose=pose_at([-1.0, 0.0, 1.2])),
]


@cache
def seen(unseen_is_free: bool) -> SeenStages:
    """What an image shows of an arm that has turned over a table, in front of a pole; the cup is to be grasped."""
    arm = ss.Arm.load("fr3")
    model = build_model(arm.robot, THINGS)
    data = mujoco.MjData(model.model)
    pose = look_at([1.7, 0.35, 1.0], [0.25, 0.0, 0.4])
    pinhole = {"width": 640, "height": 400, "fx": 400, "fy": 400, "cx": 319.5, "cy": 199.5, "pose": pose}
    camera = DepthCamera("front", **pinhole, far=FAR)
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True))
    controller.set_obstacles(ss.Box(TABLE.size, TABLE.pose, name="table"))
    perception = Perception(controller, [camera], PerceptionSettings(unseen_is_free=unseen_is_free))
    perception.leave_out("cup", ss.Cylinder(0.04, 0.12, pose_at([0.62, 0.35, 0.16])), grow=0.02)
    with SimulatedCamera(model, DepthCamera("front", **pinhole, far=SEES), noise="d435", seed=50) as device:
        for k in range(IMAGES):
            share = k / (IMAGES - 1)
            q = arm.neutral.copy()
            q[0] = (1.0 - share) * TURN[0] + share * TURN[1]
            model.set_state(data, q, 0.0 * q)
            image = device.capture(data, k / 30.0)
            perception.update(image.camera, image.depth, time=image.time, q=q)
    return SeenStages.of(perception, "front")


def drawn(name: str, *pictures: np.ndarray, titles: tuple[str, ...], legend: list[tuple[str, str]]) -> None:
    """Pictures beside each other, with what their colours mean below."""
    height = WIDTH / len(pictures) * pictures[0].shape[0] / pictures[0].shape[1] + 0.75
    figure = Figure(figsize=(WIDTH, height), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    for ax, picture, title in zip(
        np.atleast_1d(figure.subplots(1, len(pictures))), pictures, titles, strict=True
    ):
        ax.imshow(picture, interpolation="antialiased")
        ax.set_title(title, fontsize=10)
        ax.set_axis_off()
    patches = [Patch(facecolor=colour, edgecolor="0.5", label=words) for colour, words in legend]
    figure.legend(
        handles=patches,
        loc="outside lower center",
        ncols=4 if len(patches) > 5 else 2,
        fontsize=8,
        frameon=False,
    )
    save(figure, name)


def camera_pixels() -> None:
    """The depth of an image, and what its pixels show."""
    stages = seen(True)
    nearest = float(np.percentile(stages.depth[stages.depth > 0.0], 1))
    shown = [name for name, count in stages.pixels().items() if count]
    drawn(
        "camera-pixels",
        depth_picture(stages.depth, near=nearest, far=FAR),
        label_picture(stages.labels),
        titles=(f"1. depth: near light, {FAR:g} m dark, beyond grey, none black", "2. what pixels show"),
        legend=[(PIXELS[name], MEANINGS[name]) for name in shown],
    )


def camera_map() -> None:
    """The cells of the map, from the camera and from beside it."""
    stages = seen(True)
    drawn(
        "camera-map",
        cell_picture(stages),
        cell_picture(stages, pose=view_from_beside(stages)),
        titles=("3. cells, from the camera", "the same, from beside it"),
        legend=[*cell_legend(stages), (PIXELS["arm"], "the arm, as the image shows it")],
    )


def camera_unseen() -> None:
    """Where nobody has looked, if that counts as occupied."""
    stages = seen(False)
    drawn(
        "camera-unseen",
        cell_picture(stages),
        cell_picture(stages, pose=view_from_beside(stages)),
        titles=("4. with unseen_is_free=False, from the camera", "the same, from beside it"),
        legend=cell_legend(stages),
    )
