"""The first tab, the comparison and the frame of the page, in a real browser without a display."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sidestep.studio import messages as m
from sidestep.studio.gallery import MOUSE_BALL, ends_of
from sidestep.studio.headless import Window
from sidestep.studio.page.mouse import on_plane, ray_through
from sidestep.studio.scene_obstacle import ball
from sidestep.studio.studio import Studio
from studio.looker import ON_THE_PAGE, Looker, last, run_to, until

pytestmark = [*ON_THE_PAGE, pytest.mark.slow]

PLANAR = Path(__file__).parents[2] / "examples" / "planar3.urdf"


def test_arm_and_goal_are_between_the_panels_of_a_window_of_1280_by_800(
    studio: Studio, chromium: object
) -> None:
    window = Looker(chromium, studio, Window(1280, 800))
    try:
        box = window.page.locator("canvas").first.bounding_box()
        assert box is not None
        panels = [window.page.get_by_text(text).first.bounding_box() for text in ("Now", "Sidestep")]
        assert all(panel is not None for panel in panels)
        now, robot = last(studio), studio.view.loop.robot
        assert now.posture is not None
        for q in (now.q, now.posture.q):
            for frame in robot.frames:
                x, y = window.on_screen(robot.pose(q, frame.name)[:3, 3])
                assert box["x"] + 20 < x < box["x"] + box["width"] - 20  # [px]
                assert 20 < y < 780
        assert panels[0]["x"] + panels[0]["width"] < box["x"]  # type: ignore[index]
        assert panels[1]["x"] > box["x"] + box["width"]  # type: ignore[index]
        assert window.page.evaluate("document.documentElement.scrollWidth") <= 1280
    finally:
        window.page.close()


def test_a_ball_follows_the_mouse(studio: Studio, looker: Looker) -> None:
    place = np.array([0.6, 0.6, 0.3])
    studio.send(m.AddObstacle(ball(MOUSE_BALL, place, 0.06)))
    until(lambda: len(last(studio).things) == 2, "the ball")
    looker.tab("Start")
    box = looker.page.locator("canvas").first.bounding_box()
    assert box is not None
    shares = (0.45, 0.37)  # below the notes, and where the plane of the ball is above the ground
    looker.page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 0.3 * box["height"])
    looker.page.mouse.move(box["x"] + shares[0] * box["width"], box["y"] + shares[1] * box["height"])
    camera = next(iter(studio.server.get_clients().values())).camera
    there = lambda: last(studio).poses[1][:3, 3]  # noqa: E731
    until(lambda: bool(np.linalg.norm(there() - place) > 0.05), "the ball's move")  # paused, it is put there
    x, y = looker.on_screen(there())
    until(
        lambda: bool(
            np.abs(
                np.subtract(
                    looker.on_screen(there()),
                    [box["x"] + shares[0] * box["width"], box["y"] + shares[1] * box["height"]],
                )
            ).max()
            < 3.0
        ),
        f"the ball under the mouse, not at {x:.0f}, {y:.0f}",
    )
    normal = np.array(camera.look_at) - np.array(camera.position)
    wanted = on_plane(
        np.array(camera.position), ray_through(*shares, camera), place, normal / np.linalg.norm(normal)
    )
    np.testing.assert_allclose(there(), wanted, atol=0.02)  # [m] in the plane that it was in
    until(lambda: looker.is_checked("ball follows the mouse"), "the page's news of the ball")
    looker.check("ball follows the mouse")
    rest = there()
    looker.page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 0.6 * box["height"])
    looker.page.wait_for_timeout(500.0)
    np.testing.assert_array_equal(there(), rest)
    looker.check("ball follows the mouse")


def test_goals_in_turn_and_three_sliders(studio: Studio, looker: Looker) -> None:
    looker.tab("Start")
    before = last(studio).numbers["controller"]
    looker.check("goals in turn")
    until(lambda: len(last(studio).visited) == 2, "the goals")
    np.testing.assert_allclose(last(studio).visited, ends_of(last(studio).scenario, studio.view.loop.robot))
    looker.check("goals in turn")
    until(lambda: last(studio).visited == (), "one goal")
    looker.type("speed [%]", "50")
    until(lambda: last(studio).numbers["controller"]["speed"] == 0.5, "the speed")
    looker.type("distance [mm]", "20")
    until(lambda: last(studio).numbers["controller"]["safety_margin"] == pytest.approx(0.02), "the distance")
    assert last(studio).numbers["controller"]["planner_floor"] == pytest.approx(0.02)
    studio.send(m.SetNumbers("controller", before))
    until(lambda: looker.typed("speed [%]") == "100", "the usual speed on the page")


def test_the_scene_says_why(studio: Studio, looker: Looker) -> None:
    run_to(studio, 0.3)
    why = studio.view.why
    until(lambda: bool(why.path.visible) and bool(why.pull.visible), "path and pull")
    tip = studio.view.loop.robot.pose(last(studio).q, studio.view.loop.tip)[:3, 3]
    np.testing.assert_allclose(why.pull.points[0, 0], tip, atol=1e-3)
    goal = studio.view.loop.robot.pose(studio.view.goal.q, studio.view.loop.tip)[:3, 3]
    np.testing.assert_allclose(why.path.points[-1, 1], goal, atol=1e-3)
    looker.tab("Show")
    looker.check("path, attraction and what binds")
    until(lambda: not why.path.visible and not why.pull.visible, "neither")
    looker.check("path, attraction and what binds")
    studio.send(m.SetJointGoal(last(studio).q))
    until(lambda: "new goal" in looker.page.locator("#events").inner_text(), "the event")


def test_a_box_is_added_with_three_sides_that_can_be_changed(studio: Studio, looker: Looker) -> None:
    looker.tab("Obstacles")
    looker.choose("new", "box")
    fields = looker.page.locator(
        "xpath=//label[normalize-space()='sides [cm]']/following::input[not(@type='hidden')]"
    )
    for index, text in enumerate(("10", "20", "4")):
        fields.nth(index).fill(text, force=True)
        fields.nth(index).press("Enter")
    until(lambda: studio.view.obstacle_panel._sides.value == (10.0, 20.0, 4.0), "the sides")
    looker.press("Add")
    until(lambda: len(last(studio).things) == 2, "the box")
    assert last(studio).things[1].obstacle.shape.size == (0.1, 0.2, 0.04)
    looker.type("its sides [cm]", "30")
    until(lambda: last(studio).things[1].obstacle.shape.size == (0.3, 0.2, 0.04), "the longer side")
    looker.choose("new", "ball")


def test_two_methods_are_compared(studio: Studio, looker: Looker) -> None:
    looker.tab("Compare")
    looker.press("Compare")
    until(lambda: "time to goal" in looker.page.locator("#comparison").inner_text(), "the table")
    ghost = studio.view.compare._ghost
    comparison = studio.view.compare._comparison
    assert ghost is not None
    assert comparison is not None
    begin = ghost.q.copy()
    until(lambda: comparison.last is not None and comparison.last.time > 0.3, "the other motion")
    until(lambda: not np.array_equal(ghost.q, begin), "the ghost's motion")
    until(lambda: bool(np.isfinite(comparison.other.clearance)), "the other clearance")
    until(lambda: "mm" in looker.page.locator("#comparison").inner_text(), "clearances on the page")
    assert last(studio).method == "controller"
    assert comparison.last is not None
    assert comparison.last.method == "reactive"
    looker.press("End")
    until(lambda: studio.view.compare._comparison is None, "the end")
    studio.send(m.SetRunning(False))


def test_a_robot_is_dropped_on_the_page(studio: Studio, looker: Looker) -> None:
    looker.tab("Start")
    transfer = looker.page.evaluate_handle(
        "text => { const all = new DataTransfer(); all.items.add(new File([text], 'planar3.urdf')); return all; }",
        PLANAR.read_text(encoding="utf-8"),
    )
    looker.page.dispatch_event("canvas", "drop", {"dataTransfer": transfer})
    until(lambda: last(studio).scenario.robot.urdf is not None, "the robot")
    until(lambda: studio.view.loop.robot.num_coordinates == 3, "its picture")
    assert len(last(studio).visited) == 2  # it moves at once
    assert [thing.name for thing in last(studio).things] == [MOUSE_BALL]
    studio.send(m.SetRunning(False))


def test_nothing_went_wrong_in_the_browser(looker: Looker) -> None:
    assert looker.errors == []
