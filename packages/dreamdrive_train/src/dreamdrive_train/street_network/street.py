"""The whole training: from folders of records to a file of weights."""

import subprocess
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import torch

import dreamdrive
from dreamdrive.errors import InputError
from dreamdrive.models import sha256
from dreamdrive.progress import Progress, silent
from dreamdrive.street_network.encoder import read_encoder
from dreamdrive.street_network.network import StreetNetwork
from dreamdrive.street_network.weights import Training, read_network, write_network
from dreamdrive_train.street_network.data.mixture import Entry, Mixture, read_entries, split
from dreamdrive_train.street_network.judge import judge
from dreamdrive_train.street_network.loop import train
from dreamdrive_train.street_network.options import TrainingOptions

WEIGHTS = "street.safetensors"


@dataclass(frozen=True)
class StreetTraining:
    """What is trained on, and where from.

    Attributes:
        data: Folders of records; those that say so are kept out.
        out: Folder for weights, checkpoints and losses.
        options: How.
        validate: Folders of records that are all kept out.
        mix: Weights of sources, 1 of those not named.
        encoder: ImageNet's weights for the encoder, which is else drawn at random.
        init: Weights of a street network to start from.
        licence: Under which the weights may be used.
    """

    data: tuple[Path, ...]
    out: Path
    options: TrainingOptions
    validate: tuple[Path, ...] = ()
    mix: Mapping[str, float] = field(default_factory=dict[str, float])
    encoder: Path | None = None
    init: Path | None = None
    licence: str = "Apache-2.0"


def train_street(
    training: StreetTraining,
    *,
    device: torch.device,
    stop: Callable[[], bool] = lambda: False,
    progress: Progress = silent,
) -> dict[str, float] | None:
    """Train, or go on where the same training was stopped, and write the weights.

    Returns:
        Figures on what is kept out, or None where it was stopped before its end.
    """
    options = training.options
    taken, kept_out = _records(training)
    mixture = Mixture.of(taken, training.mix)
    network = _start(training)
    folders = (*training.data, *training.validate)
    data = {folder.resolve().name: sha256(folder / "records.jsonl") for folder in folders}
    if len(data) < len(folders):
        raise InputError("two folders of records have one name; expected different ones")
    start = {name: sha256(path) for name in ("encoder", "init") if (path := getattr(training, name))}

    def publish(steps: int, averaged: StreetNetwork, figures: Mapping[str, float]) -> None:
        said = Training(steps, options.seed, _program(), data | start, dict(figures), training.licence)
        write_network(averaged, said, training.out / WEIGHTS)

    return train(
        network,
        mixture,
        kept_out,
        training.out,
        options,
        data=data | start | {f"mix {name}": str(weight) for name, weight in sorted(training.mix.items())},
        device=device,
        publish=publish,
        stop=stop,
        progress=progress,
    )


def judge_weights(
    path: Path, data: tuple[Path, ...], validate: tuple[Path, ...], device: torch.device
) -> dict[str, float]:
    """Figures of a file of weights on what folders of records keep out, as a training is judged."""
    _, kept_out = split(read_entries(data), read_entries(validate))
    return judge(read_network(path)[0].to(device), kept_out)


def _records(training: StreetTraining) -> tuple[list[Entry], list[Entry]]:
    found, judged = read_entries(training.data), read_entries(training.validate)
    taken, kept_out = split(found, judged)
    if not taken:
        raise InputError("no record is left to train on; expected some that are not kept out")
    return taken, kept_out


def _start(training: StreetTraining) -> StreetNetwork:
    """The network before the first step."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(training.options.seed)
        network = StreetNetwork()
    if training.init is not None:
        if training.encoder is not None:
            raise InputError("--init holds an encoder, too; give --encoder or --init")
        return read_network(training.init)[0]
    if training.encoder is not None:
        network.encoder.load_state_dict(read_encoder(training.encoder))
    return network


def _program() -> str:
    """The commit that this program is of, or its version where it is no checkout."""
    command = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty", "--abbrev=40"]
    try:
        said = subprocess.run(command, capture_output=True, text=True, check=True, timeout=10)
    except (OSError, subprocess.SubprocessError):
        return f"dreamdrive {dreamdrive.__version__}"
    return said.stdout.strip()
