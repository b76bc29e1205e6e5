"""Training pictures of drawn streets: the second edition, seen from many places, with exact truth."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import msgspec
import numpy as np

from dreamdrive.compute.machine import workers
from dreamdrive.data.pictures.picture_file import write_picture
from dreamdrive.files.output import new_folder
from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive.scene.street.truth import Semantic
from dreamdrive_train.street_network.data.records import Record, depth_steps, read_records, write_records
from dreamdrive_train.street_network.data.viewpoints import Viewpoint, Viewpoints
from streetworld import StreetOptions, World, WorldView, draw_street, picture_of
from streetworld.edition2.layouts.held_back import FIRST_TRAINING_SEED, Looks
from streetworld.edition2.layouts.weather import draw_light
from streetworld.edition2.light.photograph import photograph
from streetworld.edition2.light.textures import TextureLibrary
from streetworld.engine.lens import bent

EDITION = 2
_AFTER_S = 1.0
_MARK = "records.jsonl"
_FAST = 3  # of the compression of a PNG
_STREET_CLASS = {
    Semantic.SKY: StreetClass.SKY,
    Semantic.ROAD: StreetClass.ROAD,
    Semantic.MARKING: StreetClass.MARKING,
    Semantic.SIDEWALK: StreetClass.GROUND,
    Semantic.GRASS: StreetClass.GROUND,
    Semantic.BUILDING: StreetClass.STRUCTURE,
    Semantic.WALL: StreetClass.STRUCTURE,
    Semantic.VEGETATION: StreetClass.VEGETATION,
    Semantic.POLE: StreetClass.POLE,
    Semantic.SIGN: StreetClass.POLE,
    Semantic.CAR: StreetClass.VEHICLE,
    Semantic.VAN: StreetClass.VEHICLE,
    Semantic.TRUCK: StreetClass.VEHICLE,
    Semantic.BUS: StreetClass.VEHICLE,
    Semantic.BICYCLE: StreetClass.TWO_WHEELER,
    Semantic.MOTORCYCLE: StreetClass.TWO_WHEELER,
    Semantic.PEDESTRIAN: StreetClass.PERSON,
    Semantic.OWN_CAR: StreetClass.OWN_CAR,
}
CLASS_OF = np.array([_STREET_CLASS[kind] for kind in Semantic], dtype=np.uint8)
"""The network's class of each class of a drawn street."""


@dataclass(frozen=True)
class DrawnOptions:
    """How many pictures are drawn of a street.

    At each of some ``moments`` within ``seconds`` there are ``views``, every second moment in a light of its
    own: to build a street costs as much as several pictures, to move its traffic as much as one. JPEG quality
    is drawn from a range.
    """

    moments: int = 4
    views: int = 3
    seconds: float = 5.0
    quality: tuple[int, int] = (60, 95)


