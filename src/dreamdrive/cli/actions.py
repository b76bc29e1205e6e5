"""Actions on the command line."""

from collections.abc import Callable
from typing import Any, cast, get_args

from dreamdrive.errors import InputError
from dreamdrive.scene.action import Action, Command, Direction, Four, Goal, Steering, Waypoints

EXAMPLES = (
    "command=left",
    "speed=8,8,8,8 wheel=0,0,0.1,0.1",
    "ahead=4,8,12,16 right=0,0,0,1",
    "goal=0.5,0.55",
)
_MAKE: dict[frozenset[str], Callable[[Any], Action]] = {
    frozenset({"command"}): lambda given: Command(_direction(given["command"])),
    frozenset({"speed", "wheel"}): lambda given: Steering(_four(given["speed"]), _four(given["wheel"])),
    frozenset({"ahead", "right"}): lambda given: Waypoints(_four(given["right"]), _four(given["ahead"])),
    frozenset({"goal"}): lambda given: Goal(*_numbers(given["goal"], 2)),
}


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
