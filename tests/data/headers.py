"""Headers of pictures that state whatever is wanted."""

import struct
import zlib


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def png(width: int, height: int, exif: bytes | None = None) -> bytes:
    parts = [_chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))]
    if exif is not None:
        parts.append(_chunk(b"eXIf", exif))
    parts += [_chunk(b"IDAT", zlib.compress(bytes(100))), _chunk(b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def jpeg(width: int, height: int, exif: bytes | None = None, scans: int = 1) -> bytes:
    data = b"\xff\xd8"
    if exif is not None:
        data += b"\xff\xe1" + struct.pack(">H", len(exif) + 8) + b"Exif\0\0" + exif
    data += b"\xff\xc2" + struct.pack(">HBHHB", 11, 8, height, width, 1) + b"\x01\x11\0"
    return data + b"\xff\xda\0\x08\x01\x01\0\0\x3f\0" * scans + b"\xff\xd9"


def bmp(width: int, height: int) -> bytes:
    return b"BM" + struct.pack("<IIIIiiHHIIIIII", 54, 0, 54, 40, width, -height, 1, 24, 0, 0, 0, 0, 0, 0)


def tiff(width: int, height: int, *more_widths: int, big: bool = False) -> bytes:
    entries = [(256, width), (257, height), *((256, each) for each in more_widths)]
    if big:
        body = struct.pack("<Q", len(entries))
        return (
            b"II+\0"
            + struct.pack("<HHQ", 8, 0, 16)
            + body
            + b"".join(struct.pack("<HHQQ", tag, 16, 1, value) for tag, value in entries)
        )
    body = struct.pack(">H", len(entries))
    body += b"".join(struct.pack(">HHII", tag, 4, 1, value) for tag, value in entries)
    return b"MM\0*" + struct.pack(">I", 8) + body


def webp(width: int, height: int, exif: bytes | None = None) -> bytes:
    canvas = b"\x08\0\0\0" + (width - 1).to_bytes(3, "little") + (height - 1).to_bytes(3, "little")
    chunks = b"VP8X" + struct.pack("<I", 10) + canvas
    if exif is not None:
        chunks += b"EXIF" + struct.pack("<I", len(exif)) + exif + b"\0" * (len(exif) % 2)
    return b"RIFF" + struct.pack("<I", len(chunks) + 4) + b"WEBP" + chunks


def exif(orientation: int, order: str = "<") -> bytes:
    """A block of EXIF with the orientation alone."""
    start = b"II*\0" if order == "<" else b"MM\0*"
    return start + struct.pack(order + "IHHHIHHI", 8, 1, 274, 3, 1, orientation, 0, 0)
