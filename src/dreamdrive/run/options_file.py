"""Options of any stage from a TOML file, a table for each stage."""

import difflib
import math
import tomllib
from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

import msgspec

from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_text
from dreamdrive.options import Options

T = TypeVar("T")
ELSEWHERE = {
    "quality": "--quality",
    "seed": "--seed",
    "geometry.weights": "--weights or --geometry-weights",
    "knowledge": "--knowledge",
    "method": "--method",
}
"""Fields that no file sets, and the flags that do."""
_NONE = "none"
"""What stands for no value, which TOML has no word for."""


def read_options(path: Path, base: Options) -> Options:
    """The options of ``base`` with those changed that a file names.

    The file holds tables such as ``[fit]`` with ``steps = 600``, and ``"none"`` where an option has no value;
    every field of ``Options`` can be set but quality, method and weights, which have flags.
    """
    text = read_text(path)
    try:
        values = tomllib.loads(text)
    except RecursionError:
        raise InputError(f"--options {path} is not TOML for dreamdrive: it is nested too deep") from None
    except ValueError as error:  # also of numbers with more digits than Python reads
        raise InputError(f"--options {path} is not TOML: {error}") from None
    return _changed(base, values, "", f"--options {path}", sorted(_names(base, "")))


def _names(options: Any, before: str) -> Iterator[str]:
    for field in fields(options):
        name, value = f"{before}{field.name}", getattr(options, field.name)
        if is_dataclass(value):
            yield from _names(value, f"{name}.")
        elif name not in ELSEWHERE:
            yield name


def _changed(options: T, values: dict[str, Any], before: str, where: str, known: list[str]) -> T:
    hints, changes = get_type_hints(type(options)), {}
    for key, value in values.items():
        name, now = f"{before}{key}", getattr(options, key, None)
        if is_dataclass(now) and isinstance(value, dict):
            changes[key] = _changed(now, value, f"{name}.", where, known)
        elif name in known:
            try:
                # Only where a hint allows no value is it taken as one.
                changes[key] = msgspec.convert(None if value == _NONE else value, hints[key])
            except msgspec.ValidationError as error:
                raise InputError(f"{where}: {name}: {error}") from None
            if isinstance(value, float | int) and not 0 <= value < math.inf:
                raise InputError(f"{where}: {name} = {value}; expected a finite number, not below 0")
        else:
            raise InputError(f"{where}: {_unknown(name, is_dataclass(now), known)}")
    return replace(options, **changes)  # type: ignore[type-var]


def _unknown(name: str, is_table: bool, known: list[str]) -> str:
    if name in ELSEWHERE:
        return f"{name} is set by {ELSEWHERE[name]}"
    if is_table:
        return f"{name} is a table of options: write [{name}] and one name = value a line"
    last = name.rsplit(".", 1)[-1]
    near = [one for one in known if one.rsplit(".", 1)[-1] == last]
    near += [one for one in difflib.get_close_matches(name, known, n=3, cutoff=0.5) if one not in near]
    return (
        f"there is no option {name}; did you mean {', '.join(near[:3])}?"
        if near
        else (f"there is no option {name}; expected one of {', '.join(known[:3])}, ... (see docs/options.md)")
    )
