"""Obstacles and recordings on the page, in a real browser without a display."""

from __future__ import annotations

import logging
import zipfile
from pathlib import Path

import numpy as np
import pytest

from sidestep import ExactClearance, Scenario
from sidestep.studio import messages as m
from sidestep.studio.clearance_monitor import solid_poses
from sidestep.studio.page.placing import CLEAR
from sidestep.studio.scene_obstacle import things_of
from sidestep.studio.studio import Studio
from studio.looker import ON_THE_PAGE, Looker, differ, last, run_to, until

pytestmark = [*ON_THE_PAGE, pytest.mark.slow]


def test_a_cloud_is_added_dragged_thrown_and_removed(studio: Studio, looker: Looker) -> None:
    looker.tab("Obstacles")
    looker.choose("new", "cloud")
    looker.type("size [cm]", "20")
    without = looker.image()
    looker.press("Add")
    until(lambda: len(last(studio).things) == 2, "the cloud")
    thing = last(studio).things[1]
    assert thing.cloud is not None
    assert len(thing.cloud) == 64  # a plate of 20 cm with a point every 2.5 cm
    until(lambda: thing.name in studio.view.obstacles.names, "its picture")
    assert differ(without, looker.image()).sum() > 200  # [px]
    now = last(studio)
    exact = ExactClearance(studio.view.loop.robot, thing.solids)
    for q in (now.q, now.posture.q):
        assert exact.distance(q, solid_poses((thing,), now.poses[1:])).distance > CLEAR
    before = now.poses[1][:3, 3]
    to = before + np.array([0.0, 0.3, 0.0])
    studio.send(m.SetRunning(True))
    looker.drag(before + thing.cloud[np.abs(thing.cloud).sum(axis=1).argmin()], to)
    until(lambda: float(np.linalg.norm(last(studio).poses[1][:3, 3] - before)) > 0.1, "the drag")
    assert studio.view.obstacle_panel._chosen.value == thing.name  # what was added is chosen
    looker.press("Throw at the arm")
    until(lambda: bool(np.linalg.norm(last(studio).velocities[1]) > 0.4), "the throw")  # at 0.5 m/s
    looker.press("Remove")
    until(lambda: [thing.name for thing in last(studio).things] == ["ball"], "the removal")


def test_a_cloud_file_is_added(studio: Studio, looker: Looker, tmp_path: Path) -> None:
    points = np.random.default_rng(0).uniform(-0.1, 0.1, (30, 3)) + np.array([-0.8, 0.0, 0.0])
    np.save(tmp_path / "wall.npy", points)
    looker.tab("Obstacles")
    with looker.page.expect_file_chooser() as chooser:
        looker.press("Add a point cloud file …")
    chooser.value.set_files(tmp_path / "wall.npy")
    until(lambda: len(last(studio).things) == 2, "the cloud")
    first = last(studio).things[1]
    np.testing.assert_array_equal(first.cloud, points)
    other = points[:20] + np.array([0.0, 0.0, 0.5])
    np.save(tmp_path / f"{first.name}.npy", other)  # named as what the studio keeps of the first
    looker.page.locator("button:not([disabled])").get_by_text("Add a point cloud file …").wait_for()
    with looker.page.expect_file_chooser() as chooser:
        looker.press("Add a point cloud file …")
    chooser.value.set_files(tmp_path / f"{first.name}.npy")
    until(lambda: len(last(studio).things) == 3, "the other cloud")
    until(lambda: studio.view.loop.last is not None and len(studio.view.loop.last.things) == 3, "its picture")
    looker.tab("Scenario")
    looker.type("name", "clouds")
    with looker.page.expect_download() as download:
        looker.press("Download")
    assert download.value.suggested_filename == "clouds.zip"
    with zipfile.ZipFile(download.value.path()) as archive:
        archive.extractall(tmp_path / "taken")
    taken = things_of(Scenario.load(tmp_path / "taken" / "clouds.yaml"))
    np.testing.assert_array_equal(taken[1].cloud, points)
    np.testing.assert_array_equal(taken[2].cloud, other)


def test_what_is_refused_leaves_its_place_free(
    studio: Studio, looker: Looker, monkeypatch: pytest.MonkeyPatch
) -> None:
    panel = studio.view.obstacle_panel
    looker.tab("Obstacles")
    with monkeypatch.context() as patch:
        patch.setattr(panel, "_new_name", lambda _: "ball")  # as when two windows add at one time
        looker.press("Add")
        looker.page.get_by_text("two obstacles are called 'ball'").first.wait_for()
    assert studio.error == "two obstacles are called 'ball'; names must differ"
    studio.error = ""  # else the next test would take it for its own
    assert panel._sent == []
    assert len(last(studio).things) == 1


