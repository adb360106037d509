"""Pictures of every page and state of the studio, and of a report: python docs/screenshots_studio.py FOLDER [NAME ...]

Needs Chromium and `pip install 'sidestep[headless]'`. Names choose some of the pictures. Without a graphics card
each takes seconds, all together some minutes.
"""

from __future__ import annotations

import argparse
import time as clock
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from sidestep.report import write_report
from sidestep.scenario import Scenario
from sidestep.scenario.runner import run_scenario
from sidestep.studio import messages as m
from sidestep.studio.camera_choice import HAND, CameraChoice, camera_at
from sidestep.studio.gallery import GALLERY
from sidestep.studio.headless import (
    CLOSE_NOTICE,
    Window,
    browser,
    driver,
    go_to,
    new_page,
    picture,
    run_until,
)
from sidestep.studio.scene_obstacle import box
from sidestep.studio.show.reading import read
from sidestep.studio.show.show import Show
from sidestep.studio.start import starting_scenario
from sidestep.studio.studio import Studio

SMALL, LARGE = Window(1280, 800), Window(1920, 1080)
PLANAR = Path(__file__).parents[1] / "examples" / "planar3.urdf"
ADVANCED = ("Method", "Show", "Scenario")  # tabs inside of this tab
READY, PATIENCE = 600.0, 120.0  # [s] at most
CAMERA_IMAGES, CAMERA_MOMENT = 8, 2.0  # and [s], after which a picture of a camera shows what is hidden
FARTHER = 1.6  # times as far away as the window opens
MOMENT = 0.8  # [s] of simulated time at which the arm is on its way
NUM_THINGS = len(starting_scenario().obstacles)
DROPPED = (
    "([text, name]) => { const all = new DataTransfer(); all.items.add(new File([text], name)); return all; }"
)
TABS = ("Start", "Goal", "Obstacles", "Camera", "Compare", *ADVANCED)


class Photographer:
    """One browser for all pictures."""

    def __init__(self, chromium: Any, folder: Path) -> None:
        self._chromium, self._folder = chromium, folder

    @contextmanager
    def studio(self, window: Window, scenario: Scenario, **options: Any) -> Iterator[tuple[Studio, Any]]:
        """A studio that has run for `MOMENT`, and its page."""
        with Studio(scenario, port=0, **options) as studio:
            studio.wait_ready(READY)
            studio.send(m.Restart(until=0.0))
            page = new_page(self._chromium, window)
            try:
                go_to(page, studio.address)
                run_until(studio, MOMENT)
                yield studio, page
            finally:
                page.close()

    def keep(self, studio: Studio, page: Any, name: str) -> None:
        """Writes what the page shows."""
        (self._folder / f"{name}.png").write_bytes(picture(studio, page))
        print(f"{name}.png", flush=True)

    def file(self, name: str, path: Path, *, whole: bool) -> None:
        """Writes a picture of a page that needs no server, whole or its first screen."""
        page = self._chromium.new_page(viewport={"width": SMALL.width, "height": SMALL.height})
        page.goto(path.resolve().as_uri())
        page.screenshot(path=self._folder / f"{name}.png", full_page=whole)
        page.close()
        print(f"{name}.png", flush=True)

    @property
    def chromium(self) -> Any:
        return self._chromium

    @property
    def folder(self) -> Path:
        return self._folder


def choose(page: Any, tab: str) -> None:
    """Shows a tab."""
    for name in ("Advanced", tab) if tab in ADVANCED else (tab,):
        found = page.locator(f'[role=tab][title="{name}"]').first
        found.focus()
        found.press("Enter")
    page.wait_for_timeout(300.0)


def until(condition: Callable[[], bool], what: str) -> None:
    end = clock.monotonic() + PATIENCE
    while not condition():
        if clock.monotonic() > end:
            raise TimeoutError(f"{what}: not within {PATIENCE:.0f} s")
        clock.sleep(0.05)


