"""One torch thread beside the native pool."""

from collections.abc import Generator
from contextlib import contextmanager

import torch


@contextmanager
def one_torch_thread() -> Generator[None, None, None]:
    """Run torch's own operations on the calling thread; the native core keeps its threads.

    After every operation torch's workers spin for a while, on the very cores the native threads want: a
    training step on two cores took 3 times as long with two torch threads as with one.
    """
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
