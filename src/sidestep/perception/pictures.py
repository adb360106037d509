"""Pictures of what each stage of `Perception` makes of a depth image, by Matplotlib, without a display."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sidestep._core import PixelLabel
from sidestep.math.pose import about_axis
from sidestep.perception.colours import CELLS, MEANINGS, PIXELS, label_palette, rgb
from sidestep.perception.frame import Frame
from sidestep.perception.seen_stages import CELL_KINDS, SeenStages

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = npt.NDArray[np.float64]
Picture = npt.NDArray[np.uint8]

ASIDE = (np.deg2rad(50.0), np.deg2rad(25.0))  # [rad] by which the view from beside is turned, and raised
BACKGROUND = 245  # of the 3-D view, grey
PALEST = 0.4  # share of white in the colour of the farthest cell
BORDER, BORDERED = 0.7, 4  # brightness of the border of a cell, of one at least so wide [pixel]
ARM_COLUMNS = 320  # of pixels that are drawn of the arm
LEAST_WIDTH = 640  # [pixel] of a picture of cells
CELL_SHARE = 0.7  # half the width of the square of a cell, in its radius
DPI = 110
# Layout of a picture of all stages [inch]: one image, the gaps beside it, its title above and legend below.
WIDTH, GAP, TITLE, LEGEND, BAR = 6.4, 0.15, 0.3, 0.62, 0.75


def depth_picture(depth: npt.NDArray[np.float32], *, near: float, far: float) -> Picture:
    """Depth (H, W) [m] in colours (H, W, 3): near light, far dark; black where nothing was seen, grey beyond `far`."""
    from matplotlib import colormaps

    share = np.clip((depth - near) / (far - near), 0.0, 1.0)
    picture = np.asarray(colormaps["viridis"](1.0 - share, bytes=True))[..., :3].copy()
    picture[depth > far] = rgb(PIXELS["outside"])
    picture[~(depth > 0.0)] = rgb(PIXELS["nothing"])
    return picture


def label_picture(labels: npt.NDArray[np.uint8]) -> Picture:
    """What pixels show (H, W) in the colours `PIXELS` (H, W, 3)."""
    return np.asarray(label_palette()[labels])


def cell_picture(stages: SeenStages, *, pose: Array | None = None) -> Picture:
    """The map of cells as a camera would see it, without what its lens bends, in the colours `CELLS`.

    A cell is a square as wide as it is, near ones hide far ones, and far ones are paler. The points that the image
    shows of the arm are among them.

    Args:
        stages: what was seen.
        pose: (4, 4) of the optical frame of another view; None: from the camera itself.

    Returns:
        (s H, s W, 3): s is 1, and more where the image is small.
    """
    camera = stages.camera
    view = stages.pose if pose is None else pose
    scale = max(1, round(LEAST_WIDTH / camera.width))
    height, width = scale * camera.height, scale * camera.width
    picture = np.full((height, width, 3), BACKGROUND, dtype=np.uint8)
    names = [*(CELLS[kind] for kind in CELL_KINDS), CELLS["unseen"], PIXELS["arm"]]
    palette = np.array([rgb(name) for name in names], dtype=np.float64)
    arm, arm_sizes = _arm_points(stages)
    small = float(np.median(stages.radii)) if len(stages.radii) else 0.02  # [m] unseen cells: points
    points = (np.vstack([stages.centres, stages.unseen, arm]) - view[:3, 3]) @ view[:3, :3]
    num = (len(stages.unseen), len(arm))
    kinds = np.concatenate([stages.kinds, np.repeat([3, 4], num)])
    sizes = np.concatenate([stages.radii, np.full(num[0], 0.3 * small), arm_sizes])
    in_front = points[:, 2] > 1e-3
    points, kinds, sizes = points[in_front], kinds[in_front], sizes[in_front]
    z = points[:, 2]
    u = scale * (camera.fx * points[:, 0] / z + camera.cx + 0.5)
    v = scale * (camera.fy * points[:, 1] / z + camera.cy + 0.5)
    half = np.maximum(CELL_SHARE * scale * camera.fx * sizes / z, 0.6)
    pale = PALEST * np.clip(z / camera.far, 0.0, 1.0)[:, None]
    colours = np.round((1.0 - pale) * palette[kinds] + pale * 255.0).astype(np.uint8)
    borders = np.round(BORDER * colours).astype(np.uint8)
    bounds = np.round(np.column_stack([u - half, u + half, v - half, v + half])).astype(int)
    shown = (bounds[:, 1] >= 0) & (bounds[:, 0] < width)
    shown &= (bounds[:, 3] >= 0) & (bounds[:, 2] < height)
    for n in np.flatnonzero(shown)[np.argsort(-z[shown])]:  # far ones first
        left, right, top, bottom = bounds[n]
        picture[max(top, 0) : bottom + 1, max(left, 0) : right + 1] = borders[n]
        if right - left >= BORDERED:
            picture[max(top + 1, 0) : max(bottom, 0), max(left + 1, 0) : max(right, 0)] = colours[n]
        else:
            picture[max(top, 0) : bottom + 1, max(left, 0) : right + 1] = colours[n]
    return picture


def _arm_points(stages: SeenStages) -> tuple[Array, Array]:
    """Points (N, 3) in the world that an image shows of the arm, of some pixels, and half their widths (N,)."""
    camera = stages.camera
    stride = max(1, camera.width // ARM_COLUMNS)
    step = slice(None, None, stride)
    v, u = (stride * index for index in np.nonzero(stages.labels[step, step] == int(PixelLabel.arm)))
    z = stages.depth[v, u].astype(np.float64)
    points = np.column_stack([(u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z])
    return points @ stages.pose[:3, :3].T + stages.pose[:3, 3], 0.8 * stride * z / camera.fx


def view_from_beside(stages: SeenStages, *, angles: tuple[float, float] = ASIDE) -> Array:
    """Pose (4, 4) of a view that is turned about what the camera looks at, and raised, by two angles [rad].

    Looks at the middle of the arm in the image, or of all that it shows: what is hidden from the camera is seen there.
    """
    shown = stages.labels == int(PixelLabel.arm)
    if not shown.any():
        shown = (stages.depth > 0.0) & (stages.depth < stages.camera.far)
    away = float(np.median(stages.depth[shown])) if shown.any() else 1.0
    X = stages.pose
    centre = X[:3, 3] + away * X[:3, 2]
    side = np.cross([0.0, 0.0, 1.0], X[:3, 2])
    length = np.linalg.norm(side)
    R = about_axis(np.array([0.0, 0.0, 1.0]), angles[0])
    if length > 1e-6:  # a camera that looks straight down is turned alone
        R = R @ about_axis(side / length, angles[1])
    view = np.eye(4)
    view[:3, :3] = R @ X[:3, :3]
    view[:3, 3] = centre + R @ (X[:3, 3] - centre)
    return view


def stages_figure(stages: SeenStages, *, title: str = "") -> Figure:
    """All stages of an image: depth, what its pixels show, and the map from the camera and from beside it."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    camera = stages.camera
    height = WIDTH * camera.height / camera.width
    width, row = 2.0 * (WIDTH + GAP) + BAR, TITLE + height + LEGEND
    figure = Figure(figsize=(width, 2.0 * row + TITLE))

    def place(left: float, top: float, wide: float = WIDTH) -> Axes:
        bottom = 2.0 * row + TITLE - top - height
        return figure.add_axes(
            (left / width, bottom / (2.0 * row + TITLE), wide / width, height / (2.0 * row + TITLE))
        )

    right, first, second = WIDTH + BAR + GAP, 2.0 * TITLE, 2.0 * TITLE + row
    seen = stages.depth[(stages.depth > 0.0) & (stages.depth <= camera.far)]
    near = float(np.percentile(seen, 1)) if len(seen) else 0.0
    depth = place(GAP, first)
    _show(
        depth,
        depth_picture(stages.depth, near=near, far=camera.far),
        f"depth (black: none; grey: beyond {camera.far:g} m)",
    )
    scale = ScalarMappable(Normalize(near, camera.far), "viridis_r")
    figure.colorbar(scale, cax=place(GAP + WIDTH + 0.08, first, 0.12)).ax.set_title("[m]", fontsize=9, pad=4)
    labels = place(right, first)
    _show(labels, label_picture(stages.labels), "what pixels show")
    pixels = stages.pixels()
    _legend(labels, [(PIXELS[n], f"{MEANINGS[n]}: {_share(k, stages)}") for n, k in pixels.items() if k])
    cells = place(GAP, second)
    _show(cells, cell_picture(stages), "cells and arm, from the camera")
    _legend(cells, cell_legend(stages), columns=2)
    view = view_from_beside(stages)
    _show(place(right, second), cell_picture(stages, pose=view), "cells and arm, from beside it")
    words = title or f"{camera.name}, {stages.time:.3f} s"
    figure.suptitle(words, fontsize=11, y=1.0 - 0.25 * TITLE / (2.0 * row + TITLE), va="top")
    return figure


