"""A depth image as a picture: near is light, and what is no obstacle has the colour of its kind."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sidestep._core import PixelLabel
from sidestep.perception.colours import label_palette

TINTED = (PixelLabel.arm, PixelLabel.edge, PixelLabel.explained, PixelLabel.left_out, PixelLabel.outside)
SOLID = (
    PixelLabel.obstacle,
    PixelLabel.arm,
    PixelLabel.explained,
    PixelLabel.left_out,
)  # whose depths have all greys
NEAR_END, FAR_END = 0.95, 0.30  # greys of the nearest and the farthest depth of the image
SHADING = 0.55  # share of the grey in a colour: shapes can still be seen
ENDS = (1.0, 99.0)  # [%] of the depths that take nearest and farthest grey

Bytes = npt.NDArray[np.uint8]


def labelled_image(depth: npt.NDArray[np.floating], labels: Bytes) -> Bytes:
    """The picture (H, W, 3) of depths (H, W) [m], 0: nothing seen, with a `PixelLabel` (H, W) each."""
    z = depth.astype(np.float32)
    there = np.isin(labels, [int(label.value) for label in SOLID])
    near, far = np.percentile(z[there], ENDS) if there.any() else (0.0, 1.0)
    share = np.clip((z - near) / max(float(far - near), 1e-6), 0.0, 1.0)
    grey = NEAR_END + (FAR_END - NEAR_END) * share
    picture = np.repeat(grey[..., None], 3, axis=2)
    palette = label_palette().astype(np.float32) / 255.0
    for label in TINTED:
        mask = labels == int(label.value)
        tint = palette[int(label.value)]
        picture[mask] = tint * (1.0 - SHADING + SHADING * grey[mask][:, None] / NEAR_END)
    picture[labels == int(PixelLabel.nothing.value)] = palette[int(PixelLabel.nothing.value)]
    return np.asarray(np.round(255.0 * picture), dtype=np.uint8)
