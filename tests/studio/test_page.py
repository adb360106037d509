"""The page in a real browser, without a display. One browser and one studio serve all tests: each starts slowly."""

from __future__ import annotations

import re
from contextlib import nullcontext
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from PIL import Image

from sidestep import ExactClearance, Scenario
from sidestep.scenario.scenario import RobotConfig
from sidestep.studio import headless
from sidestep.studio import messages as m
from sidestep.studio.clearance_monitor import solid_poses
from sidestep.studio.headless import ANIMATION_WIDTH, FRAME, Window, take_pictures
from sidestep.studio.methods import METHODS
from sidestep.studio.page.camera import RIGHT
from sidestep.studio.page.marks import GAP
from sidestep.studio.page.obstacles import gizmo_pose
from sidestep.studio.page.placing import CLEAR
from sidestep.studio.page.surface import on_surface
from sidestep.studio.page.words import WORDS_HEIGHT, in_box, stamped
from sidestep.studio.snippet import python_snippet
from sidestep.studio.start import scenario_of
from sidestep.studio.studio import Studio
from studio.looker import ON_THE_PAGE, PANELS, Looker, differ, last, run_to, until

pytestmark = [*ON_THE_PAGE, pytest.mark.slow]


def test_the_arm_is_on_the_page(studio: Studio, looker: Looker) -> None:
    with_arm = looker.image()
    studio.view.arm.root.visible = False
    without = looker.image()
    studio.view.arm.root.visible = True
    changed = differ(with_arm, without)
    assert changed.sum() > 1500  # [px] the arm of one metre is some 150 x 20 pixels large here, or more
    robot, q = studio.view.loop.robot, last(studio).q
    x, y = looker.on_screen(robot.pose(q, "link2")[:3, 3])
    assert changed[round(y) - 12 : round(y) + 12, round(x) - 12 : round(x) + 12].any()


def test_the_axes_of_the_plots_can_be_read(studio: Studio, looker: Looker) -> None:
    run_to(studio, last(studio).time + 0.3)
    axes = (
        "() => Object.values(window.__viserTestpoints.uplots).map(plot => plot.chart)"
        ".map(chart => [chart.axes[1]._values, chart.scales.y.max])"
    )

    def can_be_read() -> bool:
        found = looker.page.evaluate(axes)
        full = [most for _, most in found[1:3]]  # of speed and torque, within their limits
        return full == [100.0, 100.0] and all(own and "0" in own and len(own) > 1 for own, _ in found)

    until(can_be_read, "zero and one label more at each")


def test_a_goal_set_on_the_page_is_reached(studio: Studio, looker: Looker) -> None:
    looker.tab("Goal")
    looker.type("joint1 [°]", "-20")
    until(lambda: bool(np.isclose(last(studio).goal[0], np.deg2rad(-20.0))), "the goal")  # type: ignore[index]
    looker.press("Run")
    until(
        lambda: np.abs(last(studio).q - last(studio).goal).max() < 0.05, "arrival"
    )  # [rad] counts as arrived
    assert last(studio).running