def draw_records(
    seeds: Sequence[int],
    folder: Path,
    options: DrawnOptions = DrawnOptions(),
    *,
    textures: Path | None = None,
    processes: int = 2,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[Record]:
    """Write the records of some streets and return them all; streets that are written already are kept.

    Each street has a folder of its name with its own ``records.jsonl``; that of the whole folder joins them.
    Streets of seeds below a million show only looks that are kept out of training. ``textures`` is a
    folder of pictures of surfaces, with which the painted ones are mixed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    left = [seed for seed in seeds if not (folder / str(seed) / _MARK).is_file()]
    progress(len(seeds) - len(left), len(seeds))
    for number, _ in enumerate(_drawn(left, folder, options, textures, processes)):
        progress(len(seeds) - len(left) + number + 1, len(seeds))
    joined = [record for seed in seeds for record in _within(folder, str(seed))]
    write_records(joined, folder)
    return joined


def _drawn(
    seeds: list[int], folder: Path, options: DrawnOptions, textures: Path | None, processes: int
) -> Iterator[None]:
    if processes < 2 or len(seeds) < 2:
        for seed in seeds:
            yield draw_street_records(seed, folder / str(seed), options, textures)
        return
    with workers(processes) as pool:
        jobs = [
            pool.submit(draw_street_records, seed, folder / str(seed), options, textures) for seed in seeds
        ]
        for job in as_completed(jobs):
            yield job.result()


def _within(folder: Path, name: str) -> Iterator[Record]:
    for record in read_records(folder / name):
        paths = {key: f"{name}/{getattr(record, key)}" for key in ("image", "labels", "depth")}
        yield msgspec.structs.replace(record, **paths)


@lru_cache(1)
def _library(folder: Path | None) -> TextureLibrary | None:
    return None if folder is None else TextureLibrary.read(folder)


def draw_street_records(
    seed: int, folder: Path, options: DrawnOptions = DrawnOptions(), textures: Path | None = None
) -> None:
    """Write the pictures and records of one street; the folder appears whole or not at all."""
    rng = np.random.default_rng([seed, 30])
    layout = draw_street(seed, StreetOptions(options.seconds + _AFTER_S, edition=EDITION))
    world = World(layout, _library(textures))
    looks = Looks(rng, kept_out=seed < FIRST_TRAINING_SEED)
    places = Viewpoints(world, rng, looks, options.seconds)
    light, records = layout.light, list[Record]()
    with new_folder(folder, replace=True, kind="drawn street to learn from") as made:
        for moment in range(options.moments):
            if moment:
                places.move_on()
            if moment % 2:
                # Snow lies on the painted ground and stays.
                light = msgspec.structs.replace(draw_light(rng), snow=layout.light.snow)
            for _ in range(options.views):
                at = places.draw()
                seen = world.changed(light, at.lens, at.ego)
                view = picture_of(seen, places.moment, at.camera, (at.time_s, at.camera))
                view = replace(view, frame=photograph(view.frame, int(rng.integers(2**31))))
                quality = int(rng.integers(options.quality[0], options.quality[1] + 1))
                records.append(_write(view, at, made, f"{len(records):02d}", f"street-{seed}", quality))
        write_records(records, made)


def _write(view: WorldView, at: Viewpoint, folder: Path, name: str, group: str, quality: int) -> Record:
    classes = CLASS_OF[view.semantic]
    labels = np.stack([np.zeros_like(classes), view.instance.astype(np.uint8), classes], axis=-1)
    hidden = (view.semantic == Semantic.OWN_CAR) | (view.semantic == Semantic.SKY)
    depth = depth_steps(np.where(hidden, 0, view.depth_m))
    write_picture(folder / f"{name}.jpg", view.frame[..., ::-1], quality=quality)
    write_picture(folder / f"{name}-labels.png", labels, compression=_FAST)
    write_picture(folder / f"{name}-depth.png", depth, compression=_FAST)
    horizon_px, roll_rad = horizon_of(at)
    return Record(
        image=f"{name}.jpg",
        source="drawn",
        group=group,
        labels=f"{name}-labels.png",
        depth=f"{name}-depth.png",
        focal_px=round(float(at.camera.fx_px), 3),
        horizon_px=round(horizon_px, 3),
        roll_rad=round(roll_rad, 5),
        camera_height_m=round(at.ego.camera_height_m, 4),
        distorted=at.lens.distortion != 0,
        metric=True,
        kept_out=int(group.removeprefix("street-")) < FIRST_TRAINING_SEED,
    )


def horizon_of(at: Viewpoint) -> tuple[float, float]:
    """Row at which level rays cross the middle column, from the middle downwards, and roll in radians."""
    up = at.camera.world_from_camera[2, :3]  # the map's vertical in the camera
    level = np.array([[0.0, -up[2] / up[1]]])
    return float(at.camera.fy_px * bent(level, at.lens.distortion)[0, 1]), float(np.arctan2(-up[0], -up[1]))
