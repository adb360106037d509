"""A browser window on the studio, for tests: Chromium without a display, driven by Playwright."""

from __future__ import annotations

import io
import re
import time as clock
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from sidestep.math.pose import from_quaternion
from sidestep.scenario.scenario import RobotConfig
from sidestep.studio import messages as m
from sidestep.studio.headless import Window, find_chromium, go_to, new_page, picture
from sidestep.studio.page.view import MAIN_WIDTH, PLOT_WIDTH
from sidestep.studio.start import scenario_of
from sidestep.studio.studio import Studio

NO_CHROMIUM = pytest.mark.skipif(
    find_chromium() is None,
    reason="there is no Chromium here (apt-get install chromium, or SIDESTEP_CHROMIUM)",
)
# Marks of tests in the browser, each of which begins as `at_the_start` says.
ON_THE_PAGE = [NO_CHROMIUM, pytest.mark.usefixtures("at_the_start")]
DOCUMENT = Path(__file__).parents[2] / "docs" / "how-to" / "studio.md"
PATIENCE = 120.0  # [s] at most for anything: a busy machine without a graphics card draws a frame in seconds
PASSIVE = "Unable to preventDefault inside passive event listener"  # the browser's own note on viser's lists
# A slow browser applies what it was told of a component in the same frame as its removal, after the removal. Who writes
# to a component that is removed already is stopped by viser itself, in Python.
REMOVED = "Tried to update non-existent component"
WINDOW = Window(1080, 560)
ADVANCED = ("Method", "Show", "Scenario")  # tabs inside of the tab of this name
PANELS = PLOT_WIDTH + 10, MAIN_WIDTH + 10  # [px] at the sides of a scene


