"""Pickles read without running them: what they ask to be made is written down, and nothing is made.

A pickle is a program that may call any function. This reads the few instructions that tables of pandas need.
Where the program names a class or a function, its name stands in for it, if it is one of ``KNOWN``; a call
becomes a ``Made`` that holds the arguments. No class is looked up, imported or called.
"""

import pickletools
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_bytes

KNOWN = frozenset(
    {
        "builtins slice",
        "numpy dtype",
        "numpy ndarray",
        "numpy.core.multiarray _reconstruct",
        "numpy._core.multiarray _reconstruct",
        "numpy.core.multiarray scalar",
        "numpy._core.multiarray scalar",
        "numpy.core.numeric _frombuffer",
        "numpy._core.numeric _frombuffer",
        "pandas.core.frame DataFrame",
        "pandas.core.indexes.base Index",
        "pandas.core.indexes.base _new_Index",
        "pandas.core.indexes.numeric Int64Index",
        "pandas.core.indexes.range RangeIndex",
        "pandas.core.internals.managers BlockManager",
        "pandas._libs.internals _unpickle_block",
    }
)
"""What a table of pandas 0.25 to 2 names, module and name; nothing else may be named."""
MOST_BYTES = 200_000_000
"""Of a file, and of what it unpacks to: a sweep of PandaSet has 8 MB."""
_MOST_STEPS = 2_000_000
"""Instructions of one file: cuboids take 2000 of them."""
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


class _DamagedError(Exception):
    """An instruction that cannot be followed."""


def read_pickle(path: Path) -> object:
    """The value in a ``.pkl`` or ``.pkl.gz``: ``Made``, ``Name``, and plain values of Python.

    Raises:
        InputError: The file is missing, too large or damaged, or asks for what is not in ``KNOWN``.
    """
    data = _unpacked(path)
    machine = _Machine(str(path))
    try:
        for count, (instruction, argument, _) in enumerate(pickletools.genops(data)):
            if count == _MOST_STEPS:
                raise InputError(f"{path} takes over {_MOST_STEPS} instructions; expected a table of pandas")
            machine.step(instruction.name, argument)
        return machine.stack.pop()
    except InputError:
        raise
    except (_DamagedError, IndexError, KeyError, ValueError) as error:
        raise InputError(
            f"{path} is damaged or no pickled table ({error}); expected a table of pandas as PandaSet has "
            "it: download it again"
        ) from None


def _unpacked(path: Path) -> bytes:
    """The content of a file, which may be packed by gzip."""
    data = read_bytes(path, at_most=MOST_BYTES)
    if not data.startswith(b"\x1f\x8b"):
        return data
    unpack = zlib.decompressobj(16 + zlib.MAX_WBITS)
    try:
        made = unpack.decompress(data, MOST_BYTES + 1)
    except zlib.error as error:
        raise InputError(f"{path} is damaged ({error}); download it again") from None
    if len(made) > MOST_BYTES:
        raise InputError(f"{path} unpacks to over {MOST_BYTES / 1e6:.0f} MB; expected a table of one time")
    if not unpack.eof:
        raise InputError(f"{path} is cut short; download it again")
    return made


class _Machine:
    """The stack of a pickle, its marks and what it remembers."""

    def __init__(self, where: str) -> None:
        self.where = where
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
            raise _DamagedError(f"it has the instruction {name}, which such tables have not")

    def _make(self, name: str, argument: Any) -> None:
        """Name a class, write down a call of it, or give what it made a state."""
        if name == "GLOBAL":
            self._name(argument)
        elif name == "STACK_GLOBAL":
            parts = self._last(2)
            if not all(isinstance(part, str) for part in parts):
                raise _DamagedError("a name is no text")
            self._name(" ".join(parts))
        elif name == "BUILD":
            (state,) = self._last(1)
            self._top(Made).state = state
        else:
            called, args = self._last(2)
            if not isinstance(called, Name) or not isinstance(args, tuple):
                raise _DamagedError("it calls what is no function")
            self.stack.append(Made(called.name, cast("tuple[Any, ...]", args)))

    def _name(self, full: str) -> None:
        if full not in KNOWN:
            raise InputError(
                f"{self.where} asks for {full.replace(' ', '.')!r}, which tables of PandaSet do not need; "
                "nothing of it was run: do not open this file with other programs, download it again"
            )
        self.stack.append(Name(full.split()[1]))

    def _last(self, count: int) -> list[Any]:
        if len(self.stack) < count:
            raise _DamagedError("its stack is too short")
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
            raise _DamagedError(f"it changes a {type(top).__name__} as if it were a {kind.__name__}")
        return top

    def _set(self, values: list[Any]) -> None:
        keys = values[::2]
        # Hashing nested tuples would take for ever.
        if len(values) % 2 or not all(type(key) in (str, int) for key in keys):
            raise _DamagedError("it has keys that are no text")
        self._top(dict).update(zip(keys, values[1::2], strict=True))
