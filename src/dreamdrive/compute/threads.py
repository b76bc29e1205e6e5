"""Work on two threads, and one torch thread beside the native pool."""

from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

import torch

THREADS = 2

A = TypeVar("A")
B = TypeVar("B")


def ahead(function: Callable[[A], B], items: Iterable[A]) -> Iterator[B]:
    """``function`` of each item, in order, two at a time and no further ahead of who takes them.

    The result does not depend on the threads.
    """
    begun: deque[Future[B]] = deque()
    with ThreadPoolExecutor(THREADS) as pool:
        try:
            for item in items:
                begun.append(pool.submit(function, item))
                if len(begun) > THREADS:
                    yield begun.popleft().result()
            while begun:
                yield begun.popleft().result()
        finally:
            pool.shutdown(cancel_futures=True)


def parallel(
    function: Callable[[A], B], items: Iterable[A], tell: Callable[[], None] = lambda: None
) -> list[B]:
    """``function`` of each item, in order, two at a time; the result does not depend on the threads."""
    done: list[B] = []
    for value in ahead(function, items):
        done.append(value)
        tell()
    return done


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
