"""Gaussians as SPZ: quantised, 20 bytes each without further colours, in axes x right, y up, z back.

Version 4 is written: a plain header, a table of sizes and a stream of zstd for each kind of number. Versions
2 and 3, which are one stream of gzip, are read, too. Source: Niantic's library spz.
"""

import struct
import zlib
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float, UInt8

from dreamdrive.data.splats.splats import UP_AND_BACK, Splats, arrays_of, check_count
from dreamdrive.errors import InputError
from dreamdrive.scene.gaussians import Gaussians

_MAGIC = b"NGSP"
_HEADER = struct.Struct("<4sIIBBBBI12x")
_OLD_HEADER = struct.Struct("<4sIIBBBB")
_SIZES = struct.Struct("<QQ")
_FURTHER = (0, 3, 8, 15)
"""Coefficients of colour beyond the first, by degree."""
_POSITION_BITS = 23
_FINEST_BITS = 12
"""Positions are wholes of 2^-12 m, coarser only where the scene is wider than 2 km."""
_COLOUR, _SCALE, _LEAST_SCALE, _SH = 0.15, 16.0, -10.0, 128.0
_LARGEST = 511
_LEVEL = 12
_LEAST_ALPHA = 0.25 / 255
"""Bytes of 0 and 255 stand for opacities just beside 0 and 1, whose logits are finite."""


def need_zstandard() -> None:
    """Raise ``InputError`` where the package that compresses is missing."""
    try:
        import zstandard  # noqa: F401
    except ImportError:
        raise InputError("spz needs the package zstandard: pip install 'dreamdrive[spz]'") from None


def pack_spz(gaussians: Gaussians) -> bytes:
    """An SPZ file of version 4."""
    import zstandard

    numbers = arrays_of(gaussians, UP_AND_BACK)
    count, coefficients = numbers.sh.shape[:2]
    reach = float(np.abs(numbers.means).max(initial=0.0))
    bits = min(_FINEST_BITS, _POSITION_BITS - int(np.ceil(np.log2(max(reach, 1e-6) + 1e-3))))
    bits = max(bits, 0)
    most = (1 << _POSITION_BITS) - 1
    fixed = np.clip(np.rint(numbers.means.astype(np.float64) * (1 << bits)), -most, most).astype("<i4")
    opacities = 1 / (1 + np.exp(-numbers.logit_opacities.astype(np.float64)))
    streams = [
        np.ascontiguousarray(fixed).view(np.uint8).reshape(count, 3, 4)[..., :3],
        _bytes(opacities * 255),
        _bytes(numbers.sh[:, 0] * (_COLOUR * 255) + 127.5),
        _bytes((numbers.log_scales - _LEAST_SCALE) * _SCALE),
        _pack_turns(numbers.quaternions),
        *([_bytes(numbers.sh[:, 1:] * _SH + 128)] if coefficients > 1 else []),
    ]
    packed = [zstandard.compress(each.tobytes(), _LEVEL) for each in streams]
    degree = _FURTHER.index(coefficients - 1)
    header = _HEADER.pack(_MAGIC, 4, count, degree, bits, 0, len(streams), _HEADER.size)
    table = b"".join(_SIZES.pack(len(part), each.size) for part, each in zip(packed, streams, strict=True))
    return b"".join([header, table, *packed])


def unpack_spz(data: bytes, where: str) -> Splats:
    """The Gaussians of an SPZ file, turned to x right, y down, z ahead by ``turned``; here as they are."""
    if data.startswith(b"\x1f\x8b"):
        count, bits, degree, version, streams = _old_streams(data, where)
    elif data.startswith(_MAGIC):
        count, bits, degree, version, streams = _new_streams(data, where)
    else:
        raise InputError(f"{where} is not SPZ: it begins with {data[:4]!r}")
    signed = np.zeros((count, 3, 4), np.uint8)
    signed[..., 1:] = streams["positions"].reshape(count, 3, 3)
    means = (signed.view("<i4")[..., 0] >> 8).astype(np.float32) / np.float32(1 << bits)
    alphas = streams["alphas"].astype(np.float64) / 255
    alphas = np.clip(alphas, _LEAST_ALPHA, 1 - _LEAST_ALPHA)
    colours = (streams["colours"].reshape(count, 1, 3) - np.float32(127.5)) / np.float32(_COLOUR * 255)
    further = (streams["sh"].reshape(count, _FURTHER[degree], 3) - np.float32(128)) / np.float32(_SH)
    turns = streams["turns"].reshape(count, -1)
    return Splats(
        means=means,
        quaternions=_unpack_turns(turns) if version > 2 else _unpack_old_turns(turns),
        log_scales=streams["scales"].reshape(count, 3) / np.float32(_SCALE) + np.float32(_LEAST_SCALE),
        logit_opacities=np.log(alphas / (1 - alphas)).astype(np.float32),
        sh=np.concatenate([colours, further], axis=1),
    )


_Streams = tuple[int, int, int, int, Mapping[str, UInt8[np.ndarray, " b"]]]
"""Number of Gaussians, bits behind the point of positions, degree, version, and bytes by what they are."""


def _sizes(count: int, degree: int, version: int) -> dict[str, int]:
    each = {"positions": 9, "alphas": 1, "colours": 3, "scales": 3, "turns": 4 if version > 2 else 3}
    return {name: count * size for name, size in {**each, "sh": 3 * _FURTHER[degree]}.items()}


