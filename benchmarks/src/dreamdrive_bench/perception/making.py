"""Streets, scenes and sets of samples of the experiment; what is there already is kept."""

import shutil
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from dreamdrive.datasets.lidar_file import read_points
from dreamdrive.datasets.nuscenes import read_nuscenes
from dreamdrive.export import take, taken_of_world, write_nuscenes
from dreamdrive.options import QUALITIES
from dreamdrive.scene.control import Control
from dreamdrive.scene.street.log import Log
from dreamdrive.scene.street.truth import MOUNTS
from dreamdrive.stored import load_scene
from dreamdrive.tasks.perception import (
    BevSample,
    CvtOptions,
    PathOptions,
    SampleNote,
    draw_places,
    samples_of_log,
    samples_of_scene,
    span_of,
    write_bev_set,
)
from dreamdrive_bench.common.twin import TWIN
from dreamdrive_bench.perception.protocol import Places, Protocol
from dreamdrive_bench.perception.warped import warped_samples
from streetworld import StreetOptions, World, draw_street, drive

Listed = list[tuple[SampleNote, BevSample]]
"""Samples of a street."""


def make_street(seed: int, protocol: Protocol, places: Places) -> None:
    """Draw a street, record it with six noisy cameras, and label every half second."""
    folder, s = places.street(seed), protocol.streets
    if folder.is_dir():
        return
    layout = draw_street(seed, StreetOptions(s.seconds, edition=s.edition))
    world, frames = World(layout), round(s.seconds * s.rate_hz) + 1
    size, rng = (s.width_px, s.height_px), np.random.default_rng(seed)
    drives = {}
    for mount in MOUNTS:
        made = drive(layout, frames, s.rate_hz, size, world=world, mount=mount)
        noisy = made.frames + rng.normal(scale=s.noise_levels, size=made.frames.shape)
        drives[mount] = replace(made, frames=np.clip(np.rint(noisy), 0, 255).astype(np.uint8))
    with tempfile.TemporaryDirectory() as scratch:
        log = take(taken_of_world(drives, folder.name), Path(scratch))
        write_nuscenes([log], folder, read_points)


def make_scene(seed: int, protocol: Protocol, places: Places) -> None:
    """A 4D scene of all recorded pictures of a street; of its stages nothing is kept."""
    out = places.scene(seed)
    if (out / "report.json").is_file():
        return
    from dreamdrive.generate import generate  # reads videos, which a bare machine cannot

    size = protocol.streets.width_px, protocol.streets.height_px
    control = Control(path=places.street(seed), cameras="all", size=size)
    options = replace(QUALITIES[protocol.generated.quality], knowledge=TWIN)
    generate(control, out, options=options)
    shutil.rmtree(out / "stages", ignore_errors=True)
    shutil.rmtree(out / "video", ignore_errors=True)


def make_sets(
    protocol: Protocol,
    places: Places,
    network: CvtOptions,
    names: Sequence[str],
    *,
    each: Callable[[Callable[[int], Listed], Iterable[int]], Iterable[Listed]] = map,
    seen: Callable[[BevSample], BevSample] = lambda sample: sample,
) -> None:
    """Sets that arms are made of, or that networks are tested on; those that are there are kept.

    Args:
        protocol: Says which streets are in a set.
        places: Where streets, scenes and sets are.
        network: Says sizes.
        names: Sets that are made.
        each: Takes a function and seeds of streets as ``map`` does, perhaps in several processes.
        seen: What becomes of a sample before it is written.
    """
    for name, (seeds, of_street) in _sources(protocol, places, network).items():
        if name in names and not places.set(name).is_dir():
            samples = ((note, seen(sample)) for listed in each(of_street, seeds) for note, sample in listed)
            write_bev_set(samples, places.set(name), network.image, network.grid, count=1)
            print(f"set {name} is made", flush=True)


def _sources(
    protocol: Protocol, places: Places, network: CvtOptions
) -> dict[str, tuple[range, Callable[[int], Listed]]]:
    """Streets of each set, and what gives the samples of one."""
    s, real = protocol.streets, protocol.real
    training, validation = s.seeds("training"), s.seeds("validation")
    few = training[: real.streets]
    tested = validation[: protocol.generated.validation_streets]
    recorded = partial(_recorded, most=None, places=places, network=network)
    rendered, warped = (partial(make, protocol, places, network) for make in (_rendered, _warped))
    return {
        "validation": (validation, recorded),
        "real-all": (training, recorded),
        "real": (few, partial(recorded, most=real.key_frames)),
        "warped": (few, warped),
        "generated-of-real": (few, rendered),
        "generated-of-all": (training, rendered),
        "generated-validation": (tested, rendered),
    }


def log_of(seed: int, places: Places) -> Log:
    """A street as it was recorded."""
    return read_nuscenes(places.street(seed), places.street(seed).name)


def _path(protocol: Protocol) -> PathOptions:
    return PathOptions(aside_m=protocol.generated.aside_m, turned_deg=protocol.generated.turned_deg)


def _recorded(seed: int, most: int | None, places: Places, network: CvtOptions) -> Listed:
    return list(samples_of_log(log_of(seed, places), network.image, network.grid, most))


def _rendered(protocol: Protocol, places: Places, network: CvtOptions, seed: int) -> Listed:
    log, scene, path = log_of(seed, places), load_scene(places.scene(seed) / "scene"), _path(protocol)
    drawn, _ = draw_places(log, span_of(scene, log), protocol.generated.per_street, path, seed)
    made = samples_of_scene(scene, log, drawn, network.image, network.grid, path)
    return [each for each in made if not isinstance(each, str)]


def _warped(protocol: Protocol, places: Places, network: CvtOptions, seed: int) -> Listed:
    count, path = protocol.generated.per_street, _path(protocol)
    return list(warped_samples(log_of(seed, places), count, network.image, network.grid, path, seed))
