"""Features of sets of pictures, and the distances between them."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch

from dreamdrive.errors import InputError
from dreamdrive.evaluate import (
    MIN_SAMPLES,
    Toolbox,
    distance_with_interval,
    frechet_distance,
    kernel_distance,
    windows,
)
from dreamdrive.files.digest import digest
from dreamdrive_bench.common.keep import Features, is_current, load_features, save
from dreamdrive_bench.table1.drives import Pictures


@dataclass(frozen=True)
class Ruler:
    """What pictures are measured by: networks, pictures of a window, pictures from one to the next."""

    toolbox: Toolbox
    window: int
    stride: int

    @property
    def about(self) -> list[object]:
        """What features follow from beside the pictures."""
        box = self.toolbox
        return [[e.frechet, box.weights[e.frechet]["sha256"]] for e in box.extractors] + [
            self.window,
            self.stride,
        ]

    def features(self, pictures: Pictures, file: Path) -> Features:
        """By the name of the Fréchet distance, a row a picture or window; kept in a file."""
        key = digest([pictures.key, self.about])
        if not is_current(file, key):
            save(file, key, {}, self._features(pictures))
        return load_features(file)

    def _features(self, pictures: Pictures) -> Features:
        frames = torch.from_numpy(pictures.read())
        parts = windows(frames, self.window, self.stride)
        if not parts:
            raise InputError(
                f"{pictures.folder} has {len(frames)} pictures, fewer than --window {self.window}; choose "
                "more --frames or a smaller window"
            )
        found: Features = {}
        for extractor in self.toolbox.extractors:
            sets = parts if extractor.window else [frames]
            found[extractor.frechet] = np.concatenate([extractor.features(each) for each in sets])
        return found


def distances(
    real: Sequence[Features], fake: Sequence[Features], toolbox: Toolbox, resamples: int
) -> dict[str, Any]:
    """By name, the distances of two sets; a pair of features for each scene.

    Raises:
        InputError: There are too few samples for a floor.
    """
    figures: dict[str, Any] = {}
    for extractor in toolbox.extractors:
        a, b = ([each[extractor.frechet] for each in features] for features in (real, fake))
        if sum(map(len, a)) < MIN_SAMPLES:
            what = "windows" if extractor.window else "pictures"
            raise InputError(
                f"{sum(map(len, a))} real {what} are too few for a floor; choose more --frames or a smaller "
                "--stride"
            )
        found = partial(distance_with_interval, a, b, paired=True, resamples=resamples)
        figures[extractor.frechet] = asdict(found(frechet_distance))
        figures[extractor.kernel] = asdict(found(kernel_distance))
    return figures


def together(features: Sequence[Features]) -> Features:
    """The features of several trajectories as those of one set."""
    return {name: np.concatenate([each[name] for each in features]) for name in features[0]}


def row_of(
    real: Sequence[Features],
    fake: Mapping[str, Sequence[Features]],
    novel: Sequence[str],
    toolbox: Toolbox,
    resamples: int,
) -> dict[str, Any]:
    """Figures of a representation: of all novel trajectories together, and of each alone.

    Args:
        real: Features of each scene.
        fake: The same by trajectory.
        novel: Which of these are novel.
        toolbox: The networks.
        resamples: Of the scenes, for intervals of the novel ones together.
    """
    pooled = [together([fake[name][k] for name in novel]) for k in range(len(real))]
    return {
        "novel": distances(real, pooled, toolbox, resamples),
        "alone": {name: distances(real, found, toolbox, 0) for name, found in fake.items()},
    }
