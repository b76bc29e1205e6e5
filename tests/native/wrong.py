"""Calls of the compiled core with arguments that are wrong.

    python -m tests.native.wrong            all functions
    python -m tests.native.wrong forward    some

Each function is tried in a process of its own, which may neither crash nor hang.
"""

import ast
import os
import resource
import signal
import sys
import traceback
import warnings
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from dreamdrive import _native
from tests.native.calls import CALLS, Arguments

REFUSALS = (TypeError, ValueError, OverflowError, MemoryError)
STUB = Path(__file__).parents[2] / "src" / "dreamdrive" / "_native.pyi"
_CALLS, _SECONDS, _BYTES = 300, 60, 2_000_000_000
_NUMBERS = (
    0,
    -1,
    1,
    3,
    127,
    2**31 - 1,
    -(2**31),
    2**31,
    2**62,
    -(2**63),
    2**64,
    1e300,
    np.nan,
    np.inf,
    -np.inf,
    "x",
)
_FILLS = (np.nan, np.inf, -np.inf, 1e38, -1e38, 1e-45, 0.0, 3e9, -3e9)


def stated() -> dict[str, set[str]]:
    """The parameters of all functions by what the types of the core say."""
    functions = [each for each in ast.parse(STUB.read_text()).body if isinstance(each, ast.FunctionDef)]
    return {each.name: {argument.arg for argument in each.args.args} for each in functions}


def wrong_calls(name: str, rng: Random) -> Iterator[Arguments]:
    """Right calls of which one to three arguments are not."""
    for _ in range(_CALLS):
        given = CALLS[name]()
        for each in rng.sample(sorted(given), min(len(given), rng.choice((1, 1, 1, 2, 3)))):
            given[each] = _wrong(given[each], given, rng)
        yield given


def _wrong(value: Any, all_: Arguments, rng: Random) -> Any:
    if rng.random() < 0.1:
        return rng.choice((None, "x", object(), [], (), {}, True))
    if isinstance(value, np.ndarray):
        return _wrong_array(value, all_, rng)
    if isinstance(value, list):
        return _wrong_list(value, all_, rng)
    if isinstance(value, int | float):
        return rng.choice(_NUMBERS)
    return rng.choice((type(value).__new__(type(value)), *all_.values()))


def _wrong_list(value: list[Any], all_: Arguments, rng: Random) -> list[Any]:
    kind = rng.choice(("empty", "short", "long", "element", "element", "element"))
    if kind == "element" and value:
        place = rng.randrange(len(value))
        return [*value[:place], _wrong(value[place], all_, rng), *value[place + 1 :]]
    return {"short": value[:-1], "long": value * 3}.get(kind, [])


def _wrong_array(value: np.ndarray, all_: Arguments, rng: Random) -> np.ndarray:
    arrays = [each for each in all_.values() if isinstance(each, np.ndarray)]
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        made = {
            "none": lambda: value.reshape(-1)[:1].reshape(()),
            "empty": lambda: np.zeros((0, *value.shape[1:]), value.dtype),
            "no columns": lambda: np.zeros((*value.shape[:-1], 0), value.dtype),
            "other type": lambda: value.astype(
                rng.choice((np.float64, np.float16, np.int32, np.uint8, np.complex64))
            ),
            "strided": lambda: np.repeat(value, 2, axis=-1)[..., ::2],
            "backwards": lambda: value[::-1],
            "columns first": lambda: np.asfortranarray(value),
            "fixed": lambda: _fixed(value),
            "shorter": lambda: np.ascontiguousarray(value[:-1]),
            "longer": lambda: np.concatenate([value, value]),
            "flat": lambda: value.reshape(-1),
            "deeper": lambda: value[None],
            "filled": lambda: np.full_like(value, rng.choice(_FILLS) if value.dtype.kind == "f" else 1),
            "extreme": lambda: np.full_like(
                value, -1 if value.dtype.kind == "b" else _extreme(value.dtype, rng)
            ),
            "another": lambda: rng.choice(arrays or [value]),
        }
        return made[rng.choice(sorted(made))]()


def _fixed(value: np.ndarray) -> np.ndarray:
    copy = value.copy()
    copy.setflags(write=False)
    return copy


def _extreme(dtype: np.dtype, rng: Random) -> Any:
    ends = np.iinfo(dtype) if dtype.kind in "iu" else np.finfo(dtype)
    return rng.choice((ends.min, ends.max))


def tried(name: str) -> str | None:
    """What is wrong with a function: how its process ended, or what it raised; None where nothing is."""
    told, tell = os.pipe()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            space = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
            resource.setrlimit(resource.RLIMIT_AS, (space + _BYTES, resource.RLIM_INFINITY))
            signal.alarm(_SECONDS)
            # Of objects that nothing is in.
            warnings.filterwarnings(
                "ignore", "nanobind: attempted to access an uninitialized", RuntimeWarning
            )
            os.write(tell, (_unexpected(name) or "").encode()[:2000])
            code = 0
        except BaseException:  # noqa: BLE001
            os.write(tell, traceback.format_exc()[-2000:].encode())
        finally:
            os._exit(code)
    os.close(tell)
    _, status = os.waitpid(child, 0)
    with os.fdopen(told, "rb") as said:
        words = said.read().decode()
    code = os.waitstatus_to_exitcode(status)
    return words or None if code == 0 else f"the process ended with {code}: {words}"


def _unexpected(name: str) -> str | None:
    function = getattr(_native, name)
    function(**CALLS[name]())
    for number, arguments in enumerate(wrong_calls(name, Random(name))):
        try:
            function(**arguments)
        except REFUSALS:
            continue
        except Exception as error:  # noqa: BLE001
            return f"call {number} raised {type(error).__name__}: {error}"
    return None


def main() -> int:
    names = sys.argv[1:] or list(CALLS)
    wrong = {name: said for name in names if (said := tried(name)) is not None}
    for name, said in wrong.items():
        sys.stdout.write(f"{name}: {said}\n")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
