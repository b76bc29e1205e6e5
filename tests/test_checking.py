"""The checker of types and shapes refuses what jaxtyping refuses, and takes what that takes."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from jaxtyping import Bool, Float, TypeCheckError

from tests import checked, checking

Row = Float[np.ndarray, " n"]


def same(one: Row, other: Row | None = None, *, count: int = 1) -> Row:
    return one[: len(one) * count]


def plain(text: str, numbers: list[int] | None = None) -> int:
    return len(text) if numbers is None else numbers[0]


def told(rows: int, columns: int) -> Float[np.ndarray, "{rows} {columns}"]:
    return np.zeros((rows, 3))


def either(values: Row | Bool[np.ndarray, "n 2"], row: Row) -> None: ...


def within(values: Row) -> Row:
    # The axes of another call are its own.
    same(np.zeros(len(values) + 1))
    return values


def later(values: "Row", unknown: "OnlyForTheStaticChecker" = None) -> "Row":  # type: ignore[name-defined]
    return values


def each(values: Row) -> Iterator[float]:
    yield from values


def fails(values: Row) -> Row:
    raise KeyError("its own")


CALLS: list[tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any]]] = [
    (same, (np.zeros(3),), {}),
    (same, (np.zeros(3), np.zeros(3)), {}),
    (same, (np.zeros(3), np.zeros(4)), {}),
    (same, (np.zeros(3), 3), {}),
    (same, (np.zeros(3, bool),), {}),
    (same, (np.zeros((3, 1)),), {}),
    (same, (np.zeros(3),), {"count": 0}),
    (same, (np.zeros(3),), {"count": "1"}),
    (plain, ("a",), {}),
    (plain, (b"a",), {}),
    (plain, ("a", [1]), {}),
    (plain, ("a", ["1"]), {}),
    (told, (2, 3), {}),
    (told, (2, 4), {}),
    (either, (np.zeros(3), np.zeros(3)), {}),
    (either, (np.zeros((3, 2), bool), np.zeros(3)), {}),
    (either, (np.zeros((3, 2), bool), np.zeros(2)), {}),
    (within, (np.zeros(3),), {}),
    (later, (np.zeros(3),), {}),
    (later, (np.zeros((3, 3)),), {}),
    (each, (np.zeros(3),), {}),
    (each, (3,), {}),
    (fails, (np.zeros(3),), {}),
]


def verdict(call: Callable[..., Any], *arguments: Any, **named: Any) -> object:
    try:
        made = call(*arguments, **named)
    except Exception as error:  # noqa: BLE001
        return TypeCheckError if isinstance(error, TypeCheckError) else repr(error)
    return list(made) if isinstance(made, Iterator) else repr(made)


@pytest.mark.parametrize(("function", "arguments", "named"), CALLS)
def test_the_same_is_refused(function: Callable[..., Any], arguments: Any, named: Any) -> None:
    ours, theirs = (
        decorate(function, typechecker=checked) for decorate in (checking.jaxtyped, checking._thorough)
    )
    assert verdict(ours, *arguments, **named) == verdict(theirs, *arguments, **named)
    assert verdict(ours, *arguments, **named) == verdict(theirs, *arguments, **named)  # now it is made


def test_both_verdicts_are_among_the_cases() -> None:
    refused = [
        verdict(checking.jaxtyped(f, typechecker=checked), *a, **n) is TypeCheckError for f, a, n in CALLS
    ]
    assert 8 < sum(refused) < len(CALLS) - 8


@checking.jaxtyped(typechecker=checked)
@dataclass(frozen=True)
class Pair:
    one: Row
    name: str

    @checking.jaxtyped(typechecker=checked)
    def add(self, other: Row) -> Row:
        return self.one + other

    @property
    @checking.jaxtyped(typechecker=checked)
    def first(self) -> str:
        return self.one[0]  # type: ignore[return-value]

    @classmethod
    @checking.jaxtyped(typechecker=checked)
    def named(cls, name: str) -> "Pair":
        return cls(np.zeros(2), name)

    @staticmethod
    @checking.jaxtyped(typechecker=checked)
    def half(one: Row) -> Row:
        return one / 2


def test_what_classes_have_is_checked() -> None:
    pair = Pair.named("a")
    assert pair.add(np.ones(2)).tolist() == [1, 1]
    assert pair.half(np.ones(2)).tolist() == [0.5, 0.5]
    for wrong in (
        lambda: Pair(np.zeros((2, 2)), "a"),
        lambda: Pair(np.zeros(2), 3),  # type: ignore[arg-type]
        lambda: pair.add(np.ones((2, 1))),
        lambda: pair.first,
        lambda: Pair.named(3),  # type: ignore[arg-type]
        lambda: Pair.half([1.0]),  # type: ignore[arg-type]
    ):
        with pytest.raises(TypeCheckError):
            wrong()


def test_what_was_wrong_is_said_with_the_sizes_of_axes() -> None:
    with pytest.raises(TypeCheckError, match=r"(?s)parameters of .*same.*'other'.*n=3"):
        checking.jaxtyped(same, typechecker=checked)(np.zeros(3), np.zeros(4))
