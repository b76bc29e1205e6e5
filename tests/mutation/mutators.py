"""Ways to spoil a file: by its bytes, its words, its JSON values, or by what stands in its place."""

import copy
import gzip
import io
import json
import math
import os
import shutil
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

_DEEP, _HUGE = "@deep@", "@huge@"
"""Stand for text that ``json.dumps`` cannot write."""
_VALUES: tuple[Any, ...] = (
    None,
    True,
    False,
    0,
    -1,
    1,
    3,
    255,
    256,
    0.5,
    -0.0,
    1e-300,
    1e7,
    1e12,
    -1e18,
    1e300,
    -1e300,
    10**7,
    2**31,
    2**53,
    2**62,
    -(2**63),
    2**64,
    10**40,
    math.nan,
    math.inf,
    -math.inf,
    _DEEP,
    _HUGE,
    "",
    "x",
    "1",
    "nan",
    "NaN",
    "\0",
    "\udfff",
    "..",
    "../../etc/passwd",
    "/dev/zero",
    "/dev/stdin",
    "/",
    "a" * 5000,
    [],
    [[]],
    {},
    {"": 0},
    [0],
    [None],
    [1e300] * 4,
    [[1e300] * 4] * 4,
    [[0] * 4] * 4,
    [0] * 100_000,
    [[]] * 1000,
    {str(i): i for i in range(1000)},
)
_WORDS = (
    "nan",
    "inf",
    "-inf",
    "1e999",
    "1e300",
    "-1e300",
    "1e7",
    "0",
    "-1",
    "1",
    "2147483648",
    "4294967296",
    "9223372036854775808",
    "1" * 400,
    "1_0",
    "0x10",
    "1e",
    "--1",
    "1,5",
    "true",
    "#",
    "\0",
    "é",
    "\ufeff",
    "\x85",
    "x" * 5000,
    "PINHOLE",
    "OPENCV_FISHEYE",
    "%s",
    "{}",
    '"',
    "[",
)
_INTS = (
    0,
    1,
    0xFF,
    0x7FFF,
    0xFFFF,
    10**7,
    0x7FFFFFFF,
    0x80000000,
    0xFFFFFFFF,
    2**40,
    2**62,
    2**63,
    2**64 - 1,
)
_HUGE = 100_000_000
"""Bytes from which on a file is not changed further: copies of it would not fit into the process."""
_FLOATS = (math.nan, math.inf, -math.inf, 1e300, -1e300, 1e-310, 1e7, -1.0)


def mutate(path: Path, rng: Random) -> str:
    """Spoil a file and say how; a folder or nothing may stand in its place afterwards."""
    if rng.random() < 0.08:
        return replace(path, rng)
    data = path.read_bytes()
    done: list[str] = []
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        if len(data) > _HUGE:
            break
        ways = [bytes_changed]
        if data[:2] == b"PK":
            ways = [bytes_changed, zip_changed, zip_changed]
        elif data[:2] == b"\x1f\x8b":
            ways = [bytes_changed, gzip_changed, gzip_changed]
        elif data[:6] == b"\x93NUMPY":
            ways = [bytes_changed, words_changed]
        elif data[8:9] == b"{":
            ways = [bytes_changed, header_changed, header_changed, header_changed]
        elif path.suffix == ".json":
            ways = [bytes_changed, json_changed, json_changed, json_changed, json_changed]
        elif _is_text(data):
            ways = [bytes_changed, words_changed, words_changed]
        data, how = rng.choice(ways)(data, rng)
        done.append(how)
    path.write_bytes(data)
    return "; ".join(done)


def replace(path: Path, rng: Random) -> str:
    """Put something that is no such file in its place."""
    kind = rng.choice(("pipe", "device", "loop", "folder", "empty", "missing"))
    path.unlink()
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "loop":
        path.symlink_to(path.name)
    elif kind == "folder":
        path.mkdir()
    elif kind == "empty":
        path.touch()
    return f"replaced by: {kind}"