def _check(version: int, known: tuple[int, ...], degree: int, bits: int, where: str) -> None:
    if version not in known:
        raise InputError(f"{where} is SPZ of version {version}; expected 2, 3 or 4")
    if degree >= len(_FURTHER) or bits > _POSITION_BITS:
        raise InputError(
            f"{where}: colours of degree {degree}, positions of {bits} bits; expected 0 to 3, 12"
        )


def _new_streams(data: bytes, where: str) -> _Streams:
    need_zstandard()
    import zstandard

    cut = InputError(f"{where} is cut short, or damaged: its parts are not of the sizes that it names")
    if len(data) < _HEADER.size:
        raise cut
    _, version, count, degree, bits, _, parts, place = _HEADER.unpack_from(data)
    _check(version, (4,), degree, bits, where)
    check_count(count, len(data), where)
    sizes = _sizes(count, degree, version)
    wanted = {name: size for name, size in sizes.items() if size}
    start = place + parts * _SIZES.size
    if parts != len(wanted) or place < _HEADER.size or start > len(data):
        raise cut
    found = {name: np.zeros(0, np.uint8) for name in sizes}
    for i, (name, size) in enumerate(wanted.items()):
        packed, unpacked = _SIZES.unpack_from(data, place + i * _SIZES.size)
        if unpacked != size or packed > len(data) - start:
            raise cut
        try:
            # A stream that says less than it holds is stopped at the size, one that says more has none.
            unpacker = zstandard.ZstdDecompressor(max_window_size=1 << 27)
            got = unpacker.stream_reader(data[start : start + packed]).read(size + 1)
        except zstandard.ZstdError as error:
            raise InputError(f"{where} is damaged: {error}") from None
        if len(got) != size:
            raise cut
        found[name] = np.frombuffer(got, np.uint8)
        start += packed
    return count, bits, degree, version, found


def _old_streams(data: bytes, where: str) -> _Streams:
    unpacker = zlib.decompressobj(zlib.MAX_WBITS | 16)
    cut = InputError(f"{where} is cut short: it holds less than its header says")
    try:
        header = unpacker.decompress(data, _OLD_HEADER.size)
        if len(header) < _OLD_HEADER.size:
            raise cut
        magic, version, count, degree, bits, _, _ = _OLD_HEADER.unpack(header)
        if magic != _MAGIC:
            raise InputError(f"{where} is not SPZ: it is gzip of something else")
        _check(version, (2, 3), degree, bits, where)
        check_count(count, len(data), where)
        sizes = _sizes(count, degree, version)
        total = sum(sizes.values())
        body = unpacker.decompress(unpacker.unconsumed_tail, total) if unpacker.unconsumed_tail else b""
    except zlib.error as error:
        raise InputError(f"{where} is damaged: {error}") from None
    if len(body) < total:
        raise cut
    ends = np.cumsum(list(sizes.values()))
    found = {
        name: np.frombuffer(body, np.uint8, size, end - size)
        for (name, size), end in zip(sizes.items(), ends.tolist(), strict=True)
    }
    return count, bits, degree, version, found


def _bytes(values: Float[np.ndarray, "..."]) -> UInt8[np.ndarray, "..."]:
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


def _pack_turns(quaternions: Float[np.ndarray, "n 4"]) -> UInt8[np.ndarray, "n 4"]:
    """The three smaller of x, y, z, w in ten bits each, and which is the largest, made positive."""
    turns = np.roll(quaternions, -1, axis=1)
    largest = np.abs(turns).argmax(axis=1)
    turns = turns * np.where(np.take_along_axis(turns, largest[:, None], 1) < 0, -1, 1)
    packed = largest.astype(np.uint32)
    for axis in range(4):
        value = turns[:, axis]
        wholes = np.minimum(np.rint(np.abs(value) * (_LARGEST * 2**0.5)), _LARGEST).astype(np.uint32)
        ten = (value < 0).astype(np.uint32) << 9 | wholes
        packed = np.where(largest == axis, packed, packed << 10 | ten)
    return packed.astype("<u4").view(np.uint8).reshape(-1, 4)


def _unpack_turns(packed: UInt8[np.ndarray, "n 4"]) -> Float[np.ndarray, "n 4"]:
    bits = np.ascontiguousarray(packed).view("<u4")[:, 0]
    largest = bits >> 30
    turns = np.zeros((len(bits), 4))
    for axis in reversed(range(4)):
        value = (bits & _LARGEST) / (_LARGEST * 2**0.5) * np.where(bits & 512, -1.0, 1.0)
        turns[:, axis] = np.where(largest == axis, 0.0, value)
        bits = np.where(largest == axis, bits, bits >> 10)
    rest = np.sqrt(np.maximum(0.0, 1 - np.square(turns).sum(axis=1)))
    np.put_along_axis(turns, largest[:, None].astype(int), rest[:, None], 1)
    return np.roll(turns, 1, axis=1).astype(np.float32)


def _unpack_old_turns(packed: UInt8[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 4"]:
    xyz = packed / 127.5 - 1
    w = np.sqrt(np.maximum(0.0, 1 - np.square(xyz).sum(axis=1)))
    return np.concatenate([w[:, None], xyz], axis=1).astype(np.float32)
