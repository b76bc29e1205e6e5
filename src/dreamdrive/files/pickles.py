"""Pickles read without running them: what they ask to be made is written down, and nothing is made.

A pickle is a program that may call any function. This follows the few instructions that tables,
dictionaries, lists, numbers and arrays need. Where the program names a class or a function, its name stands
in for it, if it is one of those that are expected; a call becomes a ``Made`` that holds the arguments. No
class is looked up, imported or called.
"""

import pickletools
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from dreamdrive.errors import InputError

ARRAYS = frozenset(
    {
        "numpy dtype",
        "numpy ndarray",
        *(
            f"{core}.{name}"
            for core in ("numpy.core", "numpy._core")
            for name in ("multiarray _reconstruct", "multiarray scalar", "numeric _frombuffer")
        ),
    }
)
"""What arrays of NumPy name, module and name."""
_CONSTANTS = frozenset(
    {
        *("BININT", "BININT1", "BININT2", "LONG1", "BINFLOAT"),
        *("BINUNICODE", "SHORT_BINUNICODE", "BINUNICODE8"),
        *("BINBYTES", "SHORT_BINBYTES", "BINBYTES8", "BYTEARRAY8"),
    }
)
"""Instructions whose argument is a value."""
_NEW: dict[str, Any] = {"NONE": None, "NEWTRUE": True, "NEWFALSE": False, "EMPTY_TUPLE": ()}
_TUPLES = {"TUPLE1": 1, "TUPLE2": 2, "TUPLE3": 3}


@dataclass(frozen=True)
class Name:
    """A class or function by its name without the module, which stands in for it."""

    name: str


@dataclass(eq=False)
class Made:
    """What a call would have made.

    Attributes:
        name: Of what would have been called, without its module.
        args: Of the call.
        state: What the object would have been given afterwards.
    """

    name: str
    args: tuple[Any, ...]
    state: Any = None


@dataclass(frozen=True)
class Expected:
    """What a pickle may be.

    Attributes:
        names: All classes and functions that it may name, as module and name.
        steps: Most instructions.
        what: In words, and what to do about another one: the end of messages.
    """

    names: frozenset[str]
    steps: int
    what: str


class DamagedPickleError(Exception):
    """An instruction or a value that cannot be followed."""


def follow(data: bytes, path: Path, expected: Expected) -> object:
    """The value of a pickle: ``Made``, ``Name``, and plain values of Python.

    Raises:
        InputError: It asks for what is not expected; ``path`` is what messages name.
        DamagedPickleError: It is no pickle of what is expected.
    """
    machine = _Machine(path, expected)
    try:
        with warnings.catch_warnings():
            # Of broken text, of which an error follows where it counts.
            warnings.simplefilter("ignore", DeprecationWarning)
            for count, (instruction, argument, _) in enumerate(pickletools.genops(data)):
                if count == expected.steps:
                    raise InputError(
                        f"{path} takes over {expected.steps} instructions; expected {expected.what}"
                    )
                machine.step(instruction.name, argument)
        return machine.stack.pop()
    except InputError:
        raise
    except (IndexError, KeyError, ValueError, TypeError, OverflowError, MemoryError) as error:
        raise DamagedPickleError(str(error)) from None


class _Machine:
    """The stack of a pickle, its marks and what it remembers."""

    def __init__(self, path: Path, expected: Expected) -> None:
        self._path, self._expected = path, expected
        self.stack: list[Any] = []
        self._marks: list[int] = []
        self._memo: dict[int, Any] = {}

    def step(self, name: str, argument: Any) -> None:
        """Follow one instruction."""
        stack = self.stack
        if name in _CONSTANTS:
            stack.append(argument)
        elif name in _NEW:
            stack.append(_NEW[name])
        elif name in ("BINPUT", "LONG_BINPUT", "MEMOIZE"):
            self._memo[len(self._memo) if name == "MEMOIZE" else argument] = stack[-1]
        elif name in ("BINGET", "LONG_BINGET"):
            stack.append(self._memo[argument])
        elif name == "MARK":
            self._marks.append(len(stack))
        elif name in ("EMPTY_LIST", "EMPTY_DICT"):
            stack.append([] if name == "EMPTY_LIST" else {})
        elif name == "TUPLE":
            stack.append(tuple(self._since_mark()))
        elif name in _TUPLES:
            stack.append(tuple(self._last(_TUPLES[name])))
        elif name in ("APPEND", "APPENDS"):
            values = self._last(1) if name == "APPEND" else self._since_mark()
            self._top(list).extend(values)
        elif name in ("SETITEM", "SETITEMS"):
            self._set(self._last(2) if name == "SETITEM" else self._since_mark())
        elif name in ("GLOBAL", "STACK_GLOBAL", "REDUCE", "NEWOBJ", "BUILD"):
            self._make(name, argument)
        elif name not in ("PROTO", "FRAME", "STOP"):
            raise DamagedPickleError(f"it has the instruction {name}, which is not expected")

    def _make(self, name: str, argument: Any) -> None:
        """Name a class, write down a call of it, or give what it made a state."""
        if name == "GLOBAL":
            self._name(argument)
        elif name == "STACK_GLOBAL":
            parts = self._last(2)
            if not all(isinstance(part, str) for part in parts):
                raise DamagedPickleError("a name is no text")
            self._name(" ".join(parts))
        elif name == "BUILD":
            (state,) = self._last(1)
            self._top(Made).state = state
        else:
            called, args = self._last(2)
            if not isinstance(called, Name) or not isinstance(args, tuple):
                raise DamagedPickleError("it calls what is no function")
            self.stack.append(Made(called.name, cast("tuple[Any, ...]", args)))

    def _name(self, full: str) -> None:
        if full not in self._expected.names:
            raise InputError(
                f"{self._path} asks for {full.replace(' ', '.')!r}; nothing of it was run, and nothing else "
                f"should run it. Expected {self._expected.what}"
            )
        self.stack.append(Name(full.split()[1]))

    def _last(self, count: int) -> list[Any]:
        if len(self.stack) < count:
            raise DamagedPickleError("its stack is too short")
        values = self.stack[-count:]
        del self.stack[-count:]
        return values

    def _since_mark(self) -> list[Any]:
        place = self._marks.pop()
        values = self.stack[place:]
        del self.stack[place:]
        return values

    def _top(self, kind: type) -> Any:
        top = self.stack[-1]
        if type(top) is not kind:
            raise DamagedPickleError(f"it changes a {type(top).__name__} as if it were a {kind.__name__}")
        return top

    def _set(self, values: list[Any]) -> None:
        into = self._top(dict)
        for key, value in zip(values[::2], values[1::2], strict=True):
            # Hashing nested tuples would take for ever.
            if type(key) not in (str, int):
                raise DamagedPickleError("it has keys that are no text")
            if key in into:
                raise InputError(f"{self._path} has two entries {str(key)[:80]!r}; expected one of each")
            into[key] = value
