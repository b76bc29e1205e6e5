"""Arguments of commands: names of open tables, sizes, actions, and commands below a command."""

import re
from collections.abc import Callable, Iterable, Mapping
from functools import reduce
from itertools import pairwise
from math import isfinite
from operator import or_
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, cast, get_args, get_origin

from tyro.conf import Suppress, arg, subcommand
from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

from dreamdrive.data.table import DATASETS
from dreamdrive.errors import InputError
from dreamdrive.export import EXPORTS
from dreamdrive.geometry import BACKENDS
from dreamdrive.names import DeviceName
from dreamdrive.prior import PRIORS
from dreamdrive.scene.control import (
    Action,
    Command,
    Direction,
    Four,
    Goal,
    Steering,
    Waypoints,
    check_largest,
)

EXAMPLES = (
    "command=left",
    "speed=8,8,8,8 wheel=0,0,0.1,0.1",
    "ahead=4,8,12,16 right=0,0,0,1",
    "goal=0.5,0.55",
)
DEVICES = "cpu|cuda|cuda:N"
DeviceFlag = Annotated[DeviceName, arg(metavar=DEVICES)]
_MAKE: dict[frozenset[str], Callable[[Any], Action]] = {
    frozenset({"command"}): lambda given: Command(_direction(given["command"])),
    frozenset({"speed", "wheel"}): lambda given: Steering(_four(given["speed"]), _four(given["wheel"])),
    frozenset({"ahead", "right"}): lambda given: Waypoints(_four(given["right"]), _four(given["ahead"])),
    frozenset({"goal"}): lambda given: Goal(*_numbers(given["goal"], 2)),
}


class PriorName(str):
    """Of ``PRIORS``."""


class GeometryName(str):
    """Of ``BACKENDS``."""


class DataSetName(str):
    """Of ``DATASETS``."""


class ExportName(str):
    """Of ``EXPORTS``."""


_TABLES: dict[type[str], Iterable[str]] = {
    PriorName: PRIORS,
    GeometryName: BACKENDS,
    DataSetName: DATASETS,
    ExportName: EXPORTS,
}
REGISTRY = ConstructorRegistry()
MOST_MOMENTS = 10_000
"""Of ``--times``."""
_ROUNDED = 1e-6
"""By so much of a step a last time may be missed."""


@REGISTRY.primitive_rule
def _name_of(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[str | None] | None:
    """A name of a table or of a ``Literal``, or none, which nobody types: tyro offers None, in any order.

    The table is looked up when the command is parsed.
    """
    kinds = [kind for kind in get_args(info.type) if kind is not NoneType]
    kind = kinds[0] if get_origin(info.type) in (Union, UnionType) and len(kinds) == 1 else info.type
    names = get_args(kind) if get_origin(kind) is Literal else tuple(_TABLES.get(kind, ()))
    if not names or not all(isinstance(name, str) for name in names):
        return None
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=f"{{{','.join(names)}}}",
        instance_from_str=lambda words: kind(words[0]) if kind in _TABLES else words[0],
        is_instance=lambda value: value is None or value in names,
        str_from_instance=lambda name: [str(name)],
        choices=names,
    )


def commands_of(calls: Mapping[str, Callable[..., None]]) -> Any:
    """The type of an argument that names a command, as tyro makes it for the commands themselves.

    A union needs a second member where there is one command only.
    """
    choices = [Annotated[Any, subcommand(name, constructor=call)] for name, call in calls.items()]
    return reduce(or_, (*choices, Annotated[None, Suppress]))


def parse_size(text: str) -> tuple[int, int]:
    """Width and height from ``480x270``."""
    match = re.fullmatch(r"(\d{1,9})[xX](\d{1,9})", text.strip())
    if match is None:
        raise InputError(f"--size {text}: expected WIDTHxHEIGHT in pixels, such as 480x270")
    size = int(match[1]), int(match[2])
    check_largest(size, f"--size {text}")
    return size


def parse_view(text: str) -> tuple[float, float]:
    """Heading and pitch from ``30,-5``, in degrees."""
    try:
        heading, pitch = _numbers(text, 2)
    except InputError as error:
        raise InputError(f"--view {error}; such as 30,0, in degrees") from None
    return heading, pitch


def parse_times(text: str) -> tuple[float, ...]:
    """Seconds from ``0.5``, ``0,0.5,2`` or ``0:2:0.1``, which is from the first to the last in steps."""
    try:
        if ":" in text:
            first_s, last_s, step_s = map(float, text.split(":"))
            steps = (last_s - first_s) / step_s
            if not 0 <= steps < MOST_MOMENTS or step_s <= 0:
                raise ValueError
            return tuple(first_s + k * step_s for k in range(int(steps + _ROUNDED) + 1))
        times_s = tuple(map(float, text.split(",")))
        rising = all(one < other for one, other in pairwise(times_s))
        if not rising or not all(map(isfinite, times_s)) or len(times_s) > MOST_MOMENTS:
            raise ValueError
    except (ValueError, ZeroDivisionError):
        raise InputError(
            f"--times {text}: expected seconds, such as 0.5 or 0,0.5,2, or first:last:step, such as 0:2:0.1; "
            f"{MOST_MOMENTS} at most, each later than the one before"
        ) from None
    return times_s


def parse_action(text: str) -> Action:
    """An action from words like those of ``EXAMPLES``: metres, metres a second, radians; left is positive.

    Four numbers hold at 0.5, 1, 1.5 and 2 seconds; a goal is the share of the first frame's width and height.
    """
    words = [word.partition("=") for word in text.split()]
    given = {name: value for name, sign, value in words if sign}
    make = _MAKE.get(frozenset(given))
    try:
        if make is None or len(given) != len(words):
            raise InputError("this is no action")
        return make(given)
    except InputError as error:
        raise InputError(f"--action {text!r}: {error}; examples are: {', or '.join(EXAMPLES)}") from None


def parse_actions(words: Iterable[str]) -> dict[str, Any]:
    """Of ``Control``: one action, or several, each a drive of its own."""
    actions = tuple(map(parse_action, words))
    return {"action": actions[0]} if len(actions) == 1 else {"actions": actions or None}


def _direction(word: str) -> Direction:
    if word not in get_args(Direction):
        raise InputError(f"{word!r} is no command; expected one of {', '.join(get_args(Direction))}")
    return cast(Direction, word)


def _numbers(text: str, count: int) -> list[float]:
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != count:
        raise InputError(f"{text!r}: expected {count} numbers with commas between them")
    return numbers


def _four(text: str) -> Four:
    return cast(Four, tuple(_numbers(text, 4)))