def opening(camera: Photographer) -> None:
    """The page as it opens, in two windows."""
    for window in (SMALL, LARGE):
        with camera.studio(window, starting_scenario(), to_and_fro=True) as (studio, page):
            camera.keep(studio, page, f"opening-{window.width}x{window.height}")


def tabs(camera: Photographer) -> None:
    """Every tab."""
    with camera.studio(SMALL, starting_scenario(), to_and_fro=True) as (studio, page):
        for tab in TABS:
            choose(page, tab)
            camera.keep(studio, page, f"tab-{tab.lower()}")


def gallery(camera: Photographer) -> None:
    """Every scene."""
    for label, scene in GALLERY.items():
        with camera.studio(SMALL, scene.load(), to_and_fro=scene.to_and_fro) as (studio, page):
            camera.keep(studio, page, f"scene-{label.lower().replace(' ', '-')}")


def comparison(camera: Photographer) -> None:
    """Two methods, when both are on their way."""
    with camera.studio(SMALL, starting_scenario(), to_and_fro=True) as (studio, page):
        choose(page, "Compare")
        page.get_by_role("button", name="Compare", exact=True).click()
        panel = studio.view.compare
        until(lambda: panel.running is not None and panel.running.last is not None, "the other method")
        other = panel.running
        assert other is not None
        studio.view.loop.send(m.Restart())
        until(lambda: other.last is not None and MOMENT < other.last.time < 60.0, "its motion")
        studio.view.loop.send(m.SetRunning(False))
        clock.sleep(1.0)
        camera.keep(studio, page, "comparison")
        studio.view.loop.send(m.SetRunning(True))
        until(lambda: 6.0 < other.last.time < 60.0, "six seconds")  # type: ignore[union-attr]
        studio.view.loop.send(m.SetRunning(False))
        clock.sleep(1.0)
        camera.keep(studio, page, "comparison-at-the-end")


def goals(camera: Photographer) -> None:
    """A goal out of reach, and one that is blocked."""
    with camera.studio(SMALL, starting_scenario(), to_and_fro=True) as (studio, page):
        assert studio.snapshot is not None
        pose = studio.view.loop.robot.pose(studio.snapshot.q, studio.view.loop.tip)
        for name, place in (("out-of-reach", [1.2, 0.2, 0.5]), ("blocked", [0.55, 0.0, 0.3])):
            aim = pose.copy()
            aim[:3, 3] = np.array(place)
            studio.send(m.SetPoseGoal(aim))
            studio.send(m.SetRunning(True))
            begin = studio.snapshot.time
            until(lambda begin=begin: studio.snapshot.time > begin + 1.5, "the motion")  # type: ignore[misc, union-attr]
            studio.send(m.SetRunning(False))
            clock.sleep(1.0)
            camera.keep(studio, page, f"goal-{name}")


def obstacles(camera: Photographer) -> None:
    """A new box with three sides of its own."""
    with camera.studio(SMALL, starting_scenario(), to_and_fro=True) as (studio, page):
        studio.view.loop.send(
            m.AddObstacle(box("new box", np.array([0.75, 0.25, 0.5]), np.array([0.05, 0.3, 0.2])))
        )
        until(
            lambda: studio.snapshot is not None and len(studio.snapshot.things) == NUM_THINGS + 1, "the box"
        )
        studio.view.obstacle_panel.select("new box")
        choose(page, "Obstacles")
        camera.keep(studio, page, "obstacles-box")


def curved_space(camera: Photographer) -> None:
    """The curved space in its corner, with body and metric."""
    with camera.studio(SMALL, starting_scenario(), to_and_fro=True) as (studio, page):
        choose(page, "Show")
        for label in ("curved space", "body", "metric"):
            page.get_by_label(label, exact=True).first.check()
        until(lambda: studio.view.surface.heights is not None, "the curved space")
        camera.keep(studio, page, "advanced-curved-space")


