"""The page in a real browser, without a display."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sidestep import ExactClearance, Scenario
from sidestep.studio import messages as m
from sidestep.studio.headless import find_chromium
from sidestep.studio.studio import Studio
from sidestep.studio.truth import solid_poses
from studio.looker import Looker, differ, last, reset, until

pytestmark = pytest.mark.skipif(
    find_chromium() is None,
    reason="there is no Chromium here (apt-get install chromium, or SIDESTEP_CHROMIUM)",
)


@pytest.fixture(scope="module", autouse=True)
def at_the_start(studio: Studio) -> None:
    """The first test begins with the arm at its start; each goes on where the one before it ended."""
    reset(studio)


def test_the_arm_is_on_the_page(studio: Studio, looker: Looker) -> None:
    with_arm = looker.image()
    studio.view.arm.root.visible = False
    without = looker.image()
    studio.view.arm.root.visible = True
    changed = differ(with_arm, without)
    assert changed.sum() > 1500  # [px] the arm of one metre is some 150 x 20 pixels large here, or more
    robot, q = studio.view.robot, last(studio).q
    x, y = looker.on_screen(robot.pose(q, "link2")[:3, 3])
    assert changed[round(y) - 12 : round(y) + 12, round(x) - 12 : round(x) + 12].any()


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
    until(lambda: last(studio).recording, "recording")
    before = last(studio)
    ball = before.poses[0][:3, 3]
    # The goal first, then the ball from its place to where the tip passes: the plane of the drag faces the camera.
    target = studio.view.robot.pose(before.q + np.array([0.5, 0.0]), studio.view.tip)[:3, 3]
    studio.send(m.SetJointGoal(before.q + np.array([1.0, 0.0])))
    looker.drag(ball, target)
    moved = lambda: float(np.linalg.norm(last(studio).poses[0][:3, 3] - ball))  # noqa: E731
    until(lambda: moved() > 0.1, "the drag")
    begin = last(studio).time
    until(lambda: last(studio).time > begin + 3.0, "three seconds")
    studio.send(m.SetRecording(False))
    studio.send(m.SetRunning(False))  # the browser has time for the next tests
    until(lambda: not last(studio).recording, "the end of the recording")
    rows = studio.view.recorder.rows
    things = rows[0].things
    exact = ExactClearance(studio.view.robot, [solid for thing in things for solid in thing.solids])
    poses = np.array([solid_poses(things, row.poses) for row in rows])
    worst = exact.decided_minimum(np.array([row.q for row in rows]), poses)
    assert rows[-1].time - rows[0].time > 3.0
    assert worst.clearance.distance > 0.0
    assert last(studio).touched == 0


def test_the_method_is_switched_on_the_page(studio: Studio, looker: Looker) -> None:
    assert last(studio).method == "barrier"
    looker.tab("Method")
    looker.choose("method", "thesis: unswitched")
    until(lambda: last(studio).method == "unswitched", "the method")
    studio.send(m.SetRunning(True))
    until(lambda: len(last(studio).values) == 1, "its one density")
    studio.send(m.SetRunning(False))
    looker.choose("method", "barriers (recommended)")
    until(lambda: last(studio).method == "barrier", "the method")


def test_a_scenario_is_saved_and_loaded_on_the_page(studio: Studio, looker: Looker, folder: Path) -> None:
    studio.send(m.SetRunning(False))
    until(lambda: not last(studio).running, "the pause")
    before = last(studio)
    looker.tab("Scenario")
    looker.type("name", "kept")
    looker.press("Save")
    until((folder / "kept.yaml").is_file, "the file")
    saved = Scenario.load(folder / "kept.yaml")
    np.testing.assert_allclose(saved.start.position, before.q, atol=1e-5)  # the file has six digits
    np.testing.assert_allclose(saved.obstacles[0].position, before.poses[0][:3, 3], atol=1e-5)
    studio.send(m.RemoveThing("ball"))
    until(lambda: not last(studio).things, "the removal")
    with looker.page.expect_file_chooser() as chooser:
        looker.press("Load a file …")
    chooser.value.set_files(folder / "kept.yaml")
    until(lambda: last(studio).scenario.name == "kept", "the loaded scenario")
    again = last(studio)
    assert [thing.name for thing in again.things] == ["ball"]
    np.testing.assert_allclose(again.poses[0], before.poses[0], atol=1e-5)


def test_a_second_browser_sees_the_same(studio: Studio, looker: Looker, chromium: Any) -> None:
    studio.send(m.SetRunning(False))
    # A moving scene would leave the machine no time to load the page.
    until(lambda: not last(studio).running, "the pause")
    second = Looker(chromium, studio)
    looker.tab("Goal")
    second.tab("Goal")
    looker.type("joint2 [°]", "25")
    until(lambda: bool(np.isclose(last(studio).goal[1], np.deg2rad(25.0))), "the goal")  # type: ignore[index]
    field = "xpath=//label[normalize-space()='joint2 [°]']/following::input[not(@type='hidden')][1]"
    until(
        lambda: second.page.locator(field).first.input_value() == "25", "the same field in the other window"
    )
    assert differ(looker.image(), second.image()).mean() < 0.02  # up to a cursor and a hover in the panels
    assert second.errors == []
    second.page.close()


def test_nothing_went_wrong_in_the_browser(looker: Looker) -> None:
    assert looker.errors == []
