"""Gaussians as PLY, in the layout of 3DGS: binary, little endian, axes as they are.

Fields: x y z, nx ny nz, f_dc_0..2, f_rest_* (channel-major), opacity (logit), scale_0..2 (log) and rot_0..3
(wxyz).
"""

import re

import numpy as np
from jaxtyping import Float

from dreamdrive.data.splats.splats import Splats, arrays_of, check_count
from dreamdrive.errors import InputError
from dreamdrive.scene.gaussians import Gaussians

_HEADER_BYTES = 100_000
_TYPES = {
    "char": "i1",
    "uchar": "u1",
    "short": "<i2",
    "ushort": "<u2",
    "int": "<i4",
    "uint": "<u4",
    "float": "<f4",
    "double": "<f8",
    **{f"{sign}int{bits}": f"<{sign or 'i'}{bits // 8}" for sign in ("", "u") for bits in (8, 16, 32)},
    "float32": "<f4",
    "float64": "<f8",
}
_NEEDED = (
    *("x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"),
    *("scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"),
)
_REST = (0, 9, 24, 45)
"""Numbers of further coefficients of colour, by degree."""
_EXPECTED = "expected a binary little-endian PLY of 3D Gaussians, as 3DGS writes it"


def pack_ply(gaussians: Gaussians) -> bytes:
    """A PLY file; life spans, actors, features and source frames have no field."""
    count, coefficients = gaussians.sh.shape[:2]
    names = ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"]
    names += [f"f_rest_{i}" for i in range(3 * (coefficients - 1))]
    names += ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]
    properties = "".join(f"property float {name}\n" for name in names)
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n{properties}end_header\n"
    numbers = arrays_of(gaussians)
    columns = [
        numbers.means,
        np.zeros_like(numbers.means),
        numbers.sh[:, 0],
        numbers.sh[:, 1:].transpose(0, 2, 1).reshape(count, 3 * (coefficients - 1)),
        numbers.logit_opacities[:, None],
        numbers.log_scales,
        numbers.quaternions,
    ]
    return header.encode("ascii") + np.concatenate(columns, axis=1).astype("<f4").tobytes()


def unpack_ply(data: bytes, where: str) -> Splats:
    """The Gaussians of a PLY file."""
    end = re.search(rb"end_header\r?\n", data[:_HEADER_BYTES])
    if not data.startswith(b"ply") or end is None:
        raise InputError(f"{where} has no header of PLY; {_EXPECTED}")
    count, row = _layout(data[: end.start()].decode("ascii", "replace"), where)
    check_count(count, len(data), where)
    if len(data) - end.end() < count * row.itemsize:
        raise InputError(
            f"{where} is cut short: it has {(len(data) - end.end()) // row.itemsize} of its {count} Gaussians"
        )
    rows = np.frombuffer(data, row, count, end.end())

    def columns(*names: str) -> Float[np.ndarray, "n c"]:
        return np.stack([rows[name].astype(np.float32) for name in names], axis=1)

    assert row.names is not None
    rest = len([name for name in row.names if re.fullmatch(r"f_rest_\d+", name)])
    higher = columns(*(f"f_rest_{i}" for i in range(rest))) if rest else np.zeros((count, 0), np.float32)
    higher = higher.reshape(count, 3, rest // 3).transpose(0, 2, 1)
    return Splats(
        means=columns("x", "y", "z"),
        quaternions=columns("rot_0", "rot_1", "rot_2", "rot_3"),
        log_scales=columns("scale_0", "scale_1", "scale_2"),
        logit_opacities=columns("opacity")[:, 0],
        sh=np.concatenate([columns("f_dc_0", "f_dc_1", "f_dc_2")[:, None], higher], axis=1),
    )


def _layout(header: str, where: str) -> tuple[int, np.dtype]:
    """How many Gaussians there are, and the type of a row of numbers."""
    lines = [line.split() for line in header.splitlines()]
    lines = [line for line in lines if line and line[0] not in ("comment", "obj_info")]
    if lines[1:2] != [["format", "binary_little_endian", "1.0"]]:
        raise InputError(f"{where} is not binary and little endian; {_EXPECTED}")
    elements = [i for i, line in enumerate(lines) if line[0] == "element"]
    first = lines[elements[0]] if elements else []
    if len(first) != 3 or first[1] != "vertex" or not re.fullmatch(r"\d{1,12}", first[2]):
        packed = ", or let PlayCanvas' splat-transform unpack it" if "packed_position" in header else ""
        raise InputError(f"{where} does not begin with its Gaussians; {_EXPECTED}{packed}")
    fields = lines[elements[0] + 1 : elements[1] if len(elements) > 1 else None]
    if any(len(field) != 3 or field[0] != "property" or field[1] not in _TYPES for field in fields):
        raise InputError(f"{where} has lists, or something unknown, among its Gaussians; {_EXPECTED}")
    names = [name for _, _, name in fields]
    missing = [name for name in _NEEDED if name not in names]
    rest = {name for name in names if re.fullmatch(r"f_rest_\d+", name)}
    if missing:
        raise InputError(f"{where} has no {', '.join(missing)}; {_EXPECTED}")
    whole = {f"f_rest_{i}" for i in range(len(rest))}
    if len(set(names)) < len(names) or rest != whole or len(rest) not in _REST:
        raise InputError(f"{where} has {len(rest)} further coefficients of colour; expected {_REST}")
    return int(first[2]), np.dtype([(name, _TYPES[kind]) for _, kind, name in fields])
