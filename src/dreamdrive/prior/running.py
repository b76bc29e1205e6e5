"""Work that priors have in common while their networks run."""

import itertools
from collections.abc import Callable, Generator
from contextlib import contextmanager

import numpy as np
import torch
from jaxtyping import Shaped
from torch import Tensor

from dreamdrive.errors import InputError, installing
from dreamdrive.progress import Progress

PACKAGE, INSTALL = "diffusers", installing("video-prior")
"""What priors with a network need, and how to get it."""


@contextmanager
def enough_memory(advice: str) -> Generator[None]:
    """Work that may find the GPU too small: then an InputError, with ``advice`` on what to do."""
    try:
        yield
    except torch.OutOfMemoryError as error:
        raise InputError(f"the GPU's memory does not suffice ({first_line(error)}); {advice}") from error


def check_finite(values: Tensor | Shaped[np.ndarray, "..."], what: str) -> None:
    """Refuse NaN and infinity, which damaged weights or overflow lead to; ``what`` the network made."""
    finite = torch.isfinite(values).all() if isinstance(values, Tensor) else np.isfinite(values).all()
    if not bool(finite):
        raise InputError(
            f"the model gave {what} that hold NaN or infinite numbers; its weights are damaged, or overflow "
            "in half precision"
        )


def counted(progress: Progress, total: int) -> Callable[[], None]:
    """A function to call after each of ``total`` steps."""
    steps = itertools.count(1)
    return lambda: progress(next(steps), total)


def first_line(error: Exception) -> str:
    """What an error of a library says, as part of a sentence."""
    return str(error).strip().split("\n")[0].rstrip(".")
