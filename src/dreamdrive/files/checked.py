"""Nouns built of values from disk, each field checked against its annotation."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, TypeVar, get_type_hints

import numpy as np
import torch
from jaxtyping import jaxtyped
from torch import Tensor
from typeguard import CollectionCheckStrategy, TypeCheckError, check_type

T = TypeVar("T")


def build(noun: type[T], values: Mapping[str, object]) -> T:
    """A frozen dataclass from its fields by name; those with a default may be missing.

    Shapes are compared across fields: what ``"n 3"`` and ``" n"`` call n is one number. That numbers are
    finite is for the reader to check, see ``check_finite``. A field that is unknown, missing, or of another
    type or shape raises ``ValueError``.
    """
    name = noun.__name__
    known = {field.name for field in fields(noun)}  # pyright: ignore[reportArgumentType]
    if unknown := sorted(set(values) - known):
        raise ValueError(f"{name} has no field {unknown[0]!r}")
    hints = get_type_hints(noun)
    with jaxtyped("context"):
        for field in hints:  # in their order, whatever that of the values is
            if field in values:
                _check(f"{name}.{field}", values[field], hints[field])
    try:
        return noun(**values)
    except TypeError as error:
        raise ValueError(f"{name}: {error}") from None


def check_finite(name: str, value: object) -> None:
    """Raise ``ValueError`` where an array or tensor holds NaN or infinite numbers."""
    if isinstance(value, Tensor):
        finite = not value.is_floating_point() or bool(torch.isfinite(value).all())
    else:
        finite = (
            not isinstance(value, np.ndarray) or value.dtype.kind != "f" or bool(np.isfinite(value).all())
        )
    if not finite:
        raise ValueError(f"{name} holds NaN or infinite numbers")


def _check(name: str, value: object, hint: Any) -> None:
    try:
        check_type(value, hint, collection_check_strategy=CollectionCheckStrategy.ALL_ITEMS)
    except TypeCheckError as error:
        got = tuple(value.shape) if isinstance(value, np.ndarray | Tensor) else type(value).__name__
        raise ValueError(f"{name}: {str(error).splitlines()[0]} (got {got})") from None
