"""JSON from files: bounded, finite, and of the types that are expected before anything uses it.

What is not raises ``InputError``, which calls the file ``where``, or by ``option`` and path.
"""

import json
import re
from pathlib import Path
from typing import Any, TypeVar, cast

import msgspec

from dreamdrive.errors import InputError
from dreamdrive.files.paths import TEXT_BYTES, read_bytes, text_in

MAX_DEPTH = 32
"""How deep objects and lists may lie in each other; what is read and written has ten levels at most."""
JSON_RAISES = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)
"""What msgspec raises on text that is no JSON, of another type or nested too deep."""
_LARGEST = 2**63
# What some programs write for a number that is none.
_NO_NUMBER = re.compile(rb"[\s:,\[]-?(?:NaN|Infinity)\b")

T = TypeVar("T")


def read_json(path: Path, option: str = "", *, follow: bool = True) -> dict[str, Any]:
    """The JSON object in a file, or in what a link there leads to unless ``follow`` is off."""
    where = f"{option} {path}".strip()
    values = parse_json(read_bytes(path, where, at_most=TEXT_BYTES, follow=follow), where)
    if not isinstance(values, dict):
        raise InputError(f"{where}: expected a JSON object, got a {type(values).__name__}")
    return cast("dict[str, Any]", values)


def write_json(path: Path, values: dict[str, Any]) -> None:
    """Write values and arrays as readable JSON without NaN."""
    text = json.dumps(values, indent=1, allow_nan=False, default=_as_list)
    path.write_text(text + "\n", encoding="utf-8")


def _as_list(array: Any) -> Any:
    """An array of NumPy as JSON has it; ``TypeError`` for anything else."""
    import numpy as np  # where arrays are, it is loaded; to start with, it is slow

    return np.ndarray.tolist(array)


def parse_json(data: bytes | str, where: str) -> Any:
    """JSON values without NaN, infinities and far too large numbers, nested ``MAX_DEPTH`` at most."""
    try:
        values = msgspec.json.decode(text_in(data) if isinstance(data, bytes) else data)
    except RecursionError:
        raise InputError(f"{where} is not JSON for dreamdrive: it is nested too deep") from None
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raw = data.encode() if isinstance(data, str) else data
        about = "it holds NaN or Infinity, which JSON has not" if _NO_NUMBER.search(raw) else str(error)
        raise InputError(f"{where} is not JSON: {about}") from None
    _check(values, where)
    return values


def of_type(values: object, kind: type[T], where: str) -> T:
    """JSON values as any type that msgspec knows, such as a struct; errors give the path of a wrong one."""
    try:
        return msgspec.convert(values, kind)
    except msgspec.ValidationError as error:
        raise InputError(f"{where}: {error}") from None


def _check(values: object, where: str) -> None:
    level: list[object] = [values]
    for _ in range(MAX_DEPTH):
        below: list[object] = []
        for value in level:
            if isinstance(value, dict):
                below += cast("dict[str, object]", value).values()
            elif isinstance(value, list):
                below += cast("list[object]", value)
            elif isinstance(value, int) and abs(value) >= _LARGEST:
                raise InputError(f"{where} holds the number {str(value)[:20]}..., which is too large")
        if not below:
            return
        level = below
    raise InputError(f"{where} is nested deeper than {MAX_DEPTH} levels; expected plain JSON")
