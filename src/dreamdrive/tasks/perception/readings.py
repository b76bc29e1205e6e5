"""The worth of generated data to a network, in the three ways in which publications have meant that.

- ``augment``: real and generated samples together, as many steps as with the real ones, tested on real ones.
- ``realism``: a network of real samples, tested on generated ones.
- ``synthetic-train``: generated samples alone, tested on real ones.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import torch

from dreamdrive.compute.device import CPU
from dreamdrive.errors import InputError
from dreamdrive.progress import StageProgress
from dreamdrive.street_network import SHIPPED
from dreamdrive.tasks.perception.bev_set import BevSet
from dreamdrive.tasks.perception.network.network import CrossViewTransformer
from dreamdrive.tasks.perception.network.street_trunk import StreetTrunk
from dreamdrive.tasks.perception.network.weights import load_cvt, load_imagenet, load_street
from dreamdrive.tasks.perception.options import CvtOptions
from dreamdrive.tasks.perception.training.sampling import Samples, shuffled
from dreamdrive.tasks.perception.training.scoring import Counts, score
from dreamdrive.tasks.perception.training.training import CvtTraining, train_cvt

Mode = Literal["augment", "realism", "synthetic-train"]


@dataclass(frozen=True)
class Regime:
    """How every network of a comparison is trained.

    Attributes:
        network: Its sizes.
        training: Steps and rates; its seed is also that of first weights and of the order of samples.
        batch: Samples of a step; the original takes 16.
        trunk: Weights that the trunk starts from: a file of ImageNet's, or of the street network for its
            trunk, of which ``street`` is the one that ships; None for random ones.
    """

    network: CvtOptions = field(default_factory=CvtOptions)
    training: CvtTraining = field(default_factory=CvtTraining)
    batch: int = 4
    trunk: str | None = None


@dataclass(frozen=True)
class Experiment:
    """A network that was trained on some samples and tested on others, with the counts of each drive."""

    trained_on: str
    tested_on: str
    by_drive: dict[str, Counts]


def read_trials(
    mode: Mode,
    real: Sequence[BevSet],
    synthetic: Sequence[BevSet],
    validation: Sequence[BevSet],
    folder: Path,
    regime: Regime,
    *,
    device: torch.device = CPU,
    stop: Callable[[], bool] = lambda: False,
    progress: StageProgress = lambda stage, done, total: None,
) -> list[Experiment] | None:
    """Train and test what a mode asks for; what is trained already in the folder is taken.

    Returns:
        A trial for each row of the table, or None where it was stopped.

    Raises:
        InputError: A set is empty or of another size, or the folder holds another training.
    """
    for each in (*real, *synthetic, *validation):
        _check_size(each, regime.network)
    trained = _trained_on(mode, real, synthetic)
    tested = {"validation": validation}
    if mode == "realism":
        tested["synthetic"] = synthetic
    trials: list[Experiment] = []
    for name, sets in trained.items():
        weights = train_on(sets, folder / name, regime, device=device, stop=stop, progress=progress)
        if weights is None:
            return None
        network = load_cvt(weights)
        for of, others in tested.items():
            said = f"{name} on {of}"
            found = score(
                network,
                Samples(others),
                device=device,
                progress=lambda done, total, said=said: progress(said, done, total),
            )
            trials.append(Experiment(name, of, found))
    return trials


def train_on(
    sets: Sequence[BevSet],
    folder: Path,
    regime: Regime,
    *,
    device: torch.device = CPU,
    stop: Callable[[], bool] = lambda: False,
    progress: StageProgress = lambda stage, done, total: None,
) -> Path | None:
    """Train a network on samples of some sets, or take the one that the folder holds already."""
    samples = Samples(sets)
    return train_cvt(
        first_network(regime),
        shuffled(samples, regime.batch, regime.training.seed),
        folder,
        regime.training,
        data={str(k): each.digest() for k, each in enumerate(sets)},
        device=device,
        stop=stop,
        progress=lambda done, total: progress(f"train {folder.name}", done, total),
    )


def first_network(regime: Regime) -> CrossViewTransformer:
    """A network with the weights that it starts from."""
    torch.manual_seed(regime.training.seed)
    network = CrossViewTransformer(regime.network)
    _start(network, regime.trunk)
    return network


def _trained_on(
    mode: Mode, real: Sequence[BevSet], synthetic: Sequence[BevSet]
) -> dict[str, Sequence[BevSet]]:
    if mode == "augment":
        return {"real": real, "real-and-synthetic": [*real, *synthetic]}
    return {"real": real} if mode == "realism" else {"real": real, "synthetic": synthetic}


def _check_size(samples: BevSet, network: CvtOptions) -> None:
    got, wanted = (
        f"pictures of {image.width_px}x{image.height_px} and {grid.rows} cells"
        for image, grid in ((samples.image, samples.grid), (network.image, network.grid))
    )
    if got != wanted:
        raise InputError(
            f"{samples.folder} has {got}, and the network takes {wanted}; make the set with other --size and "
            "--cells, or choose another --network"
        )


def _start(network: CrossViewTransformer, trunk: str | None) -> None:
    """Give the trunk the weights that it starts from."""
    if trunk is None:
        return
    backbone = network.encoder.backbone
    if isinstance(backbone, StreetTrunk):
        load_street(backbone, trunk)
    elif trunk == SHIPPED:
        raise InputError(f"--trunk {trunk} is for the network quick; expected weights of EfficientNet-B4")
    else:
        load_imagenet(backbone, Path(trunk))  # pyright: ignore[reportArgumentType]
