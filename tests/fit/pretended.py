"""A device that is not the CPU, computed on it: what a fit on a GPU does, without one.

Its tensors say that they are elsewhere. An operation on one of them and on a tensor of the CPU with more than
one number is refused, as a GPU does; so is reading them as NumPy.
"""

from collections.abc import Generator
from contextlib import contextmanager
from typing import Any

import pytest
import torch
from torch.utils._python_dispatch import TorchDispatchMode, return_and_correct_aliasing
from torch.utils._pytree import tree_leaves, tree_map
from torch.utils.backend_registration import _setup_privateuseone_for_python_backend

from dreamdrive.splat import BACKENDS, reference

_setup_privateuseone_for_python_backend("pretended")
DEVICE = torch.device("pretended:0")


class Elsewhere(torch.Tensor):
    """A tensor on the pretended device; its numbers are those of ``here``."""

    here: torch.Tensor

    @staticmethod
    def __new__(cls, here: torch.Tensor) -> "Elsewhere":
        made = torch.Tensor._make_wrapper_subclass(
            cls,
            here.shape,
            strides=here.stride(),
            storage_offset=here.storage_offset(),
            dtype=here.dtype,
            device=DEVICE,
        )
        made.here = here
        return made

    @classmethod
    def __torch_dispatch__(cls, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        return computed(func, args, kwargs or {})


class Pretending(TorchDispatchMode):
    """Lets factories make tensors on the pretended device."""

    def __torch_dispatch__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        return computed(func, args, kwargs or {})


def computed(func: Any, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
    """The operation on the CPU, its results where the device of its arguments, or the one asked for, is."""
    given = [value for value in tree_leaves((args, kwargs)) if isinstance(value, torch.Tensor)]
    elsewhere = any(isinstance(value, Elsewhere) for value in given)
    if elsewhere and func is not torch.ops.aten.copy_.default:
        for value in given:
            if not isinstance(value, Elsewhere) and value.dim():
                raise RuntimeError(f"{func}: a tensor of the CPU, {tuple(value.shape)}, among others")
    named = [value for value in args if isinstance(value, torch.device)]
    wanted = named[0] if named else kwargs.get("device")
    there = elsewhere if wanted is None else torch.device(wanted).type == DEVICE.type

    def inner(value: Any) -> Any:
        if isinstance(value, torch.device):
            return torch.device("cpu")
        return value.here if isinstance(value, Elsewhere) else value

    def outer(value: Any) -> Any:
        return Elsewhere(value) if there and isinstance(value, torch.Tensor) else value

    result = tree_map(outer, func(*tree_map(inner, args), **tree_map(inner, kwargs)))
    # In inference mode a copy to the CPU comes as one that might be a view.
    return return_and_correct_aliasing(func, args, kwargs, result) if elsewhere and there else result


@contextmanager
def pretending() -> Generator[torch.device, None, None]:
    """Inside, tensors can be made on the device that is given."""
    torch._C._set_only_lift_cpu_tensors(True)  # or torch.tensor would make its tensor behind the mode's back
    try:
        with Pretending():
            yield DEVICE
    finally:
        torch._C._set_only_lift_cpu_tensors(False)


def splat_there(patch: pytest.MonkeyPatch) -> None:
    """Off the CPU the reference splats."""
    patch.setattr(reference, "check_device", lambda tensors, kind: None)
    patch.setattr(reference, "check_pose", lambda pose: None)
    patch.setitem(BACKENDS, "gsplat", reference.rasterize_reference)


def copies_to_the_cpu(patch: pytest.MonkeyPatch) -> list[torch.Size]:
    """Grows by the shape of each tensor that is copied from the device, but for single numbers."""
    seen: list[torch.Size] = []
    really = computed

    def counted(func: Any, args: Any, kwargs: Any) -> Any:
        result = really(func, args, kwargs)
        from_there = any(isinstance(value, Elsewhere) for value in args)
        if from_there and isinstance(result, torch.Tensor) and not isinstance(result, Elsewhere):
            seen.append(result.shape)
        return result

    patch.setitem(globals(), "computed", counted)
    return seen
