"""What the tables of an MP4 say of its samples, checked before FFmpeg takes memory for each of them."""

import struct
from collections.abc import Iterator
from typing import BinaryIO

from dreamdrive.errors import InputError

_CONTAINERS = frozenset(
    (b"moov", b"trak", b"mdia", b"minf", b"stbl", b"moof", b"traf", b"mvex", b"udta", b"dinf", b"edts")
)
"""Boxes that hold boxes, as FFmpeg reads them."""
_MAX_BOXES = 1_000_000


def check_tables(file: BinaryIO, size: int, where: str) -> None:
    """Refuse tables that claim more samples than the file has bytes; other kinds of files pass."""
    file.seek(0)
    if file.read(8)[4:] not in (b"ftyp", b"moov", b"mdat", b"free", b"wide", b"skip", b"styp"):
        return
    for count, (kind, place) in enumerate(_boxes(file, 0, size)):
        if count > _MAX_BOXES:
            raise InputError(f"{where} is not a readable video: it consists of more than {_MAX_BOXES} parts")
        if kind in (b"stsz", b"trun"):
            file.seek(place)
            content = file.read(12).ljust(12, b"\0")
            each, samples = struct.unpack_from(">II", content, 4)
            if kind == b"trun":
                each, samples = 1, each
            if each * samples > size:
                raise InputError(
                    f"{where} is not a readable video: it claims {samples} samples, more than its "
                    f"{size} bytes can hold; copy it again"
                )


def _boxes(file: BinaryIO, start: int, stop: int) -> Iterator[tuple[bytes, int]]:
    """Kind and place of the content of all boxes, those inside others too."""
    ends = [stop]
    while ends:
        if start + 8 > ends[-1]:
            start = ends.pop()
            continue
        file.seek(start)
        head = file.read(16)
        length, kind = int.from_bytes(head[:4], "big"), head[4:8]
        skip = 8
        if length == 1:
            length, skip = int.from_bytes(head[8:16], "big"), 16
        end = min(start + length, ends[-1]) if length else ends[-1]
        yield kind, start + skip
        if kind in _CONTAINERS:
            ends.append(max(end, start + skip))
            start += skip
        else:
            start = max(end, start + skip)
