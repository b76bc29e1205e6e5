"""Batches out of sets of samples: shuffled, endless, and the same again from any step on."""

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from dreamdrive.errors import InputError
from dreamdrive.tasks.perception.bev_set import BevSet
from dreamdrive.tasks.perception.network.inputs import BevSample, as_batch
from dreamdrive.tasks.perception.training.batch import BevBatch

KEPT_BYTES = 2_000_000_000
"""Most memory that samples take which are read once and kept."""


class Samples:
    """Samples of several sets, one behind the other; they are kept once read while there is room."""

    def __init__(self, sets: Sequence[BevSet]) -> None:
        sizes = {(each.image, each.grid) for each in sets}
        if len(sizes) != 1:
            raise InputError(
                "the sets have pictures or cells of several sizes: "
                f"{', '.join(str(each.folder) for each in sets)}; make them with one --size and --cells"
            )
        self._rows = [(each, index) for each in sets for index in range(len(each))]
        if not self._rows:
            raise InputError("the sets hold no samples")
        counts = sorted({len(each.notes[index].cameras) for each, index in self._rows})
        if len(counts) > 1:
            raise InputError(
                f"the sets have samples of {counts[0]} and of {counts[-1]} cameras; expected one rig"
            )
        self._kept: dict[int, BevSample] = {}
        self._bytes = 0

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, index: int) -> BevSample:
        """One of them."""
        if index in self._kept:
            return self._kept[index]
        where, row = self._rows[index]
        sample = where[row]
        self._bytes += sample.pictures.nbytes + sample.labels.auxiliary.nbytes + sample.labels.layers.nbytes
        if self._bytes < KEPT_BYTES:
            self._kept[index] = sample
        return sample

    def scene(self, index: int) -> str:
        """The drive that one is of."""
        where, row = self._rows[index]
        return where.notes[row].scene


def shuffled(samples: Samples, size: int, seed: int) -> Callable[[int], Iterable[BevBatch]]:
    """From a step to all batches from there on: each sample once, in an order of its own each time round.

    Args:
        samples: At least as many as a batch holds.
        size: Samples of a batch.
        seed: Of the orders.
    """
    _rounds(len(samples), size)

    def batches(first: int) -> Iterator[BevBatch]:
        for rows in shuffled_rows(len(samples), size, seed, first):
            yield as_batch([samples[index] for index in rows])

    return batches


def shuffled_rows(count: int, size: int, seed: int, first: int = 0) -> Iterator[list[int]]:
    """Which of ``count`` samples the batches of ``shuffled`` hold, from a step on."""
    rounds, step = _rounds(count, size), first
    while True:
        order = np.random.default_rng([seed, step // rounds]).permutation(count)
        for row in range(step % rounds, rounds):
            yield order[row * size : (row + 1) * size].tolist()
            step += 1


def _rounds(count: int, size: int) -> int:
    """Batches of a round."""
    if count < size:
        raise InputError(f"{count} samples are fewer than a batch of {size}")
    return count // size