def remove(path: Path) -> None:
    """Whatever stands there, without following links."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def bytes_changed(data: bytes, rng: Random) -> tuple[bytes, str]:
    """Flip, cut, repeat, insert or overwrite bytes anywhere."""
    # Headers, where counts are, are as likely as all the rest.
    end = len(data) if rng.random() < 0.5 else min(len(data), 128)
    at, length = rng.randrange(end + 1), rng.choice((1, 2, 8, 64, 1000))
    kind = rng.choice(("flip", "cut", "delete", "repeat", "insert", "int", "float"))
    before, chunk, after = data[:at], data[at : at + length], data[at + length :]
    if kind == "flip":
        mask = rng.choice((1, 0x80, 0xFF))
        chunk = bytes(value ^ mask for value in chunk)
    elif kind == "cut":
        chunk = after = b""
    elif kind == "delete":
        chunk = b""
    elif kind == "repeat":
        chunk = chunk * rng.choice((2, 3, 100))
    elif kind == "insert":
        chunk = rng.randbytes(length) + chunk
    else:
        size = rng.choice((4, 8))
        at -= at % rng.choice((1, size))
        order = rng.choice("<>")
        made = rng.choice(_INTS) % 256**size if kind == "int" else rng.choice(_FLOATS)
        if kind == "float" and size == 4 and abs(made) > 3e38:
            made = math.inf
        code = {("int", 4): "I", ("int", 8): "Q", ("float", 4): "f", ("float", 8): "d"}[kind, size]
        before, chunk, after = data[:at], struct.pack(order + code, made), data[at + size :]
    return before + chunk + after, f"{kind} of {length} bytes at {at}"


def words_changed(data: bytes, rng: Random) -> tuple[bytes, str]:
    """Change words or lines of a text."""
    lines = data.decode("latin-1").split("\n")
    row = rng.randrange(len(lines))
    kind = rng.choice(
        ("word", "word", "word", "drop word", "more words", "drop", "repeat", "swap", "reverse", "many")
    )
    between = rng.choice([each for each in " ,=" if each in lines[row]] or [" "])
    words = lines[row].split(between)
    place = rng.randrange(len(words))
    if kind == "word":
        words[place] = rng.choice(_WORDS)
    elif kind == "drop word":
        del words[place]
    elif kind == "more words":
        words[place:place] = words[place : place + 1] * rng.choice((1, 12, 10_000))
    lines[row] = between.join(words)
    if kind == "drop":
        del lines[row : row + rng.choice((1, 2, 1000))]
    elif kind == "repeat":
        lines.insert(row, lines[row])
    elif kind == "swap":
        other = rng.randrange(len(lines))
        lines[row], lines[other] = lines[other], lines[row]
    elif kind == "reverse":
        lines.reverse()
    elif kind == "many":
        lines[row:row] = [lines[row]] * min(20_000, 5_000_000 // (len(lines[row]) + 1))
    return "\n".join(lines).encode("utf-8", "surrogateescape"), f"{kind} in line {row + 1}"


_LONG_JSON = 2_000_000
"""Bytes of JSON, grown by changes before, from which on Python's values of it would fill memory."""


def json_changed(data: bytes, rng: Random) -> tuple[bytes, str]:
    """Change one value, key or list of a JSON text; text that is none, or long, has its bytes changed."""
    if len(data) > _LONG_JSON:
        return bytes_changed(data, rng)
    try:
        values = json.loads(data)
        changed, how = value_changed(values, rng)
        return _as_json(changed), how
    except (ValueError, RecursionError):
        return bytes_changed(data, rng)


