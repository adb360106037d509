"""The page in a real browser, without a display: Chromium, driven by Playwright."""

from __future__ import annotations

import io
import time as clock
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from sidestep import ExactClearance, Scenario
from sidestep.pose import from_quaternion
from sidestep.scenario.scenario import RobotChoice
from sidestep.studio import messages as m
from sidestep.studio.headless import Window, browser, find_chromium, open_page, picture
from sidestep.studio.start import scenario_of
from sidestep.studio.studio import Studio
from sidestep.studio.truth import solid_poses

pytestmark = pytest.mark.skipif(
    find_chromium() is None,
    reason="there is no Chromium here (apt-get install chromium, or SIDESTEP_CHROMIUM)",
)

SMALL = 2  # ellipsoids per link: a second of work, and kept for all tests
PATIENCE = 120.0  # [s] at most for anything: a busy machine without a graphics card draws a frame in seconds
PASSIVE = "Unable to preventDefault inside passive event listener"  # the browser's own note on viser's lists
WINDOW = Window(1080, 560)


class Looker:
    """A browser window on the studio, and what went wrong in it."""

    def __init__(self, chromium: Any, studio: Studio) -> None:
        self.errors: list[str] = []
        self.studio = studio
        self.page = open_page(chromium, studio.address, WINDOW)
        self.page.set_default_timeout(1e3 * PATIENCE)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("console", self._hear)

    def _hear(self, said: Any) -> None:
        if said.type == "error" and PASSIVE not in said.text:
            self.errors.append(said.text)

    def click(self, selector: str) -> None:
        """Clicks without waiting for animations, which take long without a graphics card."""
        box = self._box(self.page.locator(selector).first)
        self.page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])

    def _box(self, found: Any) -> dict[str, float]:
        """Where an element is [px], once it is there."""
        found.wait_for(state="visible")
        box: dict[str, float] = found.bounding_box()
        return box

    def tab(self, name: str) -> None:
        found = self.page.locator(f'[role=tab][title="{name}"]').first

        def chosen() -> bool:
            if found.get_attribute("aria-selected") != "true":
                found.focus()
                found.press("Enter")
            return bool(found.get_attribute("aria-selected") == "true")

        until(chosen, f"the tab {name}")

    def type(self, label: str, text: str) -> None:
        """Types into the field beside a label."""
        field = self.page.locator(
            f"xpath=//label[normalize-space()='{label}']/following::input[not(@type='hidden')][1]"
        )
        field.fill(text, force=True)
        field.press("Enter")

    def choose(self, label: str, option: str) -> None:
        """Chooses an option of the list beside a label."""
        self.click(f"xpath=//label[normalize-space()='{label}']/following::input[not(@type='hidden')][1]")
        self.click(f"[role=option][value='{option}']:visible")

    def image(self) -> np.ndarray:
        return np.asarray(Image.open(io.BytesIO(picture(self.studio, self.page))).convert("RGB"), dtype=int)


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    with browser() as started:
        yield started


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("scenarios")


@pytest.fixture(scope="module")
def studio(folder: Path) -> Iterator[Studio]:
    scenario = scenario_of(RobotChoice(name="planar2"))
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        with Studio(scenario, port=0, ellipsoids=SMALL) as running:
            running.wait_ready(PATIENCE)
            running.send(m.SetRunning(False))
            running.server.scene.configure_default_lights(cast_shadow=False)  # half the time of a frame
            yield running


@pytest.fixture(scope="module")
def looker(chromium: Any, studio: Studio) -> Looker:
    return Looker(chromium, studio)


def until(condition: Callable[[], bool], what: str) -> None:
    end = clock.monotonic() + PATIENCE
    while not condition():
        assert clock.monotonic() < end, f"{what}: not within {PATIENCE:.0f} s"
        clock.sleep(0.02)


def last(studio: Studio) -> m.Snapshot:
    assert studio.error == ""
    assert studio.snapshot is not None
    return studio.snapshot


def on_screen(studio: Studio, looker: Looker, point: np.ndarray) -> tuple[float, float]:
    """Where a point (3,) of the world is in the window [px]."""
    camera = next(iter(studio.server.get_clients().values())).camera
    x, y, z = from_quaternion(camera.wxyz).T @ (point - camera.position)  # OpenCV: z forward, y down
    box = looker.page.locator("canvas").first.bounding_box()
    assert box is not None
    focal = 0.5 * box["height"] / np.tan(0.5 * camera.fov)
    return box["x"] + 0.5 * box["width"] + focal * x / z, box["y"] + 0.5 * box["height"] + focal * y / z


def test_the_arm_is_on_the_page(studio: Studio, looker: Looker) -> None:
    with_arm = looker.image()
    studio.view.arm.root.visible = False
    without = looker.image()
    studio.view.arm.root.visible = True
    changed = np.abs(with_arm - without).max(axis=2) > 24  # of 255: more than noise of the rendering
    assert changed.sum() > 1500  # [px] the arm of one metre is some 150 x 20 pixels large here, or more
    robot, q = studio.view.robot, last(studio).q
    x, y = on_screen(studio, looker, robot.pose(q, "link2")[:3, 3])
    assert changed[round(y) - 12 : round(y) + 12, round(x) - 12 : round(x) + 12].any()


def test_a_goal_set_on_the_page_is_reached(studio: Studio, looker: Looker) -> None:
    looker.tab("Goal")
    looker.type("joint1 [°]", "-20")
    until(lambda: bool(np.isclose(last(studio).goal[0], np.deg2rad(-20.0))), "the goal")  # type: ignore[index]
    looker.click("button:has-text('Run'):visible")
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
    mouse = looker.page.mouse
    mouse.move(*on_screen(studio, looker, ball))
    mouse.down()
    studio.send(m.SetJointGoal(before.q + np.array([1.0, 0.0])))
    x0, y0 = on_screen(studio, looker, ball)
    x1, y1 = on_screen(studio, looker, target)
    for share in np.linspace(0.1, 1.0, 6):
        mouse.move(x0 + share * (x1 - x0), y0 + share * (y1 - y0))
    mouse.up()
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
    looker.click("button:has-text('Save'):visible")
    until((folder / "kept.yaml").is_file, "the file")
    saved = Scenario.load(folder / "kept.yaml")
    np.testing.assert_allclose(saved.start.position, before.q, atol=1e-5)  # the file has six digits
    np.testing.assert_allclose(saved.obstacles[0].position, before.poses[0][:3, 3], atol=1e-5)
    studio.send(m.RemoveThing("ball"))
    until(lambda: not last(studio).things, "the removal")
    with looker.page.expect_file_chooser() as chooser:
        looker.click("button:has-text('Load a file'):visible")
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
    first, other = looker.image(), second.image()
    box = looker.page.locator("canvas").first.bounding_box()
    assert box is not None
    differ = np.abs(first - other).max(axis=2) > 24
    assert differ.mean() < 0.02  # the same pixels, up to a cursor and a hover in the panels
    assert second.errors == []
    second.page.close()


def test_nothing_went_wrong_in_the_browser(looker: Looker) -> None:
    assert looker.errors == []