def test_an_obstacle_dragged_into_the_way_is_not_touched(studio: Studio, looker: Looker) -> None:
    studio.send(m.SetRecording(True))
    studio.send(m.SetRunning(True))
    until(lambda: last(studio).recording and last(studio).running, "recording")
    before = last(studio)
    ball = before.poses[0][:3, 3]
    # The goal first, then the ball onto the circle of the tip, sideways in the window: a drag is in a plane that
    # faces the camera, and this arm can yield in its own plane alone.
    studio.send(m.SetJointGoal(before.q + np.array([1.0, 0.0])))
    looker.drag(ball, ball - 0.3 * RIGHT)
    moved = lambda: float(np.linalg.norm(last(studio).poses[0][:3, 3] - ball))  # noqa: E731
    until(lambda: moved() > 0.1, "the drag")
    begin = last(studio).time
    until(lambda: last(studio).time > begin + 3.0, "three seconds")
    studio.send(m.SetRecording(False))
    studio.send(m.SetRunning(False))  # the browser has time for the next tests
    until(lambda: not last(studio).recording, "the end of the recording")
    rows = studio.view.recorder.rows
    things = rows[0].things
    exact = ExactClearance(studio.view.loop.robot, [solid for thing in things for solid in thing.solids])
    poses = np.array([solid_poses(things, row.poses) for row in rows])
    tip = studio.view.loop.robot.pose(before.q, studio.view.loop.tip)[:3, 3]
    assert np.linalg.norm(poses[-1, 0, :3]) == pytest.approx(np.linalg.norm(tip), abs=0.1)  # [m] in its way
    worst = exact.decided_minimum(np.array([row.q for row in rows]), poses)
    assert rows[-1].time - rows[0].time > 3.0
    assert worst.clearance.distance > 0.0
    assert last(studio).touched == 0


def test_the_method_is_switched_on_the_page(studio: Studio, looker: Looker) -> None:
    """While the arm moves, and it goes on from where it is."""
    assert last(studio).method == "controller"
    looker.tab("Method")
    studio.send(m.SetRunning(True))
    for name in ("thesis", "barrier", "unswitched", "controller"):
        before = last(studio)
        looker.choose("method", METHODS[name].label)
        until(lambda name=name: last(studio).method == name, "the method")  # type: ignore[misc]
        changed = last(studio)
        densities = 0 if METHODS[name].controlled else 1
        until(lambda t=changed.time: last(studio).time > t + 0.1, "its steps")  # type: ignore[misc]
        after = last(studio)
        assert after.running
        assert (len(after.values) == 1) == bool(densities)  # one density, or one barrier for each part
        assert after.status.startswith("system ") == bool(densities)
        elapsed = changed.time - before.time
        assert elapsed > 0.0
        fastest = studio.view.loop.robot.limits.velocity
        assert (np.abs(changed.q - before.q) <= fastest * elapsed + 1e-9).all()  # no jump
    studio.send(m.SetRunning(False))


def test_a_scenario_is_saved_and_loaded_on_the_page(studio: Studio, looker: Looker, folder: Path) -> None:
    studio.send(m.SetRunning(False))
    until(lambda: not last(studio).running, "the pause")
    before = last(studio)
    looker.tab("Scenario")
    looker.type("name", "kept")
    looker.press("Save")
    until((folder / "kept.yaml").is_file, "the file")
    saved = Scenario.load(folder / "kept.yaml")
    np.testing.assert_allclose(saved.start.position, before.q, atol=1e-12)
    np.testing.assert_allclose(saved.obstacles[0].position, before.poses[0][:3, 3], atol=1e-12)
    studio.send(m.RemoveObstacle("ball"))
    until(lambda: not last(studio).things, "the removal")
    looker.press("Save")
    looker.answer("Keep it")
    assert Scenario.load(folder / "kept.yaml") == saved
    with looker.page.expect_file_chooser() as chooser:
        looker.press("Load a file …")
    chooser.value.set_files(folder / "kept.yaml")
    until(lambda: last(studio).scenario.name == "kept", "the loaded scenario")
    again = last(studio)
    assert [thing.name for thing in again.things] == ["ball"]
    np.testing.assert_allclose(again.poses[0], before.poses[0], atol=1e-12)


