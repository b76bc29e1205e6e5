"""The restorer: pairs are made before, where scenes take hours of cores, and carried as pictures.

What a network is told of a view are sixteen maps of bytes, and the truth four more: seven pictures of three
planes, which fit into a pack as WebP. Every tenth pair is kept out and judged by.
"""

import json
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import torch
from jaxtyping import UInt8

from dreamdrive.data.pictures.picture_file import read_picture, write_picture
from dreamdrive.errors import InputError
from dreamdrive.files.output import new_file, scratch_beside
from dreamdrive.restore import CHANNELS, RestorerNetwork, load_restorer
from dreamdrive_bench.common.twin import TWIN
from dreamdrive_bench.gpu.figures import Figures
from dreamdrive_bench.training.limit import SAVING_S, Limit, Pace, steps_that_fit
from dreamdrive_bench.training.packed import MOST_BYTES, save_pack, unpack, with_packages
from dreamdrive_train.pairs import PairTraining, train_on_pairs
from dreamdrive_train.restorer import RESTORER

_MOST_PAIRS = 320
_PLANES = CHANNELS + 4
_JUDGED = 10
"""Every so many pairs one is kept out."""


@dataclass(frozen=True)
class RestorerPlan:
    """What is trained, where it has room to choose.

    Attributes:
        steps: Of the training; None takes as many as fit into the limit.
        tried: Steps of a training that is thrown away, to find how many fit; half of them count.
        options: Of the training; its steps follow from the above.
    """

    steps: int | None = None
    tried: int = 80
    options: PairTraining = field(default_factory=lambda: PairTraining(batch=16))


def make_pack(
    path: Path, pairs: Path, most_bytes: int = MOST_BYTES, wheels: Path | None = None
) -> tuple[int, int | None]:
    """Write the pack of the pairs of ``dreamdrive train restorer``; its bytes, and the quality of WebP."""
    found = sorted(pairs.glob("*.npy"))
    if not found:
        raise InputError(f"--sets {pairs}: no pairs are there; expected a folder `pairs` of train restorer")
    chosen = np.unique(np.linspace(0, len(found) - 1, min(_MOST_PAIRS, len(found))).round().astype(int))
    with scratch_beside(path) as made:
        for index in chosen.tolist():
            _write_pictures(np.load(found[index], allow_pickle=False), made / "pairs" / found[index].stem)
        folders = {"pairs": made / "pairs"} | with_packages(wheels, made)
        return save_pack(path, folders, {"of": "restorer"}, most_bytes)


def train(
    pack: Path, out: Path, device: torch.device, limit: Limit, figures: Figures, plan: RestorerPlan
) -> bool:
    """Train from a pack within a limit, or go on; whether all steps were taken.

    ``out/network`` gets the weights where all were.
    """
    unpack(pack, out)
    learned, judged = _pairs(out)
    figures.put("pairs", {"learned": len(learned), "judged": len(judged)})
    figures.put("start", {"as it is": _psnr(None, judged, device)})
    options = replace(plan.options, steps=_steps(learned, out, device, limit, plan))
    pace, losses = Pace(figures, "training", lambda: {"loss": losses[-1] if losses else None}), list[float]()

    def note(done: int, total: int, loss: float) -> None:
        losses.append(loss)
        pace(done, total)

    weights = train_on_pairs(
        RESTORER,
        learned,
        out / "network",
        TWIN,
        options,
        licence="CC-BY-SA-4.0",
        device=device,
        stop=lambda: limit.left_s < SAVING_S,
        progress=note,
    )
    if weights is None:
        figures.put("stopped", "time was over; the same command goes on where its folder is")
        return False
    figures.put("end", {"mended": _psnr(load_restorer(weights), judged, device)})
    return True


def _steps(pairs: list[Path], out: Path, device: torch.device, limit: Limit, plan: RestorerPlan) -> int:
    """As many steps as are asked for, as a training that was stopped had, or as fit into the time."""
    checkpoint = out / "network/checkpoint.json"
    if checkpoint.is_file():
        return int(json.loads(checkpoint.read_text())["options"]["steps"])
    if plan.steps is not None:
        return plan.steps
    times, tried = list[float](), replace(plan.options, steps=plan.tried)

    def note(done: int, total: int, loss: float) -> None:
        times.append(time.monotonic())

    with scratch_beside(out / "network") as thrown:
        train_on_pairs(RESTORER, pairs, thrown / "network", TWIN, tried, device=device, progress=note)
    return steps_that_fit(times, limit)


def _pairs(out: Path) -> tuple[list[Path], list[Path]]:
    """Pairs to learn from and to judge by, as files of planes beside their pictures."""
    folders = sorted(each for each in (out / "pairs").iterdir() if each.is_dir())
    files = [each.with_suffix(".npy") for each in folders]
    for folder, file in zip(folders, files, strict=True):
        if not file.is_file():
            with new_file(file) as partial, partial.open("wb") as open_file:
                np.save(open_file, _read_pictures(folder))
    return [each for k, each in enumerate(files) if k % _JUDGED], files[::_JUDGED]


def _write_pictures(planes: UInt8[np.ndarray, "p h w"], folder: Path) -> None:
    folder.mkdir(parents=True)
    for number, first in enumerate(range(0, len(planes), 3)):
        three = planes[[min(first + k, len(planes) - 1) for k in range(3)]]
        write_picture(folder / f"{number}.jpg", three.transpose(1, 2, 0))


def _read_pictures(folder: Path) -> UInt8[np.ndarray, "p h w"]:
    files = sorted(folder.glob("*.jpg"), key=lambda file: int(file.stem))
    planes = np.concatenate([read_picture(file).transpose(2, 0, 1) for file in files])
    return planes[:_PLANES]


@torch.inference_mode()
def _psnr(network: RestorerNetwork | None, pairs: list[Path], device: torch.device) -> float:
    """Mean PSNR in dB of views as they are, or as a network mends them."""
    found = list[float]()
    for pair in pairs:
        told, truth, counts = (each.to(device) for each in RESTORER.range.whole(pair))
        said = told[:, :3] if network is None else network.to(device)(told).clamp(0, 1)
        error = (counts * (said - truth).square()).sum() / (3 * counts.sum()).clamp(min=1)
        found.append(float(-10 * torch.log10(error.clamp(min=1e-8))))
    return float(np.mean(found))
