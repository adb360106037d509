"""Pictures of a motion: the right size, everything in them where it is."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.proj3d import proj_transform

from sidestep import Robot, SceneObject
from sidestep.drawing import ArmViews, draw_arm
from sidestep.drawing.arm import direction
from sidestep.drawing.views import SIDES, fit_view, is_planar
from sidestep.math.pose import pose_at

MOTION = np.linspace([0.0, 0.0], [1.0, 0.5], 11)
BALL = SceneObject.ball("ball", [0.6, 0.5, 0.0], radius=0.1)


def _obstacle_pixels(picture: np.ndarray) -> np.ndarray:
    r, g, b = (picture[..., k].astype(int) for k in range(3))
    return np.argwhere((r > 90) & (g < 110) & (b < 40) & (r - g > 50))


def test_a_planar_arm_is_seen_from_above_with_its_obstacle_where_it_is() -> None:
    arm = Robot.named("planar2")
    views = ArmViews(arm, MOTION, goal=MOTION[-1], objects=[BALL], size=(320, 240))
    pictures = [views.picture(k) for k in (0, 5, 10)]
    assert [p.shape for p in pictures] == [(240, 320, 3)] * 3
    assert pictures[0].dtype == np.uint8
    assert len(_obstacle_pixels(pictures[0])) > 200  # the ball is about 20 pixels across
    assert (pictures[0] != pictures[2]).any(axis=2).sum() > 500  # the arm moved
    alone = ArmViews(arm, MOTION, goal=MOTION[-1], size=(320, 240)).picture(0)
    assert len(_obstacle_pixels(alone)) == 0


def test_an_obstacle_that_moves_is_drawn_where_it_is_at_the_sample() -> None:
    poses = np.tile([0.6, 0.5, 0.0, 1.0, 0.0, 0.0, 0.0], (11, 1, 1))
    poses[10, 0, 1] = -0.5  # y, up in the view from above
    views = ArmViews(
        Robot.named("planar2"), MOTION, goal=MOTION[-1], objects=[BALL], object_poses=poses, size=(300, 300)
    )
    start, end = (_obstacle_pixels(views.picture(k)).mean(axis=0) for k in (0, 10))
    assert end[0] - start[0] > 50  # rows count downwards
    assert abs(end[1] - start[1]) < 5  # x has not changed; shading moves the mean a little


@pytest.mark.slow
def test_an_arm_in_space_is_seen_from_the_side_and_from_above() -> None:
    arm = Robot.named("z1")
    q = np.stack([arm.neutral, arm.neutral + 0.1])
    views = ArmViews(arm, q, goal=q[-1], size=(200, 180))
    picture = views.picture(1)
    assert len(views.views) == 2
    assert picture.shape == (180, 400, 3)
    for half in (picture[:, :200], picture[:, 200:]):
        assert half.std() > 3.0  # of 255; an empty sheet has 0


@pytest.mark.parametrize(("name", "planar"), [("planar2", True), ("planar3", True), ("z1", False)])
def test_planar_arms_are_told_apart(name: str, planar: bool) -> None:
    assert is_planar(Robot.named(name)) is planar


@pytest.mark.parametrize("angles", [(90.0, -90.0), (22.0, -35.0)])
def test_what_must_be_seen_fills_the_picture(angles: tuple[float, float]) -> None:
    figure = Figure(figsize=(3.0, 3.0), dpi=100)
    FigureCanvasAgg(figure)
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0), projection="3d")
    ax.set_proj_type("ortho")
    ax.view_init(elev=angles[0], azim=angles[1])
    points = np.random.default_rng(0).uniform([1.0, -3.0, 0.0], [2.0, 0.0, 0.1], size=(50, 3))
    fit_view(ax, points, size=(300, 300))
    ax.apply_aspect()
    x, y, _ = proj_transform(*points.T, ax.get_proj())
    pixels = ax.transData.transform(np.column_stack([x, y]))
    # 94 % of 300 pixels, in the middle; the sums of a projection round in the twelfth digit
    assert np.ptp(pixels, axis=0).max() == pytest.approx(282.0, abs=1e-6)
    np.testing.assert_allclose(0.5 * (pixels.min(axis=0) + pixels.max(axis=0)), 150.0, atol=1e-6)


def test_near_triangles_hide_far_ones() -> None:
    figure = Figure(figsize=(2.0, 2.0), dpi=100)
    canvas = FigureCanvasAgg(figure)
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0), projection="3d")
    ax.set_axis_off()
    ax.view_init(elev=90.0, azim=-90.0)
    arm = Robot.named("planar2")
    ax.set(xlim=(0.2, 0.8), ylim=(-0.3, 0.3), zlim=(-0.3, 0.3))
    over = SceneObject.ball("over", [0.5, 0.0, 0.2], radius=0.1)
    under = SceneObject.ball("under", [0.5, 0.0, -0.2], radius=0.1)
    seen = []
    for ball in (over, under):
        drawn = draw_arm(ax, arm, np.zeros(2), objects=[ball])
        canvas.draw()
        seen.append(tuple(int(c) for c in np.asarray(canvas.buffer_rgba())[100, 100, :3]))
        drawn.remove()
    assert seen[0][0] - seen[0][2] > 60  # the ball hides the arm
    assert seen[1][0] <= seen[1][2]  # the arm, a bluish grey, hides the ball


def test_a_large_solid_hides_what_is_inside_and_below() -> None:
    arm = Robot.named("z1")
    q = np.stack([arm.neutral, arm.neutral])
    table = SceneObject("table", "box", size=(1.2, 0.8, 0.3), pose=pose_at([0.2, 1.0, 0.2]))
    inside = SceneObject.ball("inside", [0.2, 1.0, 0.2], radius=0.1)
    below = SceneObject.ball("below", [0.2, 1.0, -0.2], radius=0.1)
    views = ArmViews(arm, q, goal=q[-1], objects=[table, inside, below], size=(300, 300))
    assert (
        len(_obstacle_pixels(views.picture(0)[:, 300:])) == 0
    )  # from above: the table is pale, the balls are not
    bare = ArmViews(arm, q, goal=q[-1], objects=[inside, below], size=(300, 300))
    assert len(_obstacle_pixels(bare.picture(0)[:, 300:])) > 100


def test_the_goal_is_a_ghost_until_the_arm_is_there() -> None:
    arm = Robot.named("planar2")
    views = ArmViews(arm, MOTION, goal=MOTION[-1], size=(300, 300))
    start, end = (views.picture(k).astype(int) for k in (0, 10))
    ghost = lambda p: ((p[..., 2] - p[..., 0] > 25) & (p[..., 0] > 150)).sum()  # noqa: E731  a pale blue
    assert ghost(start) > 300
    assert ghost(end) < 0.2 * ghost(start)


def test_the_side_is_one_from_which_the_arm_is_seen() -> None:
    arm = Robot.named("z1")
    q = np.stack([arm.neutral, arm.neutral])
    towards = direction(*SIDES[0])
    wall = SceneObject("wall", "box", size=(0.02, 2.0, 2.0), pose=pose_at(0.8 * towards * [1.0, 0.0, 0.0]))
    assert ArmViews(arm, q, goal=q[-1], size=(200, 200)).views[0] == SIDES[0]
    side = ArmViews(arm, q, goal=q[-1], objects=[wall], size=(200, 200)).views[0]
    assert direction(*side)[0] < 0.0  # from the other side of the wall
