"""Depth and colour images in files."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep.shapes.mesh_file import LFS_POINTER


def read_depth_png(source: str | Path | bytes) -> npt.NDArray[np.uint16]:
    """Depth (H, W) of a PNG of one 16-bit channel, bit by bit as it was written.

    Args:
        source: the file, or its content.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: it is no PNG, or not of one 16-bit channel; names the file and what it is.
    """
    from PIL import Image, UnidentifiedImageError

    owner = "depth image" if isinstance(source, bytes) else f"depth image '{source}'"
    content = source if isinstance(source, bytes) else _content(Path(source))
    try:
        with Image.open(io.BytesIO(content), formats=["PNG"]) as image:
            if not image.mode.startswith("I;16") and image.mode != "I":
                raise ValueError(f"{owner} has pixels of mode {image.mode!r}, must be one 16-bit channel")
            pixels = np.asarray(image)
    except (UnidentifiedImageError, OSError, SyntaxError) as error:  # PIL calls a broken PNG a SyntaxError
        raise ValueError(f"{owner} cannot be read as PNG: {error}") from error
    return pixels.astype(np.uint16, copy=False)


def read_depth_npy(path: str | Path) -> npt.NDArray[Any]:
    """Depth (H, W) of uint16, or of float32 [m], of a `.npy` file; nothing is unpickled.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: it is no such array; names the file and what it is.
    """
    path = Path(path)
    try:
        depth = np.load(io.BytesIO(_content(path)), allow_pickle=False)
    except (ValueError, EOFError) as error:
        raise ValueError(f"depth image '{path}' cannot be read as .npy: {error}") from error
    if not isinstance(depth, np.ndarray) or depth.dtype not in (np.uint16, np.float32, np.float64):
        kind = depth.dtype if isinstance(depth, np.ndarray) else "an archive"
        raise ValueError(f"depth image '{path}' is {kind}, must be uint16, float32 or float64")
    return depth.astype(np.float32) if depth.dtype == np.float64 else depth


def read_depth(path: Path) -> npt.NDArray[Any]:
    """Depth (H, W) of a `.png` or `.npy` file, see `read_depth_png` and `read_depth_npy`."""
    return read_depth_npy(path) if path.suffix.lower() == ".npy" else read_depth_png(path)


def write_depth(path: Path, depth: npt.NDArray[Any]) -> None:
    """Writes a depth image, as `.npy` or, of uint16 alone, as `.png`; a PNG is compressed little, to be fast."""
    from PIL import Image

    if path.suffix == ".npy":
        np.save(path, depth, allow_pickle=False)
    else:
        Image.fromarray(np.ascontiguousarray(depth)).save(path, compress_level=1)


def read_colour(path: Path) -> npt.NDArray[np.uint8]:
    """Colour (h, w, 3) of an image file."""
    from PIL import Image

    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def write_colour(path: Path, colour: npt.NDArray[np.uint8]) -> None:
    """Writes a colour image without loss."""
    from PIL import Image

    Image.fromarray(np.ascontiguousarray(colour)).save(path, compress_level=1)


def _content(path: Path) -> bytes:
    if not path.is_file():
        raise FileNotFoundError(f"depth image '{path}' does not exist")
    content = path.read_bytes()
    if content.startswith(LFS_POINTER):
        raise ValueError(
            f"depth image '{path}' is a Git LFS pointer, not the image; run `git lfs pull` in its repository"
        )
    return content
