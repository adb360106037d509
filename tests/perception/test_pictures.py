"""Pictures of the stages of perception, pixel by pixel where they can be told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from sidestep.math.pose import look_at
from sidestep.perception import DepthCamera, Frame, PixelLabel
from sidestep.perception.colours import CELLS, MEANINGS, PIXELS, label_palette, rgb
from sidestep.perception.pictures import (
    BACKGROUND,
    cell_legend,
    cell_picture,
    depth_figure,
    depth_picture,
    label_picture,
    view_from_beside,
    write_stages,
)
from sidestep.perception.seen_stages import SeenStages

CAMERA = DepthCamera("front", width=640, height=480, fx=500.0, fy=500.0, cx=320.0, cy=240.0, pose=np.eye(4))


def stages(
    centres: list[list[float]],
    kinds: list[int],
    *,
    pose: np.ndarray | None = None,
    ages: list[float] | None = None,
    unseen: list[list[float]] | None = None,
) -> SeenStages:
    """Cells of 20 mm before a wall at 2 m; nothing is the arm."""
    return SeenStages(
        CAMERA,
        np.eye(4) if pose is None else pose,
        1.5,
        np.full((480, 640), 2.0, dtype=np.float32),
        np.full((480, 640), int(PixelLabel.obstacle), dtype=np.uint8),
        np.reshape(np.array(centres, dtype=float), (-1, 3)),
        np.full(len(kinds), 0.02),
        np.zeros(len(kinds)) if ages is None else np.array(ages),
        np.array(kinds, dtype=np.intp),
        np.reshape(np.array(unseen or [], dtype=float), (-1, 3)),
    )


def nearest_kind(pixel: np.ndarray) -> str:
    """The kind of cell whose colour, made paler, a pixel has: the one of its hue."""

    def hue(colour: np.ndarray) -> np.ndarray:
        spread = colour - colour.min()
        return spread / max(spread.max(), 1e-9)

    return min(
        CELLS, key=lambda kind: float(np.abs(hue(np.array(rgb(CELLS[kind]), float)) - hue(pixel)).sum())
    )


def test_every_label_and_every_cell_has_its_own_colour_and_words() -> None:
    assert set(PIXELS) == {label.name for label in PixelLabel}
    assert len(set(PIXELS.values())) == len(PIXELS)
    assert len(set(CELLS.values())) == len(CELLS)
    assert set(MEANINGS) == set(PIXELS) | set(CELLS)
    labels = np.array([[int(label) for label in PixelLabel]], dtype=np.uint8)
    assert [tuple(pixel) for pixel in label_picture(labels)[0]] == [
        rgb(PIXELS[label.name]) for label in PixelLabel
    ]
    assert label_palette().dtype == np.uint8


def test_depth_is_black_where_nothing_was_seen_and_grey_beyond_the_range() -> None:
    depth = np.array([[0.0, np.nan, 0.5, 4.0, 4.01]], dtype=np.float32)
    picture = depth_picture(depth, near=0.5, far=4.0)
    assert tuple(picture[0, 0]) == tuple(picture[0, 1]) == rgb(PIXELS["nothing"])
    assert tuple(picture[0, 4]) == rgb(PIXELS["outside"])
    assert (
        picture[0, 2].sum() > 400 > 250 > picture[0, 3].sum()
    )  # the ends of viridis: yellow and dark violet


def test_a_cell_is_drawn_where_the_camera_sees_it_and_near_ones_hide_far_ones() -> None:
    picture = cell_picture(stages([[0.0, 0.0, 1.0], [0.0, 0.0, 2.0], [0.4, -0.2, 2.0]], [0, 2, 1]))
    assert picture.shape == (480, 640, 3)
    assert nearest_kind(picture[240, 320].astype(float)) == "seen"  # at 1 m, before that at 2 m
    u, v = 320 + round(500 * 0.4 / 2.0), 240 + round(500 * -0.2 / 2.0)
    assert nearest_kind(picture[v, u].astype(float)) == "remembered"
    assert (picture[10, 10] == BACKGROUND).all()
    # Squares of 2 x 0.7 x 20 mm: 14 px at 1 m and 7 px at 2 m.
    drawn = (picture != BACKGROUND).any(axis=2)
    assert drawn[:, 400:].sum() == pytest.approx(8 * 8, abs=17)
    assert drawn[:, :400].sum() == pytest.approx(15 * 15, abs=31)


def test_what_is_behind_the_view_is_not_drawn() -> None:
    assert (cell_picture(stages([[0.0, 0.0, -1.0]], [0])) == BACKGROUND).all()


def test_small_images_are_drawn_larger() -> None:
    small = DepthCamera("small", width=160, height=120, fx=100.0, fy=100.0, cx=80.0, cy=60.0, pose=np.eye(4))
    seen = stages([[0.0, 0.0, 1.0]], [2])
    labels = np.zeros((120, 160), dtype=np.uint8)
    seen = SeenStages(
        small, seen.pose, 0.0, labels.astype(np.float32), labels, seen.centres, seen.radii, seen.ages, seen.kinds,
        seen.unseen,
    )  # fmt: skip
    picture = cell_picture(seen)
    assert picture.shape == (480, 640, 3)
    assert nearest_kind(picture[242, 322].astype(float)) == "hidden"


def test_the_view_from_beside_looks_at_the_same_place_from_as_far() -> None:
    pose = look_at([2.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    view = view_from_beside(stages([], [], pose=pose), angles=(np.pi / 2.0, np.deg2rad(30.0)))
    # A wall at 2 m: the middle of what is seen is the origin. Turned by a right angle, and raised by 30 degrees.
    assert np.allclose(view[:3, 3], [0.0, np.sqrt(3.0), 1.0], atol=1e-6)
    assert np.allclose(view[:3, 2], [0.0, -np.sqrt(0.75), -0.5], atol=1e-6)
    assert np.allclose(view[:3, :3].T @ view[:3, :3], np.eye(3), atol=1e-12)


def test_the_legend_says_how_many_and_how_old() -> None:
    rows = cell_legend(stages([[0, 0, 1]] * 4, [0, 2, 2, 2], ages=[0.0, 0.1, 0.2, 1.5], unseen=[[0, 0, 3]]))
    assert rows == [
        (CELLS["seen"], "seen now: 1"),
        (CELLS["hidden"], "remembered, hidden: 3, 0.2 s old, up to 1.5 s"),
        (CELLS["unseen"], "never seen: 1"),
    ]


def test_pictures_are_written(tmp_path: Path) -> None:
    write_stages(stages([[0.0, 0.0, 1.0]], [0], unseen=[[0.1, 0.0, 1.0]]), tmp_path / "stages.png")
    with Image.open(tmp_path / "stages.png") as image:
        colours = {colour for _, colour in image.convert("RGB").getcolors(1 << 24)}
    assert rgb(PIXELS["obstacle"]) in colours
    frame = Frame("front", 0.0, np.array([[0, 1000], [2000, 65000]], dtype=np.uint16), 0.001)
    figure = depth_figure(frame)
    assert "25.0 %" in figure.axes[0].get_title()
