"""Tests, and the runtime type checker they run the package under."""

import re
from collections.abc import Callable
from types import FunctionType
from typing import Any

from beartype import BeartypeConf, beartype

# An int is a float, as PEP 484 and the static checker have it.
_checked: Callable[..., Any] = beartype(conf=BeartypeConf(is_pep484_tower=True))
_RESULT = re.compile(r"ret\d+")


def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """Check what a function is given, and what it returns.

    jaxtyping has a function of its own checked for each: one of the parameters, and one that takes them again
    with the result, of which the result alone is left to check.
    """
    if isinstance(function, FunctionType):
        code = function.__code__
        taken = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
        if taken and _RESULT.fullmatch(taken[-1]):
            function.__annotations__ = {"return": function.__annotations__.get("return", Any)}
    return _checked(function)
