"""What each colour of the page means; one thing each (Okabe and Ito's palette)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from matplotlib.colors import to_rgb

from sidestep.drawing import palette

Rgb = tuple[int, int, int]


def rgb(colour: str) -> Rgb:
    """A colour as whole numbers from 0 to 255."""
    r, g, b = (round(255.0 * part) for part in to_rgb(colour))
    return r, g, b


def batched(colour: Rgb) -> Rgb:
    """The same colour for viser's batched meshes, which are shown without the gamma of sRGB (viser 1.1)."""
    encoded = np.array(colour) / 255.0
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    r, g, b = np.round(255.0 * linear).astype(int).tolist()
    return r, g, b


OBSTACLE = palette.VERMILLION
FURNITURE = palette.FURNITURE  # of an obstacle that is large: it would drown everything else
EDGE = "#7A4A2B"  # of boxes
LARGE = 0.18  # [m] radius of a ball that holds it: walls of boxes and bars of cages, but not what is handled
GOAL = palette.BLUE
NEAR = palette.PURPLE  # of a link that is close to an obstacle, and of the nearest line
TRAIL = palette.GREEN
PATH = palette.SKY
PULL = palette.BLACK
LIT = palette.YELLOW  # of the link and the point that bend the motion
OTHER = palette.ORANGE  # the arm of the other method
METRIC = "#333333"
SURFACE, NET = "#B7C3A5", "#7D8A68"
LINK, BASE = "#CBD3DE", "#9AA2AE"
RIM = "#FBFF00"  # viser's own

NEAR_FROM = 0.20  # [m] clearance at which a link begins to change its colour
SHADE_LIT = -1  # the shade of a link that is lit
SHADES = 24  # steps of it: fewer messages, and nobody sees the difference

LEGEND = (
    (LINK, "link, far from obstacles; the same for the ellipsoids of its body, which the controller sees"),
    (BASE, "base, which does not move"),
    (
        NEAR,
        f"link near an obstacle (full colour: touching, fades out at {100 * NEAR_FROM:.0f} cm); nearest line: "
        "both on the exact meshes",
    ),
    (OBSTACLE, "obstacle"),
    (FURNITURE, f"obstacle larger than {200 * LARGE:.0f} cm"),
    (LIT, "link and obstacle point that bend the motion most now"),
    (PATH, "path of the tip that is planned"),
    (PULL, "arrow: attraction of the tip by the goal or the path"),
    (OTHER, "ghost arm of the method that is compared"),
    (GOAL, "goal: ghost arm; the gizmo at its tip has the colours of the axes"),
    (TRAIL, "where the tip has been; on the surface, where the joints are and have been"),
    (
        SURFACE,
        "configuration space over two joints, the others as they are, curved by ψ, with a net of darker lines; open "
        "where it is high; a second or so behind",
    ),
    (METRIC, "metric: how freely the tip can move in each direction"),
    (RIM, "rim of what the mouse can take"),
)


def shade(clearance: float) -> int:
    """The shade of a link at a clearance [m], 0 (far) to `SHADES` (touching)."""
    if not np.isfinite(clearance):
        return 0
    return round(SHADES * float(np.clip(1.0 - clearance / NEAR_FROM, 0.0, 1.0)))


def shade_colour(index: int, base: str = LINK) -> Rgb:
    """The colour of a shade."""
    if index == SHADE_LIT:
        return rgb(LIT)
    share = index / SHADES
    mixed: npt.NDArray[np.float64] = (1.0 - share) * np.array(to_rgb(base)) + share * np.array(to_rgb(NEAR))
    r, g, b = np.round(255.0 * mixed).astype(int).tolist()
    return r, g, b


def legend_html() -> str:
    """The colours and what they mean."""
    rows = "".join(
        f'<div style="display:flex;gap:8px;align-items:baseline;margin:3px 0"><span style="flex:none;width:12px;'
        f'height:12px;border-radius:3px;background:{colour}"></span><span>{meaning}</span></div>'
        for colour, meaning in LEGEND
    )
    return f'<div style="font-size:13px;line-height:1.35;padding:2px 10px">{rows}</div>'
