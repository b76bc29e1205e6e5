"""The device that computes: the CPU, or a CUDA device where the user asks for one."""

import re
from collections.abc import Callable, Generator
from contextlib import contextmanager, nullcontext

import torch
from torch import Tensor

from dreamdrive.errors import InputError

CPU = torch.device("cpu")
_chosen = CPU


def in_core(values: Tensor) -> bool:
    """Whether the compiled core takes such a tensor: float32 on the CPU. Torch takes all others."""
    return values.is_cpu and values.dtype == torch.float32


def why_no_cuda() -> str | None:
    """Why torch cannot use a CUDA device here, and what to do about it; None where it can."""
    if torch.version.cuda is None:
        return f"torch {torch.__version__} is built without CUDA: install a build with it"
    if not torch.cuda.is_available():
        return "torch finds no CUDA device: nvidia-smi has to list one"
    return None


def has_bfloat16(device: torch.device) -> bool:
    """Whether a device computes in bfloat16 itself; others only act as if, slowly."""
    if device.type == "cuda":
        return torch.cuda.is_bf16_supported(including_emulation=False)
    can = getattr(torch.cpu, "get_capabilities", dict)()  # torch before 2.10 does not tell
    return any(can.get(name, False) for name in ("amx_bf16", "avx512_bf16", "bf16"))


def chosen_device() -> torch.device:
    """Where networks run: what ``computing_on`` says, the CPU outside of it."""
    return _chosen


def device_of(name: str, why_unusable: Callable[[], str | None] = why_no_cuda) -> torch.device:
    """The device of a name: "cpu", "cuda", or one GPU of several, "cuda:1".

    Args:
        name: See above.
        why_unusable: What keeps CUDA from being used, or None.

    Raises:
        InputError: There is no such device here.
    """
    if re.fullmatch(r"cpu|cuda(:\d{1,3})?", name) is None:
        raise InputError(f"--device {name}: expected cpu, cuda, or one GPU of several such as cuda:1")
    there = torch.device(name)
    if there.type == "cuda":
        if (trouble := why_unusable()) is not None:
            raise InputError(f"--device {name}: {trouble}, or leave --device out for the CPU")
        if (there.index or 0) >= torch.cuda.device_count():
            raise InputError(f"--device {name}: torch finds {torch.cuda.device_count()}, counted from cuda:0")
    return there


@contextmanager
def computing_on(
    name: str, why_unusable: Callable[[], str | None] = why_no_cuda
) -> Generator[torch.device, None, None]:
    """Let networks run on a device, in the whole process; arguments and errors are those of ``device_of``."""
    global _chosen
    there = device_of(name, why_unusable)
    before, _chosen = _chosen, there
    try:
        with torch.cuda.device(there.index or 0) if there.type == "cuda" else nullcontext():
            yield _chosen
    finally:
        _chosen = before