def test_all_words_can_be_read(studio: Studio, looker: Looker, monkeypatch: pytest.MonkeyPatch) -> None:
    """The longest that usually come fit where they are; longer ones push down what is below them."""
    usual = (
        "Link 'fr3_link5' and cloud12 overlap by 12 mm, according to the covering body; if points lie on the arm "
        "itself, filter the arm out of the cloud; no path was found yet; searching again; fr3_link5 slides "
        "along cloud12, 12 mm away.",
        "exact meshes: fr3_link5 – cloud12 -12 mm (least so far -15 mm)<br>touches: fr3_link5 - cloud12 · 123.4 s · "
        "0.95 × real time<br>status: clearance_lost, moving",
    )
    longer = (usual[0] + " " + 60 * "w", "<br>".join(20 * [usual[1]]))
    monkeypatch.setattr(studio.view.words, "_tell", lambda *_: None)  # what the loop says meanwhile
    heights, box = [], looker.page.locator("#words > div")
    for words, facts in (usual, longer):
        text = in_box(words, facts)
        studio.view.words._box.content = stamped(text, 0)
        until(lambda words=words: words[-20:] in box.inner_text(), "the words")  # type: ignore[misc]
        seen = box.evaluate(
            "e => ({content: e.scrollHeight, height: e.clientHeight, wide: e.scrollWidth, width: e.clientWidth})"
        )
        assert seen["content"] <= seen["height"]
        assert seen["wide"] <= seen["width"]
        assert looker.page.locator("#words").evaluate("e => getComputedStyle(e).overflow") == "visible"
        heights.append(seen["height"])
    assert heights[0] == WORDS_HEIGHT + 4  # [px] and its padding
    assert heights[1] > 2 * WORDS_HEIGHT


def test_a_second_browser_sees_the_same(studio: Studio, looker: Looker, chromium: Any) -> None:
    second = Looker(chromium, studio)
    try:
        assert len(studio.server.get_clients()) == 2
        looker.tab("Goal")
        second.tab("Goal")
        looker.type("joint2 [°]", "25")
        until(lambda: bool(np.isclose(last(studio).goal[1], np.deg2rad(25.0))), "the goal")  # type: ignore[index]
        field = "xpath=//label[normalize-space()='joint2 [°]']/following::input[not(@type='hidden')][1]"
        for window in (looker.page, second.page):
            value = window.locator(field).first.input_value
            until(lambda value=value: value() == "25", "the same field in every window")  # type: ignore[misc]
        same = lambda: bool(differ(looker.scene(), second.scene()).mean() < 0.01)  # noqa: E731  up to edges
        until(same, "the same picture")
        before = second.scene()
        run_to(studio, 0.5)
        until(lambda: studio.view.shown[0] > 0.49, "the end of the motion")
        until(same, "the same picture after the motion")
        assert differ(before, second.scene()).sum() > 1000  # [px] of the arm that moves
        words = second.page.locator("#words").inner_text()
        assert "0.5 s" in words
        assert re.search("status: (ok|limited), moving", words)  # it begins with all the jerk there is
        assert looker.page.locator("#words").inner_text() == words
        assert second.errors == []
    finally:
        second.page.close()


def test_the_curved_space_is_drawn_with_the_way_on_it(studio: Studio, looker: Looker) -> None:
    looker.tab("Show")
    without = looker.image()
    looker.check("curved space")
    surface = studio.view.surface
    until(lambda: surface.heights is not None, "the surface")
    assert differ(without, looker.image()).sum() > 1500  # [px] of a square of 1.2 m
    end = run_to(studio, 1.0)
    until(lambda: studio.view.shown[0] == end.time, "the end")
    robot, goal = studio.view.loop.robot, end.goal
    assert goal is not None

    def lies_on_it(mark: str, q: np.ndarray) -> bool:  # the surface is computed anew, and the marks follow
        heights = surface.heights
        return heights is not None and np.allclose(
            surface.place_of(mark), on_surface(robot, (0, 1), q, heights), rtol=0.0, atol=1e-9
        )

    until(lambda: lies_on_it("state", end.q) and lies_on_it("goal", goal), "state and goal on the surface")
    way = np.array(surface.trail)
    here = surface.place_of("state")
    np.testing.assert_allclose(way[-1, :2], here[:2], atol=0.006)  # [m] points of the way are 5 mm apart
    studio.send(m.SetPoseGoal(robot.pose(np.array([0.3, 0.9]), studio.view.loop.tip)))
    until(lambda: last(studio).goal_pose is not None, "a pose")
    mark = lambda: on_surface(robot, (0, 1), last(studio).posture.q, surface.heights)  # type: ignore[arg-type]  # noqa: E731
    until(lambda: np.allclose(surface.place_of("goal"), mark(), atol=1e-9), "its mark")
    studio.send(m.Restart(until=0.0))
    until(lambda: last(studio).time == 0.0, "the restart")
    assert len(surface.trail) == 1  # the place where the arm is
    looker.check("curved space")
    until(lambda: surface.heights is None, "the end of the surface")


