"""Archives that somebody uploads."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path


def unpack(name: str, content: bytes, place: Path, *, most: int) -> None:
    """Unpacks a .zip file into the folder `place`.

    Raises:
        ValueError: it is no .zip file, or would have more than `most` bytes unpacked.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
            if size > most:
                raise ValueError(f"{name} holds {size / 2**20:.0f} MiB; allowed: {most / 2**20:.0f} MiB")
            archive.extractall(place)
    except zipfile.BadZipFile as error:
        raise ValueError(f"{name} is not a zip file: {error}") from error
