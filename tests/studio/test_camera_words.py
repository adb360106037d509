"""What the page says of a depth camera, and the picture of what it sees."""

from __future__ import annotations

import re

import numpy as np

from sidestep._core import PixelLabel
from sidestep.perception.colours import label_palette
from sidestep.studio.camera_choice import CameraChoice
from sidestep.studio.page.camera_words import words_of
from sidestep.studio.page.labelled_image import labelled_image
from sidestep.studio.sight import HIDDEN, REMEMBERED, SEEN, CameraState, Sight


def sight() -> Sight:
    return Sight(
        number=7,
        time=1.0,
        pose=np.eye(4),
        depth=np.ones((2, 2), np.float16),
        labels=np.zeros((2, 2), np.uint8),
        centres=np.zeros((4, 3), np.float32),
        radii=np.full(4, 0.01, np.float32),
        kinds=np.array([SEEN, REMEMBERED, REMEMBERED, HIDDEN], np.uint8),
        ages=np.array([0.0, 2.0, 5.5, 0.4], np.float32),
        unseen=np.zeros((9, 3), np.float32),
        pixels={label.name: 0.25 * (label.name in ("arm", "obstacle")) for label in PixelLabel},
        explained=0,
        times=(0.001, 0.002, 0.003, 0.0, 0.0045),
        rendering=0.06,
        question="",
    )


def row_of(words: str, kind: str) -> list[str]:
    """The cells of the row of a kind."""
    found = re.search(rf'<tr data-kind="{kind}">(.*?)</tr>', words)
    assert found is not None
    return [re.sub("<[^>]*>", "", cell) for cell in re.findall("<td.*?</td>", found[1])][1:]


def test_counts_ages_and_times() -> None:
    state = CameraState(
        CameraChoice(np.eye(4), unseen_is_free=False),
        sight=sight(),
        age=0.12,
        lost=3,
        moving=np.zeros((2, 4)),
        speeds=np.array([0.1, 0.42]),
    )
    words = words_of(state, running=True)
    assert "image 7, 3 lost, captured 120 ms ago" in words
    assert row_of(words, "seen") == ["seen now", "1", ""]
    assert row_of(words, "remembered") == ["remembered", "2", "2.0 to 5.5 s"]
    assert row_of(words, "hidden") == ["hidden", "1", "0.4 to 0.4 s"]
    assert row_of(words, "unseen") == ["never looked at", "9", ""]
    assert row_of(words, "moving") == ["moving", "2", "up to 0.42 m/s"]
    assert row_of(words, "arm") == ["taken out as arm", "25.0 %", ""]
    assert "<b>10.5 ms</b> from image to obstacles: depth and edges 1.0, arm mask 2.0" in words


def test_what_is_missing_is_said() -> None:
    state = CameraState(error="simulated cameras need OpenGL <x>: the packages libegl1 and libgl1-mesa-dri")
    words = words_of(state, running=True)
    assert "<b>The camera is off:</b>" in words
    assert "OpenGL &lt;x&gt;: the packages libegl1 and libgl1-mesa-dri" in words
    assert "The camera is off." in words_of(CameraState(), running=True)
    on = CameraState(CameraChoice(np.eye(4)))
    assert "preparing the camera" in words_of(on, running=True)
    assert "the loop is paused" in words_of(on, running=False)


def test_near_is_light_and_the_arm_has_its_colour() -> None:
    names = ["obstacle", "obstacle", "arm", "edge", "nothing", "outside"]
    labels = np.array([[int(getattr(PixelLabel, name).value) for name in names]], np.uint8)
    depth = np.array([[1.0, 2.0, 1.0, 1.5, 0.0, 10.0]])
    picture = labelled_image(depth, labels)[0]
    assert (picture[0] == picture[0, 0]).all()  # grey
    assert picture[0, 0] > 230 > 100 > picture[1, 0]
    np.testing.assert_allclose(picture[2], label_palette()[int(PixelLabel.arm.value)], atol=3)  # the nearest
    white = label_palette()[int(PixelLabel.edge.value)]
    assert (picture[3] < white).all()  # farther off, darker
    assert picture[3].min() > 150
    assert (picture[4] == 0).all()
    assert picture[5].max() < 80
