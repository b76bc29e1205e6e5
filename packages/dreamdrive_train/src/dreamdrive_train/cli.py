"""``dreamdrive train``: networks of our own."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import OmitArgPrefixes, OmitSubcommandPrefixes, UseAppendAction, arg

from dreamdrive.cli.terminal.arguments import DeviceFlag, commands_of
from dreamdrive.cli.terminal.console import plain
from dreamdrive.cli.terminal.machine import asked_to_stop, use_all_cores
from dreamdrive.cli.terminal.progress import Bars
from dreamdrive.errors import InputError
from dreamdrive.files.given import WANTED, check_there
from dreamdrive.names import DeviceName

if TYPE_CHECKING:
    from dreamdrive_train.pairs import PairTask, PairTraining, Source


def street(
    *,
    data: Annotated[UseAppendAction[tuple[Path, ...]], arg(metavar="DIR")],
    out: Annotated[Path, arg(aliases=["-o"], metavar="DIR")],
    steps: Annotated[int, arg(metavar="N")] = 20_000,
    seed: Annotated[int, arg(metavar="S")] = 0,
    encoder: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None,
    init: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None,
    validate: Annotated[UseAppendAction[tuple[Path, ...]], arg(metavar="DIR")] = (),
    mix: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="SOURCE=WEIGHT")] = (),
    batch: Annotated[int, arg(metavar="N")] = 8,
    rate: Annotated[float, arg(metavar="R")] = 2e-3,
    licence: Annotated[str, arg(metavar="TEXT")] = "Apache-2.0",
    device: DeviceFlag = "cpu",
) -> None:
    """Train the street network on folders of records.

    Args:
        data: Folder of records, see docs/guides/train.md.
        out: Folder for the weights, losses and checkpoints; the same command goes on from there.
        steps: Steps of the whole training.
        seed: Seed of everything random.
        encoder: Weights of EfficientNet-Lite0 from ImageNet to start the encoder from.
        init: Weights of a street network to start from.
        validate: Folder of records to judge by, beside those of --data that are kept out.
        mix: How often a source is drawn against the others, 1 where it is not named.
        batch: Pictures a step.
        rate: Largest step of the optimiser.
        licence: Under which the weights may be used; it is written into them.
        device: Where it is computed.
    """
    if not data:
        raise InputError("--data is missing; expected a folder with records.jsonl")
    if min(steps, batch) < 1 or seed < 0 or not 0 < rate < 1:
        raise InputError(
            f"--steps {steps} --batch {batch} --seed {seed} --rate {rate:g}: expected at least one step, one "
            "picture, a seed of 0 or more and a rate between 0 and 1"
        )
    weights = _weights(mix)
    for path in (*data, *validate):
        check_there(path, "a folder with records.jsonl")
    for path in (encoder, init):
        check_there(path, WANTED["weights"])
    use_all_cores()
    from dreamdrive.compute.device import computing_on
    from dreamdrive.run import only_run
    from dreamdrive_train.street_network import (
        WEIGHTS,
        LoaderOptions,
        StreetTraining,
        TrainingOptions,
        train_street as run,
    )

    options = TrainingOptions(steps=steps, seed=seed, rate=rate, loader=LoaderOptions(batch=batch))
    training = StreetTraining(data, out, options, validate, weights, encoder, init, licence)
    console = plain()
    with only_run(out), computing_on(device) as where, asked_to_stop() as stop, Bars(console) as bars:
        figures = run(
            training, device=where, stop=stop, progress=lambda done, total: bars("street", done, total)
        )
    if figures is None:
        stop.end()
        return
    console.print(f"{out / WEIGHTS}: {steps} steps")
    for name, value in figures.items():
        console.print(f"{name}: {value:.4g}")


def _weights(words: tuple[str, ...]) -> dict[str, float]:
    """Weights by their sources."""
    found: dict[str, float] = {}
    for word in words:
        source, _, weight = word.rpartition("=")
        try:
            found[source] = float(weight)
        except ValueError:
            found[source] = -1.0
        if not source or not 0 <= found[source] < float("inf"):
            raise InputError(f"--mix {word}: expected SOURCE=WEIGHT, such as drawn=2") from None
    return found


def photo(
    *,
    pictures: Annotated[UseAppendAction[tuple[Path, ...]], arg(metavar="DIR")] = (),
    streets: Annotated[int, arg(metavar="N")] = 0,
    out: Annotated[Path, arg(aliases=["-o"], metavar="DIR")],
    steps: Annotated[int, arg(metavar="N")] = 12_000,
    each: Annotated[int, arg(metavar="N")] = 4,
    seed: Annotated[int, arg(metavar="S")] = 0,
    batch: Annotated[int, arg(metavar="N")] = 4,
    rate: Annotated[float, arg(metavar="R")] = 4e-4,
    knowledge: Annotated[str, arg(metavar="street|FILE")] = "street",
    licence: Annotated[str, arg(metavar="TEXT")] = "Apache-2.0",
) -> None:
    """Train the network of the prior photo on folders of pictures and on drawn streets.

    Args:
        pictures: Folder of pictures of streets; those in folders below it count.
        streets: How many streets of the second edition are drawn.
        out: Folder for the pairs, weights, losses and checkpoint; the same command goes on from there.
        steps: Steps of the whole training.
        each: Pairs made of each picture and street.
        seed: Seed of everything random.
        batch: Pairs a step.
        rate: Largest step of the optimiser.
        knowledge: Weights of the street network that sees the pictures.
        licence: Under which the weights may be used; it is written into them.
    """
    _check(steps, batch, each, seed, rate)
    for path in pictures:
        check_there(path, "a folder of pictures of streets")
    use_all_cores()
    from dreamdrive.data.pictures.images import SUFFIXES
    from dreamdrive_train.pairs import PairTraining
    from dreamdrive_train.photo import FIRST_SEED, PHOTO, PairOptions, photo_pairs

    found = sorted(p for folder in pictures for p in folder.rglob("*") if p.suffix.lower() in SUFFIXES)
    if not found and (pictures or streets < 1):
        raise InputError(
            f"--pictures {' '.join(map(str, pictures))}: no pictures are there"
            if pictures
            else "nothing to train on; give --pictures DIR, --streets N or both"
        )
    sources = photo_pairs(found, range(FIRST_SEED, FIRST_SEED + streets), knowledge, PairOptions(each=each))
    options = PairTraining(steps=steps, seed=seed, rate=rate, batch=batch)
    _learn(PHOTO, sources, out, knowledge, options, licence, "cpu")


def restorer(
    *,
    drives: Annotated[UseAppendAction[tuple[Path, ...]], arg(metavar="VIDEO|DIR")] = (),
    streets: Annotated[int, arg(metavar="N")] = 0,
    out: Annotated[Path, arg(aliases=["-o"], metavar="DIR")],
    steps: Annotated[int, arg(metavar="N")] = 20_000,
    each: Annotated[int, arg(metavar="N")] = 16,
    seed: Annotated[int, arg(metavar="S")] = 0,
    batch: Annotated[int, arg(metavar="N")] = 4,
    rate: Annotated[float, arg(metavar="R")] = 4e-4,
    stlpips: Annotated[float, arg(metavar="W")] = 0.5,
    knowledge: Annotated[str, arg(metavar="street|FILE")] = "street",
    licence: Annotated[str, arg(metavar="TEXT")] = "Apache-2.0",
    device: DeviceFlag = "cpu",
) -> None:
    """Train the network that mends views from aside on drawn streets and on recorded drives.

    Args:
        drives: Video or folder of images of a drive; every second, fourth and eighth frame makes a scene.
        streets: How many streets of the second edition are drawn.
        out: Folder for the pairs, weights, losses and checkpoint; the same command goes on from there.
        steps: Steps of the whole training.
        each: Pairs made of each scene.
        seed: Seed of everything random.
        batch: Pairs a step.
        rate: Largest step of the optimiser.
        stlpips: Weight of a perceptual distance, which sharpens; more than 0 takes dreamdrive[metrics].
        knowledge: Weights of the street network that sees the frames.
        licence: Under which the weights may be used; it is written into them.
        device: Where the network is trained; scenes are made on the CPU.
    """
    _check(steps, batch, each, seed, rate)
    if not 0 <= stlpips < 100:
        raise InputError(f"--stlpips {stlpips:g}: expected a weight from 0 on, such as 0.5")
    for path in drives:
        check_there(path, "a video or a folder of images")
    if not drives and streets < 1:
        raise InputError("nothing to train on; give --drives VIDEO|DIR, --streets N or both")
    use_all_cores()
    from dreamdrive.evaluate.networks import stlpips as networks
    from dreamdrive_train.pairs import TRUNK, PairTraining
    from dreamdrive_train.restorer import FIRST_SEED, RESTORER, RestorerPairs, restorer_pairs

    if stlpips:
        networks.load_stlpips(TRUNK)  # before hours go into pairs
    seeds = range(FIRST_SEED, FIRST_SEED + streets)
    sources = restorer_pairs(drives, seeds, knowledge, RestorerPairs(each=each))
    options = PairTraining(steps=steps, seed=seed, rate=rate, batch=batch, stlpips=stlpips)
    _learn(RESTORER, sources, out, knowledge, options, licence, device)


def _check(steps: int, batch: int, each: int, seed: int, rate: float) -> None:
    if min(steps, batch, each) < 1 or seed < 0 or not 0 < rate < 1:
        raise InputError(
            f"--steps {steps} --batch {batch} --each {each} --seed {seed} --rate {rate:g}: expected at least "
            "one step, pair and picture, a seed of 0 or more and a rate between 0 and 1"
        )


def _learn(
    task: "PairTask",
    sources: "Mapping[str, Source]",
    out: Path,
    knowledge: str,
    options: "PairTraining",
    licence: str,
    device: DeviceName,
) -> None:
    """Make the pairs that are missing, and train on all."""
    from dreamdrive.compute.device import computing_on
    from dreamdrive.compute.machine import available_cores
    from dreamdrive.files.output import claim_folder
    from dreamdrive.run import only_run
    from dreamdrive_train.pairs import make_pairs, train_on_pairs

    console, name = plain(), Path(task.file).stem
    with only_run(out), computing_on(device) as where, asked_to_stop() as stop, Bars(console) as bars:
        claim_folder(out, "training")
        pairs = make_pairs(
            sources,
            out / "pairs",
            processes=available_cores(),
            stop=stop,
            progress=lambda done, total: bars("pairs", done, total),
        )
        learn = partial(train_on_pairs, licence=licence, device=where, stop=stop)
        learn = partial(learn, progress=lambda step, steps, _: bars(name, step, steps))
        weights = None if pairs is None else learn(task, pairs, out, knowledge, options)
    if weights is None or pairs is None:
        stop.end()
        return
    console.print(f"{weights}: {options.steps} steps on {len(pairs)} pairs")


_Train = commands_of({"street": street, "photo": photo, "restorer": restorer})


def train(what: Annotated[_Train, OmitSubcommandPrefixes, OmitArgPrefixes]) -> None:  # pyright: ignore[reportInvalidTypeForm]
    """Train networks of our own.

    Args:
        what: What to do.
    """
