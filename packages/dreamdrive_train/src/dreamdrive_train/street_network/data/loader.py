"""Batches of changed pictures; which ones and how follows from the seed and the number of the step alone."""

from collections import deque
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from functools import partial

import numpy as np
import torch

from dreamdrive.compute.machine import workers
from dreamdrive_train.street_network.data.colours import ColourOptions, exchanged, recoloured
from dreamdrive_train.street_network.data.mixture import Entry, Mixture
from dreamdrive_train.street_network.data.picture import (
    STRIDE,
    Picture,
    camera_dropped,
    centred,
    continued,
    cut,
    largest,
    mirrored,
    read_entry,
    turned,
)
from dreamdrive_train.street_network.data.records import UNKNOWN
from dreamdrive_train.street_network.targets import Batch, batch_of

DRAWN = "drawn"
"""How the names of sources begin whose pictures are drawn."""


@dataclass(frozen=True)
class LoaderOptions:
    """How batches are made; shares are of the pictures that a change befalls."""

    batch: int = 8
    """Pictures a step."""
    sizes: tuple[tuple[int, int], ...] = (
        (384, 224),
        (448, 256),
        (512, 288),
        (512, 288),
        (320, 320),
        (512, 160),
    )
    """Width and height of a batch's pictures, drawn at random: that of use is needed for the camera."""
    mirror_share: float = 0.5
    closest: float = 0.8
    """Smallest part of the largest cut about the middle, along each side."""
    aside_share: float = 0.3
    """Cuts away from the middle, which leave the camera unknown."""
    aside_closest: float = 0.4
    turn_share: float = 0.4
    turn_deg: float = 2.5
    """Standard deviation of the turn about the camera's axis."""
    continued_share: float = 0.6
    """Share of flat pictures whose outermost rows are repeated; the others lose their sides."""
    continued: float = 0.3
    """Most such rows, in shares of the new height."""
    erase_share: float = 0.3
    erase: tuple[float, float] = (0.05, 0.3)
    """Sides of erased boxes in shares of the picture's."""
    colour: ColourOptions = field(default_factory=ColourOptions)
    workers: int = 1
    """That prepare batches: one is a thread, which keeps up with two cores that learn; more are processes."""


@dataclass(frozen=True)
class Loader:
    """Makes the batch of each step."""

    mixture: Mixture
    options: LoaderOptions
    seed: int

    def batches(self, first: int, count: int) -> Iterator[Batch]:
        """Batches of steps from the first, made ahead."""
        ahead = 2 * self.options.workers
        waiting: deque[Future[_Arrays]] = deque()
        with self._pool() as (pool, make):
            try:
                for step in range(first, first + count):
                    waiting.append(pool.submit(make, step))
                    if len(waiting) > ahead:
                        yield _batch(waiting.popleft().result())
                while waiting:
                    yield _batch(waiting.popleft().result())
            finally:
                for each in waiting:
                    each.cancel()

    @contextmanager
    def _pool(self) -> Generator[tuple[Executor, "Callable[[int], _Arrays]"], None, None]:
        """Who makes batches, and how it makes that of a step; processes are given the records once."""
        if self.options.workers > 1:
            with workers(self.options.workers, partial(_keep, self)) as pool:
                yield pool, _of_kept
        else:
            with ThreadPoolExecutor(1) as pool:
                yield pool, partial(_arrays, self)

    def batch(self, step: int) -> Batch:
        """The batch of one step."""
        options, generator = self.options, np.random.default_rng((self.seed, step))
        size = options.sizes[int(generator.integers(len(options.sizes)))]
        entries = self.mixture.draw(options.batch, generator)
        placed = [placed_anew(read_entry(entry), size, generator, options) for entry in entries]
        lights = [p.rgb for p, entry in zip(placed, entries, strict=True) if not _is_drawn(entry)]
        taught = [entry.record.labels is None or entry.record.depth is None for entry in entries]
        clean = [picture.rgb for picture, wanted in zip(placed, taught, strict=True) if wanted]
        changed: list[Picture] = []
        for picture, entry in zip(placed, entries, strict=True):
            rgb = picture.rgb
            if lights and _is_drawn(entry) and generator.random() < options.colour.exchange_share:
                light = lights[int(generator.integers(len(lights)))]
                rgb = exchanged(rgb, light, int(generator.integers(*options.colour.exchange)))
            rgb = recoloured(rgb, generator, options.colour)
            changed.append(_erased(replace(picture, rgb=rgb), generator, options))
        return batch_of(changed, taught, clean)


_Arrays = dict[str, np.ndarray]
"""A batch as it goes from one process to another: tensors would take an open file each."""
_kept: list[Loader] = []
"""The loader of a process that prepares batches."""


def _keep(loader: Loader) -> None:
    _kept[:] = [loader]


def _of_kept(step: int) -> _Arrays:
    return _arrays(_kept[0], step)


def _arrays(loader: Loader, step: int) -> _Arrays:
    batch = loader.batch(step)
    return {each.name: getattr(batch, each.name).numpy() for each in fields(batch)}


def _batch(arrays: _Arrays) -> Batch:
    return Batch(**{name: torch.from_numpy(each) for name, each in arrays.items()})


def placed_anew(
    picture: Picture, size: tuple[int, int], generator: np.random.Generator, options: LoaderOptions
) -> Picture:
    """A part of a picture at a size, perhaps turned and mirrored."""
    if generator.random() < options.turn_share:
        picture = turned(picture, generator.normal() * options.turn_deg)
    if generator.random() < options.aside_share:
        across, down = (
            side * generator.uniform(options.aside_closest, 1) for side in largest(picture.size, size)
        )
        across = min(across, down * size[0] / size[1])
        down = across * size[1] / size[0]
        width, height = picture.size
        corner = generator.uniform(0, width - across), generator.uniform(0, height - down)
        picture = camera_dropped(cut(picture, (*corner, across, down), size))
    else:
        if generator.random() < options.continued_share:
            picture = continued(picture, size, options.continued)
        picture = centred(picture, size, generator.uniform(options.closest, 1))
    return mirrored(picture) if generator.random() < options.mirror_share else picture


def _erased(picture: Picture, generator: np.random.Generator, options: LoaderOptions) -> Picture:
    """Perhaps with a box of one colour, of which nothing is known."""
    if generator.random() >= options.erase_share:
        return picture
    rgb, labels, depth = picture.rgb.copy(), picture.labels.copy(), picture.depth.copy()
    height, width = labels.shape
    down, across = (round(generator.uniform(*options.erase) * side) for side in (height, width))
    top, left = int(generator.integers(height - down)), int(generator.integers(width - across))
    whole = slice(STRIDE * top, STRIDE * (top + down)), slice(STRIDE * left, STRIDE * (left + across))
    part = slice(top, top + down), slice(left, left + across)
    rgb[whole] = generator.integers(0, 256, 3)
    labels[part], depth[part] = UNKNOWN, 0
    return replace(picture, rgb=rgb, labels=labels, depth=depth)


def _is_drawn(entry: Entry) -> bool:
    return entry.record.source.startswith(DRAWN)