class Looker:
    """A browser window on the studio, what went wrong in it and what it asked for, from before the page is loaded."""

    def __init__(self, chromium: Any, studio: Studio, window: Window = WINDOW) -> None:
        self.errors: list[str] = []
        self.asked: list[str] = []
        self.studio = studio
        self.page = new_page(chromium, window)
        self.page.set_default_timeout(1e3 * PATIENCE)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("console", self._hear)
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.on("websocket", lambda socket: self.asked.append(socket.url))
        go_to(self.page, studio.address)

    def _hear(self, said: Any) -> None:
        if said.type == "error" and PASSIVE not in said.text and REMOVED not in said.text:
            self.errors.append(said.text)

    def click(self, selector: str) -> None:
        """Clicks without waiting for animations, which take long without a graphics card."""
        box = self._box(self.page.locator(selector).first)
        self.page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])

    def _box(self, found: Any) -> dict[str, float]:
        """Where an element is [px], once it is there."""
        found.wait_for(state="visible")
        found.evaluate("element => element.scrollIntoView({block: 'nearest'})")
        box: dict[str, float] = found.bounding_box()
        return box

    def tab(self, name: str) -> None:
        """Chooses a tab; those inside of Advanced after that one."""
        if name in ADVANCED:
            self.tab("Advanced")
        found = self.page.locator(f'[role=tab][title="{name}"]').first

        def chosen() -> bool:
            if found.get_attribute("aria-selected") != "true":
                found.focus()
                found.press("Enter")
            return bool(found.get_attribute("aria-selected") == "true")

        until(chosen, f"the tab {name}")

    def type(self, label: str, text: str) -> None:
        """Types into the field beside a label."""
        field = self.page.locator(self._field(label))
        field.fill(text, force=True)
        field.press("Enter")

    def typed(self, label: str) -> str:
        """What stands in the field beside a label."""
        return str(self.page.locator(self._field(label)).input_value())

    def _field(self, label: str) -> str:
        return f"xpath=//label[normalize-space()='{label}']/following::input[not(@type='hidden')][1]"

    def choose(self, label: str, option: str) -> None:
        """Chooses an option of the list beside a label."""
        self.click(self._field(label))
        self.click(f"[role=option][value='{option}']:visible")

    def press(self, name: str) -> None:
        """Clicks the button of this name."""
        self.click(f'role=button[name="{name}"]')

    def answer(self, name: str) -> None:
        """Presses a button of the question that is asked, which then goes away."""
        button = self.page.locator(f"[role=dialog] button:has-text('{name}')")
        button.focus()  # it moves while it appears: a click may miss it
        button.press("Enter")
        self.page.locator("[role=dialog]").wait_for(state="detached")

    def unfold(self, title: str, label: str) -> None:
        """Opens a folder, so that the label in it is seen."""
        inside = self.page.locator(f"xpath=//label[normalize-space()='{label}']").first
        header = self.page.locator(f"xpath=//*[normalize-space(text())='{title}']").first

        def is_open() -> bool:
            if not inside.is_visible():
                header.dispatch_event("click")  # it may be moving
                self.page.wait_for_timeout(300.0)
            return bool(inside.is_visible())

        def at_rest() -> bool:
            before = inside.bounding_box()
            self.page.wait_for_timeout(200.0)
            return bool(before == inside.bounding_box())

        until(is_open, f"the folder {title}")
        until(at_rest, f"the end of opening {title}")

    def check(self, label: str) -> None:
        """Clicks the box beside a label."""
        self.click(self._checkbox(label))

    def is_checked(self, label: str) -> bool:
        """Whether the box beside a label is checked, as the browser shows it."""
        return bool(self.page.locator(self._checkbox(label)).is_checked())

    def _checkbox(self, label: str) -> str:
        return f"xpath=//label[normalize-space()='{label}']/following::input[@type='checkbox'][1]"

    def drag(self, begin: np.ndarray, end: np.ndarray, *, key: str | None = None) -> None:
        """Draws with the mouse from a point (3,) of the world to another, perhaps with a key held."""
        mouse, keyboard = self.page.mouse, self.page.keyboard
        (x0, y0), (x1, y1) = self.on_screen(begin), self.on_screen(end)
        mouse.move(x0, y0)
        if key is not None:
            keyboard.down(key)
        mouse.down()
        for share in np.linspace(0.1, 1.0, 6):
            mouse.move(x0 + share * (x1 - x0), y0 + share * (y1 - y0))
        mouse.up()
        if key is not None:
            keyboard.up(key)

    def on_screen(self, point: np.ndarray) -> tuple[float, float]:
        """Where a point (3,) of the world is in the window [px]."""
        camera = next(iter(self.studio.server.get_clients().values())).camera
        x, y, z = from_quaternion(camera.wxyz).T @ (point - camera.position)  # OpenCV: z forward, y down
        box = self._box(self.page.locator("canvas").first)
        focal = 0.5 * box["height"] / np.tan(0.5 * camera.fov)
        return box["x"] + 0.5 * box["width"] + focal * x / z, box["y"] + 0.5 * box["height"] + focal * y / z

    def scene(self) -> np.ndarray:
        """The picture without the panels at its sides."""
        return self.image()[:, round(PANELS[0]) : round(WINDOW.width - PANELS[1])]

    def image(self) -> np.ndarray:
        return np.asarray(Image.open(io.BytesIO(picture(self.studio, self.page))).convert("RGB"), dtype=int)


def documented_code() -> str:
    """What the documentation says to type into a notebook."""
    found = re.search(r"## Notebooks.*?```python\n(.*?)```", DOCUMENT.read_text(encoding="utf-8"), re.DOTALL)
    assert found is not None
    return found[1]


def until(condition: Callable[[], bool], what: str) -> None:
    end = clock.monotonic() + PATIENCE
    while not condition():
        assert clock.monotonic() < end, f"{what}: not within {PATIENCE:.0f} s"
        clock.sleep(0.02)


def last(studio: Studio) -> m.Snapshot:
    assert studio.error == "", studio.error
    assert studio.snapshot is not None
    return studio.snapshot


def run_to(studio: Studio, time: float) -> m.Snapshot:
    """Runs to a simulated time [s] and pauses there."""
    studio.send(m.SetRunning(True, until=time))
    until(lambda: not last(studio).running and last(studio).time > time - 0.01, f"{time} s")
    return last(studio)


def reset(studio: Studio) -> None:
    """Puts planar2 at its start, paused, with one ball, shown live."""
    studio.view.recorder.show_live()
    studio.send(m.Load(scenario_of(RobotConfig(name="planar2")), "controller"))
    studio.send(m.Restart(until=0.0))
    until(lambda: len(last(studio).things) == 1 and last(studio).time == 0.0, "the start")


def differ(image: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Which pixels differ by more than the noise of the rendering."""
    found: np.ndarray = np.abs(image - other).max(axis=2) > 24  # of 255
    return found
