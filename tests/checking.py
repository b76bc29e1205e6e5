"""Types and shapes are checked where the package is called, at half of what jaxtyping takes for that.

jaxtyping binds the arguments of every call, keeps a record of axes for it, and has it checked twice.
Here a function without arrays is beartype's alone, and one with arrays is checked once, within a record
of axes. What is refused is handed to jaxtyping, which says best what was wrong.
"""

import functools
import inspect
import re
from collections.abc import Callable
from dataclasses import is_dataclass
from types import FunctionType
from typing import Any, get_args, get_type_hints

import jaxtyping
from beartype import BeartypeConf, beartype
from jaxtyping import AbstractArray, TypeCheckError


class _GivenError(TypeCheckError):
    """A parameter is wrong."""


class _MadeError(TypeCheckError):
    """A result is wrong."""


# An int is a float, as PEP 484 and the static checker have it.
_TOWER = BeartypeConf(is_pep484_tower=True)
_PLAIN = BeartypeConf(is_pep484_tower=True, violation_type=TypeCheckError)
_SHAPED = BeartypeConf(
    is_pep484_tower=True, violation_param_type=_GivenError, violation_return_type=_MadeError
)
_RESULT = re.compile(r"ret\d+")
_thorough: Callable[..., Any] = jaxtyping.jaxtyped


def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """Check what a function is given, and what it returns, for jaxtyping.

    It has a function of its own checked for each: one of the parameters, and one that takes them again with
    the result, of which the result alone is left to check.
    """
    if isinstance(function, FunctionType):
        code = function.__code__
        taken = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
        if taken and _RESULT.fullmatch(taken[-1]):
            function.__annotations__ = {"return": function.__annotations__.get("return", Any)}
    return beartype(conf=_TOWER)(function)


def jaxtyped(function: Any = None, **typechecker: Any) -> Any:
    """In place of jaxtyping's decorator of functions, methods and dataclasses."""
    if not typechecker:
        return _thorough(function)  # such as its "context"
    if function is None:
        return functools.partial(jaxtyped, **typechecker)
    if inspect.isclass(function):
        if is_dataclass(function) and "__init__" in vars(function):
            function.__init__ = jaxtyped(function.__init__, **typechecker)
        return function
    if isinstance(function, (classmethod, staticmethod)):
        return type(function)(jaxtyped(function.__func__, **typechecker))
    if isinstance(function, property):
        parts = (function.fget, function.fset, function.fdel)
        return property(*(part and jaxtyped(part, **typechecker) for part in parts))
    if not isinstance(function, FunctionType):
        return _thorough(function, **typechecker)
    thorough, check = functools.partial(_thorough, function, **typechecker), None

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        __tracebackhide__ = True
        nonlocal check
        # Most functions that a test loads it never calls.
        if check is None:
            check = function  # what finds modules is called while the check is made
            check = _check_of(function, thorough)
        return check(*args, **kwargs)

    return call


def _check_of(function: FunctionType, thorough: Callable[[], Callable[..., Any]]) -> Callable[..., Any]:
    if inspect.isgeneratorfunction(function):
        return thorough()  # its body runs when the record of axes is gone
    copy = _with_hints(function)
    arrays = [array for hint in copy.__annotations__.values() for array in _arrays(hint)]
    if not arrays:
        return beartype(conf=_PLAIN)(copy)
    # Sizes that are told by other parameters need these.
    return thorough() if any("{" in array.dim_str for array in arrays) else _shaped(copy, thorough)


def _shaped(function: FunctionType, thorough: Callable[[], Callable[..., Any]]) -> Callable[..., Any]:
    quick = beartype(conf=_SHAPED)(function)

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        __tracebackhide__ = True
        try:
            with _thorough("context"):
                return quick(*args, **kwargs)
        except _GivenError:
            return thorough()(*args, **kwargs)
        except _MadeError as error:
            name = f"{function.__module__}.{function.__qualname__}"
            raise TypeCheckError(
                f"Type-check error whilst checking the return value of {name}: {error}"
            ) from error

    return call


def _with_hints(function: FunctionType) -> FunctionType:
    """A copy without strings for annotations; what only the static checker imports may be anything."""
    of = function
    copy = FunctionType(of.__code__, of.__globals__, of.__name__, of.__defaults__, of.__closure__)
    functools.update_wrapper(copy, function)
    del copy.__wrapped__  # type: ignore[attr-defined]
    copy.__kwdefaults__ = function.__kwdefaults__
    copy.__annotations__ = {name: _hint(hint, function) for name, hint in function.__annotations__.items()}
    return copy


def _hint(hint: Any, function: FunctionType) -> Any:
    def named(value: Any) -> None: ...

    named.__annotations__ = {"value": hint}
    try:
        return get_type_hints(named, function.__globals__, include_extras=True)["value"]
    except (NameError, TypeError, AttributeError):
        return Any


def _arrays(hint: Any) -> list[type[AbstractArray]]:
    if inspect.isclass(hint) and issubclass(hint, AbstractArray):
        return [hint]
    return [array for part in get_args(hint) for array in _arrays(part)]
