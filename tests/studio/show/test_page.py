"""The page of `sidestep show` in a real browser: a slider that a person moves turns the arm."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, cast

import numpy as np
import pytest

from sidestep.studio.show.reading import read
from sidestep.studio.show.show import Show
from sidestep.studio.studio import Studio
from studio.looker import NO_CHROMIUM, Looker, differ, until

pytestmark = [NO_CHROMIUM, pytest.mark.slow]


@pytest.fixture(scope="module")
def show() -> Iterator[Show]:
    with Show(read("planar2", {}), port=0) as running:
        running.wait_ready()
        running.server.scene.configure_default_lights(cast_shadow=False)  # half the time of a frame
        yield running


@pytest.fixture(scope="module")
def window(chromium: Any, show: Show) -> Looker:
    return Looker(chromium, cast(Studio, show))  # it asks for address, server and view alone


def test_a_slider_turns_the_arm(show: Show, window: Looker) -> None:
    view = show.view
    assert view is not None
    before = window.image()
    window.type("joint1 [°]", "60")
    until(lambda: bool(np.isclose(view.arm.q[0], np.deg2rad(60.0))), "the configuration")
    after = window.image()
    assert differ(before, after).sum() > 1500  # [px] the arm is some 150 x 20 pixels large here, or more
    x, y = window.on_screen(show._reading.robot.pose(view.arm.q, "link2")[:3, 3])
    assert differ(before, after)[round(y) - 12 : round(y) + 12, round(x) - 12 : round(x) + 12].any()


def test_a_button_puts_it_back(show: Show, window: Looker) -> None:
    view = show.view
    assert view is not None
    window.press("Zero")
    until(lambda: bool(np.allclose(view.arm.q, 0.0)), "the posture")
    until(lambda: window.typed("joint1 [°]") == "0", "the slider")


def test_shapes_are_switched_on(show: Show, window: Looker) -> None:
    view = show.view
    assert view is not None
    window.check("collision shapes")
    until(lambda: len(view.collision) == 2 and all(part.visible for part in view.collision), "the shapes")
    window.check("ellipsoids")
    assert view.body is not None
    batches = view.body._batches.values()
    until(lambda: all(batch.visible for batch in batches), "the ellipsoids")


def test_the_panel_lists_joints_and_links(window: Looker) -> None:
    window.tab("Joints")
    window.page.get_by_text("velocity 5 rad/s").first.wait_for()
    window.tab("Links")
    window.page.get_by_text("collision: 1 box").first.wait_for()


def test_nothing_went_wrong_in_the_browser(window: Looker) -> None:
    assert window.errors == []