def test_the_metric_is_drawn_at_the_tip(studio: Studio, looker: Looker) -> None:
    run_to(studio, 0.5)
    looker.tab("Show")
    without = looker.image()
    looker.check("metric")
    until(lambda: studio.view.marks.metric.visible, "the metric")
    changed = differ(without, looker.image())
    x, y = looker.on_screen(studio.view.loop.robot.pose(last(studio).q, studio.view.loop.tip)[:3, 3])
    assert changed[round(y) - 25 : round(y) + 25, round(x) - 25 : round(x) + 25].any()
    looker.check("metric")
    until(lambda: not studio.view.marks.metric.visible, "the end of the metric")


def test_the_gizmo_sets_a_pose_goal(studio: Studio, looker: Looker) -> None:
    gizmo = studio.view.goal.gizmo
    before = gizmo_pose(gizmo)
    arrow = before[:3, :3] @ np.array([0.9 * gizmo.scale, 0.0, 0.0])
    looker.drag(before[:3, 3] + arrow, before[:3, 3] + arrow - before[:3, :3] @ np.array([0.2, 0.0, 0.0]))
    moved = lambda: before[:3, :3].T @ (gizmo_pose(gizmo)[:3, 3] - before[:3, 3])  # noqa: E731
    # As far as the mouse, up to two pixels of 7 mm: where it was pressed, and perspective along the arrow.
    until(lambda: bool(abs(moved()[0] + 0.2) < 0.014), "the whole drag")
    np.testing.assert_allclose(moved()[1:], 0.0, atol=1e-6)  # the arrow moves it along its axis
    until(lambda: last(studio).goal_pose is not None, "a pose goal")
    until(lambda: np.allclose(last(studio).goal_pose, gizmo_pose(gizmo)), "the gizmo's pose")  # type: ignore[arg-type]
    until(lambda: studio.view.goal.kind.content.startswith("**Goal: a pose**"), "the words")


def test_a_shipped_scenario_is_one_click_away(studio: Studio, looker: Looker) -> None:
    looker.tab("Scenario")
    looker.choose("shipped", "planar-one-obstacle")
    looker.press("Load")
    until(lambda: last(studio).scenario.name == "planar-one-obstacle", "the scenario")
    assert last(studio).method == "custom"  # as it is written for


def test_the_thesis_is_one_click_away_with_its_arm_of_seven_joints(studio: Studio, looker: Looker) -> None:
    looker.tab("Scenario")
    looker.press("6.2.3")
    thesis = Scenario.load("thesis-6.2.3")
    until(lambda: last(studio).scenario == thesis, "the scenario")
    assert last(studio).method == "custom"
    until(lambda: last(studio).time > 0.2, "some steps")
    assert studio.view.plots.rows[0, 0] < GAP  # [s] seen from its start, however long its meshes took to load
    studio.send(m.SetRunning(False))
    until(lambda: not last(studio).running, "the pause")
    robot, now = studio.view.loop.robot, last(studio)
    assert robot.num_coordinates == len(now.q) == 7
    assert len(now.values) == 1  # one density, as the file says
    looker.tab("Goal")
    looker.type("joint7 [°]", "50")
    until(lambda: bool(np.isclose(last(studio).posture.q[6], np.deg2rad(50.0))), "the goal")
    looker.tab("Obstacles")
    for count in (4, 5):  # beside the three balls
        looker.press("Add")
        until(lambda count=count: len(last(studio).things) == count, "a ball more")  # type: ignore[misc]
    after = last(studio)
    exact = ExactClearance(robot, [solid for thing in after.things[3:] for solid in thing.solids])
    for q in (after.q, after.posture.q):
        assert exact.distance(q, solid_poses(after.things[3:], after.poses[3:])).distance > CLEAR
    run_to(studio, after.time + 0.3)
    assert last(studio).touched == 0


