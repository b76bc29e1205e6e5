"""Size of a feather file of Arrow once unpacked, by its own account, before anything is unpacked."""

import struct
from collections.abc import Iterator

_HEADER, _ROWS, _BUFFERS, _DATA = 2, 0, 2, 1
"""Fields of the tables Message, RecordBatch twice, and DictionaryBatch (format/Message.fbs of Arrow)."""


def rows_and_bytes(metadata: bytes, body: bytes | memoryview, *, dictionary: bool) -> tuple[int, int]:
    """Rows of a message that holds columns, and bytes of its buffers once they are unpacked.

    A packed buffer begins with its size, -1 where it was not worth packing; plain ones are smaller than that
    would say, or the message is damaged.

    Raises:
        ValueError: The message is damaged.
    """
    try:
        batch = _inner(
            metadata, _inner(metadata, _int(metadata, 0, "<I"), _HEADER), _DATA if dictionary else None
        )
        at = _field(metadata, batch, _ROWS)
        rows = _int(metadata, at, "<q") if at else 0
        size = sum(max(length, _told(body, start, length)) for start, length in _buffers(metadata, batch))
    except struct.error as error:
        raise ValueError(f"a message is cut short: {error}") from None
    if rows < 0:
        raise ValueError("a message has rows below 0")
    return rows, size


def _told(body: bytes | memoryview, start: int, length: int) -> int:
    return _int(body, start, "<q") if length >= 8 else 0


def _buffers(metadata: bytes, batch: int) -> Iterator[tuple[int, int]]:
    at = _field(metadata, batch, _BUFFERS)
    if not at:
        return
    vector = at + _int(metadata, at, "<I")
    for number in range(_int(metadata, vector, "<I")):
        start, length = struct.unpack_from("<qq", metadata, vector + 4 + 16 * number)
        if start < 0 or length < 0:
            raise ValueError("a buffer lies nowhere")
        yield start, length


def _inner(metadata: bytes, table: int, field: int | None) -> int:
    """Where a table lies that a field of another one points to; the other one itself without a field."""
    if field is None:
        return table
    at = _field(metadata, table, field)
    if not at:
        raise ValueError("a message has no content")
    return at + _int(metadata, at, "<I")


def _field(metadata: bytes, table: int, number: int) -> int:
    """Where a field of a table of FlatBuffers lies; 0 where it is left out."""
    fields = table - _int(metadata, table, "<i")
    place = 4 + 2 * number
    if fields < 0 or place >= _int(metadata, fields, "<H"):
        return 0
    offset = _int(metadata, fields + place, "<H")
    return table + offset if offset else 0


def _int(data: bytes | memoryview, at: int, form: str) -> int:
    if at < 0:
        raise struct.error("a place below 0")
    return struct.unpack_from(form, data, at)[0]