def depth_camera(camera: Photographer) -> None:
    """A depth camera: in front, on the hand, and where space that nobody has seen is closed."""
    with camera.studio(SMALL, starting_scenario(), to_and_fro=True) as (studio, page):
        choose(page, "Camera")
        for client in studio.server.get_clients().values():  # farther away, where the camera is in the window
            target = np.array(client.camera.look_at)
            client.camera.position = target + FARTHER * (np.array(client.camera.position) - target)
        robot = studio.view.loop.robot
        for name, place, free in (
            ("", "front left", True),
            ("-hand", HAND, True),
            ("-closed", "above", False),
        ):
            pose, link = camera_at(place, robot)
            studio.send(
                m.SetCamera(CameraChoice(pose, link, place, rate=5.0, unseen_is_free=free, only=True))
            )
            studio.send(m.Restart())
            until(lambda place=place: shows(studio, place), "its images")  # type: ignore[misc]
            studio.send(m.SetRunning(False))
            clock.sleep(1.0)
            camera.keep(studio, page, f"depth-camera{name}")


def shows(studio: Studio, place: str) -> bool:
    """Whether there are images of a camera at this place, and enough of them."""
    state = None if studio.snapshot is None else studio.snapshot.camera
    if state is None or state.choice is None or state.sight is None or state.choice.place != place:
        return False
    return state.sight.time > CAMERA_MOMENT and state.sight.number > CAMERA_IMAGES


def own_robot(camera: Photographer) -> None:
    """A robot of a file that is dropped on the page, with its draft body: URDF and MJCF."""
    mujoco.mj_saveLastXML(str(camera.folder / "planar3.xml"), mujoco.MjModel.from_xml_path(str(PLANAR)))
    for file in (PLANAR, camera.folder / "planar3.xml"):
        with camera.studio(SMALL, starting_scenario(), to_and_fro=True) as (studio, page):
            content = file.read_text(encoding="utf-8")
            dropped = page.evaluate_handle(DROPPED, [content, file.name])
            page.dispatch_event("canvas", "drop", {"dataTransfer": dropped})
            until(lambda studio=studio: studio.view.loop.robot.num_coordinates == 3, "its picture")  # type: ignore[misc]
            run_until(studio, MOMENT)
            camera.keep(studio, page, f"own-robot-{file.suffix[1:]}")


def show(camera: Photographer) -> None:
    """What `sidestep show` says of a robot."""
    for window in (SMALL, LARGE):
        with Show(read("fr3", {}), port=0) as shown:
            shown.wait_ready()
            page = new_page(camera.chromium, window)
            page.goto(shown.address, timeout=1e3 * PATIENCE)
            page.wait_for_selector("canvas", timeout=1e3 * PATIENCE)
            page.wait_for_timeout(2000.0)
            page.evaluate(f"{CLOSE_NOTICE}; drawn().then(drawn).then(drawn)")
            page.screenshot(
                path=camera.folder / f"show-{window.width}x{window.height}.png", timeout=1e3 * PATIENCE
            )
            page.close()
            print(f"show-{window.width}x{window.height}.png", flush=True)


def report(camera: Photographer) -> None:
    """A report, whole."""
    folder = camera.folder / "report"
    write_report(run_scenario(Scenario.load("table")), folder, animation=False)
    camera.file("report", folder / "index.html", whole=True)


MAKERS = {
    maker.__name__.replace("_", "-"): maker
    for maker in (
        opening,
        tabs,
        gallery,
        comparison,
        goals,
        obstacles,
        curved_space,
        depth_camera,
        own_robot,
        show,
        report,
    )
}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*", help=f"of {', '.join(MAKERS)} [all]")
    options = parser.parse_args()
    unknown = [name for name in options.names if name not in MAKERS]
    if unknown:
        parser.error(f"there is no {unknown[0]!r}; known: {', '.join(MAKERS)}")
    options.folder.mkdir(parents=True, exist_ok=True)
    with driver() as playwright, browser(playwright) as chromium:
        camera = Photographer(chromium, options.folder)
        for name in options.names or MAKERS:
            MAKERS[name](camera)


if __name__ == "__main__":
    main()