def test_a_ghost_is_not_drawn_where_the_arm_is(studio: Studio, looker: Looker) -> None:
    ghost, here = studio.view.goal.ghost, last(studio).q
    shown = lambda: {link: bool(mesh.visible) for link, mesh in ghost._meshes.items()}  # noqa: E731
    studio.send(m.SetJointGoal(here))
    until(lambda: not any(shown().values()), "no ghost")
    studio.send(m.SetJointGoal(here + np.array([0.0, 0.2])))
    until(lambda: shown() == {"link1": False, "link2": True}, "the ghost of the second link")


def test_a_body_has_the_colours_of_its_links(studio: Studio, looker: Looker) -> None:
    tip = studio.view.loop.robot.pose(last(studio).q, studio.view.loop.tip)
    tip[1, 3] -= 0.15  # [m] the second link is near, the first is not
    studio.send(m.DragObstacle("ball", tip))
    body = studio.view.body
    assert body is not None
    until(lambda: studio.view.arm.shades.get("link2", 0) > 5, "a colour")
    until(lambda: body._shades == studio.view.arm.shades, "the same colours")


def test_a_pose_goal_is_saved_and_loaded_on_the_page(studio: Studio, looker: Looker, folder: Path) -> None:
    robot, tip = studio.view.loop.robot, studio.view.loop.tip
    aim = robot.pose(np.array([0.3, 0.9]), tip)
    studio.send(m.SetPoseGoal(aim))
    until(lambda: last(studio).goal_pose is not None, "the pose")
    looker.tab("Scenario")
    looker.type("name", "pose")
    looker.press("Save")
    until((folder / "pose.yaml").is_file, "the file")
    studio.send(m.SetJointGoal(np.zeros(2)))
    studio.send(m.SetMethod("unswitched"))
    until(lambda: last(studio).goal is not None and last(studio).method == "unswitched", "another goal")
    with looker.page.expect_file_chooser() as chooser:
        looker.press("Load a file …")
    chooser.value.set_files(folder / "pose.yaml")
    until(lambda: last(studio).scenario.name == "pose", "the loaded scenario")
    assert last(studio).method == "controller"  # a file brings its method
    np.testing.assert_allclose(last(studio).goal_pose, aim, atol=1e-12)  # type: ignore[arg-type]
    studio.send(m.SetRunning(True, until=4.0))
    until(lambda: last(studio).time > 3.99, "the motion")
    np.testing.assert_allclose(robot.pose(last(studio).q, tip), aim, atol=0.01)  # [m] counts as arrived


