"""Pairs of what a network is told and of the truth, as planes of bytes in files."""

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import as_completed
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Bool, Float, UInt8
from torch import Tensor

from dreamdrive.compute.machine import workers
from dreamdrive.errors import InputError
from dreamdrive.files.output import claim_folder, new_file

Planes = UInt8[np.ndarray, "p h w"]
Source = Callable[[np.random.Generator], Iterator[Planes]]
"""Makes the pairs of one source; what is random comes from the generator. It can be sent to a process."""
CROP_PX = 144
"""Side of the square that is cut from a pair, unless told."""


@dataclass(frozen=True)
class PlaneRange:
    """Least and largest value of each map that a network is told (C,).

    A pair holds these maps, the truth in RGB, and 255 where that counts.
    """

    low: tuple[float, ...]
    high: tuple[float, ...]

    def packed(
        self,
        told: Float[np.ndarray, "c h w"],
        truth: UInt8[np.ndarray, "h w 3"],
        counts: Bool[np.ndarray, "h w"],
    ) -> Planes:
        """A pair as bytes."""
        low, high = (np.array(each, np.float32)[:, None, None] for each in (self.low, self.high))
        said = np.rint(np.clip((told - low) / (high - low), 0, 1) * 255).astype(np.uint8)
        mask = np.where(counts, 255, 0).astype(np.uint8)[None]
        return np.concatenate([said, truth.transpose(2, 0, 1), mask])

    def batch(
        self, pairs: list[Path], generator: np.random.Generator, count: int, side_px: int
    ) -> tuple[Float[Tensor, "n c y x"], Float[Tensor, "n 3 y x"], Float[Tensor, "n 1 y x"]]:
        """What the network is told, the truth and what of it counts, of squares of some pairs."""
        cuts: list[np.ndarray] = []
        for index in generator.integers(len(pairs), size=count):
            planes = np.load(pairs[index], mmap_mode="r", allow_pickle=False)
            rows, columns = planes.shape[1] - side_px, planes.shape[2] - side_px
            top, left = (int(generator.integers(most // 2 + 1)) * 2 for most in (rows, columns))
            cut = planes[:, top : top + side_px, left : left + side_px]
            cuts.append(cut[:, :, ::-1] if generator.integers(2) else cut)
        return self._unpacked(np.stack(cuts))

    def whole(
        self, pair: Path
    ) -> tuple[Float[Tensor, "1 c h w"], Float[Tensor, "1 3 h w"], Float[Tensor, "1 1 h w"]]:
        """What a pair holds: what the network is told, the truth and what of it counts."""
        return self._unpacked(np.load(pair, allow_pickle=False)[None])

    def _unpacked(self, planes: UInt8[np.ndarray, "n p h w"]) -> tuple[Tensor, Tensor, Tensor]:
        values = torch.from_numpy(planes.astype(np.float32) / 255)
        low, high = (torch.tensor(each)[:, None, None] for each in (self.low, self.high))
        return low + values[:, :-4] * (high - low), values[:, -4:-1], values[:, -1:]


def make_pairs(
    sources: Mapping[str, Source],
    folder: Path,
    *,
    processes: int = 2,
    stop: Callable[[], bool] = lambda: False,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[Path] | None:
    """Write the pairs of sources by their names and return all files; those that are there are kept.

    Sources that raise ``InputError`` give none. ``stop`` is asked after each; then the result is None.
    """
    claim_folder(folder, "set of pairs")
    left = [name for name in sources if not (folder / f"{name}.done").exists()]
    with workers(processes) as pool:
        jobs = [pool.submit(_write, name, sources[name], folder) for name in left]
        for number, job in enumerate(as_completed(jobs)):
            job.result()
            progress(len(sources) - len(left) + number + 1, len(sources))
            if stop():
                return None
    return sorted(folder.glob("*.npy"))


def _write(name: str, source: Source, folder: Path) -> None:
    try:
        for number, planes in enumerate(source(np.random.default_rng([*name.encode()]))):
            with new_file(folder / f"{name}-{number}.npy") as partial, partial.open("wb") as file:
                np.save(file, planes)
    except InputError:
        pass  # nothing can be made of it
    (folder / f"{name}.done").touch()