def depth_figure(frame: Frame, *, far: float = 4.0) -> Figure:
    """An image of which nothing is known but its depth; beyond `far` [m] it is grey."""
    from matplotlib.figure import Figure

    depth = np.nan_to_num(frame.metres, nan=0.0, posinf=0.0, neginf=0.0)
    height = WIDTH * depth.shape[0] / depth.shape[1]
    figure = Figure(figsize=(WIDTH, height + 2.0 * TITLE), layout="constrained")
    picture = depth_picture(depth, near=0.0, far=far)
    holes = 100.0 * float(np.mean(depth <= 0.0))
    _show(
        figure.subplots(),
        picture,
        f"{frame.camera}, {frame.time:.3f} s: depth to {far:g} m (black: none, {holes:.1f} %)",
    )
    return figure


def cell_legend(stages: SeenStages) -> list[tuple[str, str]]:
    """Colour and words of each kind of cell there is: number and ages."""
    rows = []
    for kind, count in stages.cells().items():
        if count or kind == "seen":
            ages = stages.age_words(kind)
            rows.append((CELLS[kind], f"{MEANINGS[kind]}: {count:,}{', ' + ages if ages else ''}"))
    return rows


def write_stages(stages: SeenStages, path: str | Path, *, title: str = "") -> None:
    """Writes `stages_figure` as a picture.

    Raises:
        ValueError: the suffix is not that of a picture. OSError: the file cannot be written.
    """
    stages_figure(stages, title=title).savefig(path, dpi=DPI)


def _share(count: int, stages: SeenStages) -> str:
    return f"{100.0 * count / stages.labels.size:.2g} %"


def _show(ax: Axes, picture: Picture, title: str) -> None:
    ax.imshow(picture, interpolation="nearest" if picture.shape[1] < 400 else "antialiased")
    ax.set_title(title, fontsize=10, pad=4)
    ax.set_xticks([])
    ax.set_yticks([])


def _legend(ax: Axes, rows: list[tuple[str, str]], *, columns: int = 3) -> None:
    from matplotlib.patches import Patch

    handles: list[Any] = [Patch(facecolor=colour, edgecolor="0.5", label=words) for colour, words in rows]
    ax.legend(
        handles=handles,
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        ncols=min(columns, len(handles)),
        fontsize=7.5,
        frameon=False,
    )
