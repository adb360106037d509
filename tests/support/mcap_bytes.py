"""Where the records of an MCAP file begin and end, for tests that change its bytes."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator

FRAME = 9  # [B] opcode and length before the content of a record
MESSAGE = 22  # [B] channel, sequence and times before the data of a message
CHANNEL, MESSAGE_OPCODE = 4, 5


def records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Opcode of each record, where it begins and where the next one does."""
    begin = 8
    while begin + FRAME <= len(data) and data[begin:] != data[:8]:
        (size,) = struct.unpack_from("<Q", data, begin + 1)
        yield data[begin], begin, begin + FRAME + size
        begin += FRAME + size


def messages(data: bytes, topic: str) -> list[tuple[int, int]]:
    """Where the messages of a topic begin and end."""
    channels, found = {}, []
    for opcode, begin, end in records(data):
        if opcode == CHANNEL:
            channel, _, length = struct.unpack_from("<HHI", data, begin + FRAME)
            channels[channel] = data[begin + FRAME + 8 : begin + FRAME + 8 + length].decode()
        elif opcode == MESSAGE_OPCODE:
            (channel,) = struct.unpack_from("<H", data, begin + FRAME)
            if channels[channel] == topic:
                found.append((begin, end))
    return found


def sign(data: bytearray, begin: int, end: int) -> None:
    """Makes the checksum of a message of Sidestep that of its content."""
    content = bytes(data[begin + FRAME + MESSAGE : end - 4])
    data[end - 4 : end] = struct.pack("<I", zlib.crc32(content))
