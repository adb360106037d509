"""What the page offers beside moving the arm, in a real browser: curved space, metric, clouds, throws, recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from sidestep.studio import messages as m
from sidestep.studio.export import python_snippet
from sidestep.studio.headless import ANIMATION_WIDTH, FRAME, film, find_chromium
from sidestep.studio.page.obstacles import gizmo_pose
from sidestep.studio.page.surface import on_surface
from sidestep.studio.studio import Studio
from studio.looker import PATIENCE, WINDOW, Looker, differ, last, reset, until

pytestmark = pytest.mark.skipif(
    find_chromium() is None,
    reason="there is no Chromium here (apt-get install chromium, or SIDESTEP_CHROMIUM)",
)


@pytest.fixture(autouse=True)
def at_the_start(studio: Studio) -> None:
    """Each test begins with the arm at its start, paused, and one ball."""
    reset(studio)


def run_to(studio: Studio, time: float) -> m.Snapshot:
    studio.send(m.SetRunning(True, until=time))
    until(lambda: not last(studio).running and last(studio).time > time - 0.01, f"{time} s")
    return last(studio)


def test_the_curved_space_is_drawn_with_the_way_on_it(studio: Studio, looker: Looker) -> None:
    looker.tab("Show")
    without = looker.image()
    looker.check("curved space")
    surface = studio.view.surface
    until(lambda: surface.heights is not None, "the surface")
    assert differ(without, looker.image()).sum() > 1500  # [px] of a square of 1.2 m
    end = run_to(studio, 1.0)
    until(lambda: studio.view.shown[0] == end.time, "the end")
    robot, heights = studio.view.robot, surface.heights
    assert heights is not None
    here = on_surface(robot, (0, 1), end.q, heights)
    way = np.array(surface.trail)
    np.testing.assert_allclose(way[-1], here, atol=0.006)  # [m] points of the way are 5 mm apart
    np.testing.assert_allclose(surface.place_of("state"), here, atol=1e-9)
    assert end.goal is not None
    np.testing.assert_allclose(
        surface.place_of("goal"), on_surface(robot, (0, 1), end.goal, heights), atol=1e-9
    )
    looker.check("curved space")
    until(lambda: surface.heights is None, "the end of the surface")


def test_the_metric_is_drawn_at_the_tip(studio: Studio, looker: Looker) -> None:
    run_to(studio, 0.5)
    looker.tab("Show")
    without = looker.image()
    looker.check("metric")
    until(lambda: studio.view.marks.metric.visible, "the metric")
    changed = differ(without, looker.image())
    x, y = looker.on_screen(studio.view.robot.pose(last(studio).q, studio.view.tip)[:3, 3])
    assert changed[round(y) - 25 : round(y) + 25, round(x) - 25 : round(x) + 25].any()
    looker.check("metric")
    until(lambda: not studio.view.marks.metric.visible, "the end of the metric")


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
    before = last(studio).poses[1][:3, 3]
    to = before + np.array([0.0, 0.3, 0.0])
    studio.send(m.SetRunning(True))
    looker.drag(before + thing.cloud[np.abs(thing.cloud).sum(axis=1).argmin()], to)
    until(lambda: float(np.linalg.norm(last(studio).poses[1][:3, 3] - before)) > 0.1, "the drag")
    looker.choose("obstacle", thing.name)
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
    np.testing.assert_array_equal(last(studio).things[1].cloud, points)


def test_a_ball_is_thrown_with_the_mouse(studio: Studio, looker: Looker) -> None:
    ball = last(studio).poses[0][:3, 3]
    studio.send(m.SetRunning(True))
    looker.drag(ball, ball + np.array([0.0, 0.3, 0.1]), key="Shift")
    until(
        lambda: float(np.linalg.norm(last(studio).poses[0][:3, 3] - ball)) > 0.5, "the flight"
    )  # [m] the hand let go after 0.3


def test_a_motion_is_recorded_and_replayed(studio: Studio, looker: Looker) -> None:
    recorder, view = studio.view.recorder, studio.view
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
    looker.type("moment [s]", "0.5")
    shown = rows[int(np.searchsorted([row.time for row in rows], rows[0].time + 0.5))]
    until(lambda: np.array_equal(view.arm.q, shown.q), "the moment")
    with looker.page.expect_download() as download:
        looker.press("Download recording")
    kept = np.load(download.value.path())
    np.testing.assert_array_equal(kept["q"], [row.q for row in rows])
    looker.press("Live")
    until(lambda: np.array_equal(view.arm.q, last(studio).q), "the live state")
    assert not recorder.replaying


def test_the_gizmo_sets_a_pose_goal(studio: Studio, looker: Looker) -> None:
    gizmo = studio.view.goal.gizmo
    before = gizmo_pose(gizmo)
    arrow = before[:3, :3] @ np.array([0.9 * gizmo.scale, 0.0, 0.0])
    looker.drag(before[:3, 3] + arrow, before[:3, 3] + arrow - before[:3, :3] @ np.array([0.2, 0.0, 0.0]))
    until(lambda: last(studio).goal_pose is not None, "a pose goal")
    until(lambda: np.allclose(last(studio).goal_pose, gizmo_pose(gizmo)), "the gizmo's pose")  # type: ignore[arg-type]
    pose = last(studio).goal_pose
    assert pose is not None
    moved = before[:3, :3].T @ (pose[:3, 3] - before[:3, 3])
    assert moved[0] == pytest.approx(
        -0.2, abs=0.08
    )  # as far as the mouse, up to perspective and a first pixel
    np.testing.assert_allclose(moved[1:], 0.0, atol=1e-6)  # the arrow moves it along its axis
    until(lambda: studio.view.goal.kind.content.startswith("**Goal: a pose**"), "the words")


def test_a_shipped_scenario_is_one_click_away(studio: Studio, looker: Looker) -> None:
    looker.tab("Scenario")
    looker.choose("shipped", "planar-one-obstacle")
    looker.press("Load")
    until(lambda: last(studio).scenario.name == "planar-one-obstacle", "the scenario")


def test_pictures_show_the_motion(studio: Studio, looker: Looker, tmp_path: Path) -> None:
    end, way = tmp_path / "end.png", tmp_path / "way.gif"
    film(studio, looker.page, duration=2 * FRAME, screenshot=end, video=way)
    assert last(studio).time == pytest.approx(2 * FRAME, abs=1e-3)  # one period
    assert Image.open(end).size == (WINDOW.width, WINDOW.height)
    animation = Image.open(way)
    assert animation.n_frames == 2  # type: ignore[attr-defined]
    assert animation.info["duration"] == 1e3 * FRAME
    assert animation.width == ANIMATION_WIDTH


def test_everything_comes_from_this_machine(studio: Studio, looker: Looker) -> None:
    loaded = looker.page.evaluate("performance.getEntriesByType('resource').map(entry => entry.name)")
    address = (studio.address, "blob:", "data:")
    assert [name for name in loaded if not name.startswith(address)] == []
    assert looker.page.url.startswith(studio.address)


def test_the_system_is_exported_as_python(studio: Studio, looker: Looker) -> None:
    now = last(studio)
    looker.tab("Method")
    looker.press("Export as Python")
    with looker.page.expect_download() as download:
        looker.click("[role=dialog] button:has-text('Download')")
    code = download.value.path().read_text()
    assert code == python_snippet(now)
    looker.click("[role=dialog] button:has-text('Close')")
    looker.page.locator("[role=dialog]").wait_for(state="detached")


def test_a_notebook_shows_the_page(studio: Studio, chromium: Any) -> None:
    notebook = chromium.new_page(viewport={"width": 1000, "height": 760})
    notebook.set_default_timeout(1e3 * PATIENCE)
    notebook.set_content(f"<h1>A notebook</h1>{studio._repr_html_()}")
    frame = notebook.frame_locator("iframe")
    frame.locator("#words").wait_for()
    frame.locator("canvas").first.wait_for()
    assert frame.locator("[role=tab][title='Obstacles']").count() == 1
    notebook.close()