def value_changed(values: Any, rng: Random) -> tuple[Any, str]:
    """JSON values of which one is another."""
    values = copy.deepcopy(values)
    found = _some_place(values, rng)
    if found is None:
        return rng.choice(_VALUES), "the whole"
    parent, key = found
    kind = rng.choice(
        ("value", "value", "value", "value", "drop", "add", "swap", "list", "wrap", "text", "scale")
    )
    value = parent[key]
    if kind == "value":
        parent[key] = copy.deepcopy(rng.choice(_VALUES))
    elif kind == "drop":
        del parent[key]
    elif kind == "add" and isinstance(parent, dict):
        parent[rng.choice(("x", "", "K", "frames", "format", "metric", "\0"))] = rng.choice(_VALUES)
    elif kind == "swap":
        there, name = _some_place(values, rng) or found
        parent[key], there[name] = copy.deepcopy(there[name]), copy.deepcopy(value)
    elif kind == "list" and isinstance(value, list) and value:
        parent[key] = rng.choice(
            (value[::-1], value[:-1], value[1:], value * 2, value * 2000, [value[0]] * len(value))
        )
    elif kind == "wrap":
        parent[key] = rng.choice(([value], {"x": value}))
    elif kind == "text":
        parent[key] = str(value)[:100_000]
    elif isinstance(value, (int, float)):
        parent[key] = value * rng.choice((-1, 0, 2, 1.5, 1e6, 1e9, 1e200))
    return values, f"{kind} at {key!r}"


def _some_place(values: Any, rng: Random) -> tuple[Any, Any] | None:
    """A container and a key in it, at any depth."""
    found = None
    here = values
    while isinstance(here, (dict, list)) and here:
        key = rng.choice(list(here)) if isinstance(here, dict) else rng.randrange(len(here))
        found = here, key
        if rng.random() < 0.25:
            break
        here = here[key]
    return found


def _as_json(values: Any) -> bytes:
    text = json.dumps(values).replace(f'"{_DEEP}"', "[" * 1000 + "]" * 1000).replace(f'"{_HUGE}"', "1e999")
    return text.encode()


def header_changed(data: bytes, rng: Random) -> tuple[bytes, str]:
    """Change the header of a safetensors, and perhaps its length."""
    (length,) = struct.unpack_from("<Q", data)
    text, how = json_changed(data[8 : 8 + length].rstrip(), rng)
    told = len(text) if rng.random() < 0.9 else rng.choice(_INTS)
    return struct.pack("<Q", told) + text + data[8 + length :], f"header: {how}, length {told}"


def zip_changed(data: bytes, rng: Random) -> tuple[bytes, str]:
    """Change the bytes of one member of an archive, whose checksums stay right."""
    made = io.BytesIO()
    try:
        with (
            zipfile.ZipFile(io.BytesIO(data)) as old,
            zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as new,
        ):
            spoilt = rng.randrange(max(len(old.namelist()), 1))
            how = "no member"
            for index, name in enumerate(old.namelist()):
                inner = old.read(name)
                if index == spoilt:
                    change: Callable[[bytes, Random], tuple[bytes, str]] = rng.choice(
                        (bytes_changed, words_changed)
                    )
                    inner, how = change(inner, rng)
                new.writestr(name, inner)
    except (zipfile.BadZipFile, ValueError, OSError, RuntimeError, struct.error, zlib.error, EOFError):
        # An earlier change broke the archive, or marked a member as encrypted (a RuntimeError).
        return bytes_changed(data, rng)
    return made.getvalue(), f"member {spoilt}: {how}"


def gzip_changed(data: bytes, rng: Random) -> tuple[bytes, str]:
    """Change what is packed by gzip, whose checksum stays right."""
    try:
        inner = gzip.decompress(data)
    except (OSError, EOFError, zlib.error):
        return bytes_changed(data, rng)
    change = rng.choice((bytes_changed, words_changed)) if _is_text(inner) else bytes_changed
    inner, how = change(inner, rng)
    return gzip.compress(inner, 1, mtime=0), f"packed: {how}"


def _is_text(data: bytes) -> bool:
    return b"\0" not in data[:1000]
