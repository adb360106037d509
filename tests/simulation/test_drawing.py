"""Pictures: the right size, showing the obstacle where it is, and coarse meshes that keep the shape."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from stand_ins import InverseDynamics, Spring

from sidestep import Robot, SceneObject, Simulation
from sidestep._core import Obstacles
from sidestep.simulation import render_frames
from sidestep.simulation.drawing import simplified


def _run(*objects: SceneObject):
    robot = Robot.named("planar2")
    return Simulation(robot, objects).run(
        Spring(), InverseDynamics(), np.zeros(2), np.array([1.0, 0.5]), 0.3, Obstacles.none(), arrival=None
    )


def _red(picture: np.ndarray) -> int:
    r, g, b = (picture[..., k].astype(int) for k in range(3))
    return int(((r > 100) & (g < 90) & (b < 90)).sum())


def test_frames_show_the_arm_and_the_obstacle() -> None:
    seen: list[tuple[int, int]] = []
    ball = SceneObject.ball("ball", [0.6, 0.5, 0.0], radius=0.1)
    pictures = render_frames(
        _run(ball), frames=3, width=320, height=240, progress=lambda done, total: seen.append((done, total))
    )
    assert [p.shape for p in pictures] == [(240, 320, 3)] * 3
    assert pictures[0].dtype == np.uint8
    assert seen == [(1, 3), (2, 3), (3, 3)]
    assert _red(pictures[0]) > 200  # the ball is about 20 pixels across
    assert (pictures[0] != pictures[2]).any(axis=2).sum() > 500  # the arm moved
    assert _red(render_frames(_run(), frames=2, width=320, height=240)[0]) == 0


def test_too_few_frames() -> None:
    with pytest.raises(ValueError, match="frames must be at least 2, got 1"):
        render_frames(_run(), frames=1)


def test_simplified_keeps_the_shape() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=5, radius=0.1)
    coarse = simplified(sphere, 0.02)
    assert len(coarse.faces) < len(sphere.faces) / 10
    radii = np.linalg.norm(coarse.vertices, axis=1)
    # the mean of vertices in a cube of side c is off the sphere by at most its diagonal
    assert radii.max() <= 0.1 + 1e-12
    assert radii.min() >= 0.1 - 0.02 * np.sqrt(3)
    np.testing.assert_allclose(coarse.bounds, sphere.bounds, atol=0.01)