def test_a_ball_is_thrown_with_the_mouse(studio: Studio, looker: Looker) -> None:
    ball = last(studio).poses[0][:3, 3]
    studio.send(m.SetRunning(True))
    looker.drag(ball, ball + np.array([0.0, 0.3, 0.1]), key="Shift")
    until(
        lambda: float(np.linalg.norm(last(studio).poses[0][:3, 3] - ball)) > 0.5, "the flight"
    )  # [m] the hand let go after 0.3


def test_a_motion_is_recorded_and_replayed(studio: Studio, looker: Looker) -> None:
    recorder, view = studio.view.recorder, studio.view
    view.switches.metric.value = True
    looker.tab("Scenario")
    looker.press("Record")
    until(lambda: last(studio).recording and last(studio).time > 1.0, "a second of motion")
    looker.press("Stop")
    until(lambda: not last(studio).recording, "the end of the recording")
    rows = recorder.rows
    np.testing.assert_allclose(np.diff([row.time for row in rows]), 0.005, atol=1e-9)
    run_to(studio, last(studio).time + 0.5)  # the arm is elsewhere now
    looker.press("Play")
    until(lambda: recorder.replaying and np.array_equal(view.arm.q, rows[-1].q), "the replay's end")
    # What the replay has set may still be on its way to the page, and would replace what is typed.
    until(
        lambda: float(looker.typed("moment [s]") or "nan") == round(recorder.length, 2), "the end on the page"
    )
    looker.type("moment [s]", "0.5")
    shown = rows[int(np.searchsorted([row.time for row in rows], rows[0].time + 0.5))]
    until(lambda: np.array_equal(view.arm.q, shown.q), "the moment")
    exact = ExactClearance(view.loop.robot, [solid for thing in shown.things for solid in thing.solids])
    nearest = exact.distance(shown.q, solid_poses(shown.things, shown.poses))
    line = [nearest.point_on_link, nearest.point_on_obstacle]
    until(
        lambda: np.allclose(view.marks.nearest.points[0], line, atol=1e-4), "its nearest line"
    )  # single precision
    tip = view.loop.robot.pose(shown.q, view.loop.tip)[:3, 3]
    np.testing.assert_allclose(view.marks.trail.points[-1, 1], tip, atol=1e-6)
    np.testing.assert_allclose(view.marks.metric.position, tip, atol=1e-9)
    until(lambda: view.plots._handles[1].data[0][0] > -0.6, "half a second in the plots")
    assert not view.goal.gizmo.visible  # the goal is that of the live state
    assert "Replay of" in view.words.text
    with looker.page.expect_download() as download:
        looker.press("Download recording")
    kept = np.load(download.value.path())
    np.testing.assert_array_equal(kept["q"], [row.q for row in rows])
    looker.press("Live")
    until(lambda: np.array_equal(view.arm.q, last(studio).q), "the live state")
    assert not recorder.replaying
    until(lambda: view.goal.gizmo.visible, "the goal")
    view.switches.metric.value = False


def test_a_ball_dragged_while_paused_moves_and_its_numbers_follow(studio: Studio, looker: Looker) -> None:
    looker.tab("Obstacles")
    before = last(studio).poses[0][:3, 3]
    looker.drag(before, before + np.array([0.0, 0.3, 0.0]))
    until(lambda: float(np.linalg.norm(last(studio).poses[0][:3, 3] - before)) > 0.1, "the drag")
    now = last(studio)
    assert not now.running
    assert now.time == 0.0
    fields = studio.view.obstacle_panel._place
    until(
        lambda: np.allclose(fields.value, last(studio).poses[0][:3, 3], atol=6e-4), "the numbers"
    )  # of 1 mm
    view = studio.view
    until(lambda: view.marks.nearest.visible, "the nearest line")

    def ends_on_the_ball() -> bool:
        off = np.linalg.norm(view.marks.nearest.points[0, 1] - last(studio).poses[0][:3, 3])
        return bool(np.isclose(off, 0.06, atol=1e-4))  # [m] its radius, in single precision

    until(ends_on_the_ball, "its clearance")


def test_what_goes_wrong_while_drawing_is_said_and_drawing_goes_on(
    studio: Studio, looker: Looker, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise RuntimeError("a pen broke")

    with monkeypatch.context() as patch, caplog.at_level(logging.ERROR):
        patch.setattr(studio.view.marks, "show_metric", fail)
        looker.page.get_by_text("drawing failed: RuntimeError: a pen broke").first.wait_for()
    assert [record.getMessage() for record in caplog.records] == ["drawing failed: RuntimeError: a pen broke"]
    run_to(studio, 0.2)
    until(lambda: np.array_equal(studio.view.arm.q, last(studio).q), "the arm where it is")


def test_nothing_went_wrong_in_the_browser(looker: Looker) -> None:
    assert looker.errors == []
