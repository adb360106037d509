"""The depth camera on the page, in a real browser without a display."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from sidestep.studio import messages as m
from sidestep.studio.sight import CameraState
from sidestep.studio.studio import Studio
from studio.egl import NEEDS_EGL
from studio.looker import ON_THE_PAGE, Looker, last, until

pytestmark = [*ON_THE_PAGE, NEEDS_EGL, pytest.mark.slow]

IMAGES = 5


@pytest.fixture
def camera(studio: Studio) -> Iterator[None]:
    """The camera is off again at the end."""
    yield
    studio.send(m.SetCamera(None))
    until(lambda: last(studio).camera.choice is None, "the end of the camera")


def count_of(looker: Looker, kind: str) -> str:
    """The number that the legend shows of a kind."""
    return str(looker.page.locator(f"#camera-legend tr[data-kind='{kind}'] b").inner_text())


def has_images(state: CameraState, more_than: int) -> bool:
    return state.sight is not None and state.sight.number > more_than


@pytest.mark.usefixtures("camera")
def test_the_arm_goes_by_what_a_camera_sees(studio: Studio, looker: Looker) -> None:
    looker.tab("Camera")
    assert looker.page.locator("#camera").inner_text() == "The camera is off."
    looker.choose("place", "front right")
    assert last(studio).camera.choice is None  # a place alone does not switch it on
    looker.check("depth camera")
    until(lambda: last(studio).camera.choice is not None, "the camera")
    choice = last(studio).camera.choice
    assert choice is not None
    assert (choice.place, choice.only, choice.noise, choice.unseen_is_free) == (
        "front right",
        True,
        "d435",
        True,
    )
    studio.send(m.SetRunning(True))
    until(lambda: has_images(last(studio).camera, IMAGES), "images")
    until(lambda: np.abs(last(studio).q - last(studio).goal).max() < 1e-2, "the goal")
    assert last(studio).touched == 0
    studio.send(m.SetRunning(False))
    until(lambda: not last(studio).running, "the pause")
    looker.image()  # all is on the page
    sight = last(studio).camera.sight
    assert sight is not None
    view = studio.view.sight
    assert view.counts["seen"] + view.counts["hidden"] + view.counts["remembered"] == len(sight.kinds)
    until(lambda: count_of(looker, "seen") == str(view.counts["seen"]), "the count, on the page")
    assert view.counts["seen"] > 20
    assert count_of(looker, "arm") == f"{100 * sight.pixels['arm']:.1f} %"
    shown = looker.page.locator("#camera").locator("xpath=preceding::img[1]")
    assert shown.evaluate("image => [image.naturalWidth, image.naturalHeight]") == [320, 240]
    assert f"image {sight.number}" in looker.page.locator("#camera").inner_text()
    assert "ms from image to obstacles" in looker.page.locator("#camera-times").inner_text()
    assert looker.errors == []


@pytest.mark.usefixtures("camera")
def test_the_camera_stands_where_somebody_looks_from(studio: Studio, looker: Looker) -> None:
    looker.tab("Camera")
    until(lambda: not looker.is_checked("depth camera"), "the end of the camera before, on the page")
    looker.check("depth camera")
    until(lambda: last(studio).camera.choice is not None, "the camera")
    looker.press("Place it where I look from")
    until(lambda: last(studio).camera.choice.place == "from my view", "its place")  # type: ignore[union-attr]
    choice = last(studio).camera.choice
    assert choice is not None
    camera = next(iter(studio.server.get_clients().values())).camera
    np.testing.assert_allclose(choice.pose[:3, 3], camera.position, atol=1e-6)
    way = camera.look_at - camera.position
    np.testing.assert_allclose(choice.pose[:3, 2], way / np.linalg.norm(way), atol=1e-6)
    looker.check("depth camera")
    until(lambda: last(studio).camera.choice is None, "its end")
    until(lambda: studio.view.sight.counts == {}, "the end of its cells")