def test_pictures_show_the_motion_from_its_start(
    studio: Studio, chromium: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What `sidestep studio --headless` calls, with the studio and the browser that run already."""
    asked: list[tuple[Scenario, dict[str, Any]]] = []

    def running(scenario: Scenario, **options: Any) -> Any:
        asked.append((scenario, options))
        return nullcontext(studio)

    politeness: list[int] = []
    monkeypatch.setattr(headless, "Studio", running)
    monkeypatch.setattr(headless, "driver", nullcontext)
    monkeypatch.setattr(headless, "browser", lambda _: nullcontext(chromium))
    monkeypatch.setattr(headless.os, "nice", politeness.append)  # would be of all tests that follow
    end, way, window = tmp_path / "end.png", tmp_path / "way.gif", Window(900, 480)
    scenario, options = scenario_of(RobotConfig(name="planar2")), {"method": "unswitched", "ellipsoids": 3}
    studio.send(m.SetRunning(True))  # it begins again
    take_pictures(scenario, **options, duration=2 * FRAME, screenshot=end, video=way, window=window)  # type: ignore[arg-type]
    assert asked == [(scenario, {**options, "to_and_fro": False, "port": 0})]
    assert politeness == [headless.POLITE]
    assert last(studio).time == pytest.approx(2 * FRAME, abs=1e-3)  # one period
    assert Image.open(end).size == (window.width, window.height)
    animation = Image.open(way)
    assert animation.n_frames == 2  # type: ignore[attr-defined]
    assert animation.info["duration"] == 1e3 * FRAME
    assert animation.width == ANIMATION_WIDTH
    begun, ended = (
        np.asarray(picture.convert("RGB").resize(animation.size), dtype=int)
        for picture in (animation, Image.open(end))
    )
    left, right = (
        round(side * animation.width / window.width) for side in (PANELS[0], window.width - PANELS[1])
    )
    assert differ(begun, ended)[:, left:right].sum() > 100  # [px] of the arm that moves, between the panels
    chromium.contexts[-1].close()  # as the end of the browser does otherwise


def test_everything_comes_from_this_machine(studio: Studio, looker: Looker) -> None:
    """All that the browser asked for since before the page was loaded: files and the websocket."""
    places = {(url.scheme, url.netloc) for url in map(urlsplit, looker.asked)}
    here = urlsplit(studio.address).netloc
    assert ("http", here) in places
    assert ("ws", here) in places
    assert {netloc for scheme, netloc in places if scheme not in ("blob", "data")} == {here}


def test_numbers_and_choices_are_set_on_the_page(studio: Studio, looker: Looker) -> None:
    before = last(studio).numbers["controller"]
    looker.tab("Method")
    looker.type("stiffness [1/s²]", "3")
    until(lambda: last(studio).numbers["controller"]["stiffness"] == 3.0, "the stiffness")
    looker.unfold("Limits and weights", "slack weight")
    looker.type("slack weight", "200")
    until(lambda: last(studio).numbers["controller"]["torque_slack_weight"] == 200.0, "the weight")
    looker.unfold("Body", "ellipsoids")
    looker.choose("ellipsoids", "1")
    until(lambda: last(studio).numbers["controller"]["ellipsoids"] == 1, "the number of ellipsoids")
    links = list(studio.view.body.body.links)  # type: ignore[union-attr]
    assert len(links) == len(set(links))
    changed = {"stiffness": 3.0, "torque_slack_weight": 200.0, "ellipsoids": 1}
    assert last(studio).numbers["controller"] == before | changed
    looker.press("Recommended values")
    until(
        lambda: last(studio).numbers["controller"]["stiffness"] == before["stiffness"], "the usual stiffness"
    )
    assert last(studio).numbers["controller"] == METHODS["controller"].defaults | {"ellipsoids": 1}
    studio.send(m.SetNumbers("controller", before))
    until(lambda: last(studio).numbers["controller"] == before, "the numbers of the other tests")


def test_the_system_is_exported_as_python(studio: Studio, looker: Looker) -> None:
    now = last(studio)
    looker.tab("Method")
    for parameter in METHODS["controller"].parameters:  # readable without a mouse over it
        assert looker.page.get_by_text(parameter.sentence).count() == 1
    looker.press("Export as Python")
    with looker.page.expect_download() as download:
        looker.click("[role=dialog] button:has-text('Download')")
    code = download.value.path().read_text()
    assert code == python_snippet(now)
    looker.answer("Close")


def test_nothing_went_wrong_in_the_browser(looker: Looker) -> None:
    assert looker.errors == []
