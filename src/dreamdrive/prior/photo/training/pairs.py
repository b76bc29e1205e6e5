"""Pairs of a spoilt view and the picture it should be, from single pictures.

A picture in layers is drawn from some way behind and aside. What is seen there becomes layers in turn, and
from these the place of the picture is drawn: holes, stretched surfaces and torn edges as on a drive, and the
picture itself is the truth. No truth of depth is needed (as in AdaMPI: Han et al. 2022).
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from dreamdrive.data.photo import Photo, read_photo
from dreamdrive.errors import InputError
from dreamdrive.files.atomic import new_file
from dreamdrive.prior.photo.height import USUAL_M
from dreamdrive.prior.photo.layers import Layers, layers_of
from dreamdrive.prior.photo.make import seen_in
from dreamdrive.prior.photo.network import CHANNELS, Before, told
from dreamdrive.prior.photo.sight import places_in, sight_of
from dreamdrive.prior.photo.street import Street
from dreamdrive.prior.photo.way import level_axes
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street_class import StreetClass

PLANES = CHANNELS + 4
"""What a pair holds, in bytes: what the network is told, the truth, and 255 where that counts."""
LOW = np.array([0, 0, 0, 0, 0, -1, 0, 0, 0, 0, 0], np.float32)
HIGH = np.array([1, 1, 1, 1, 1, 3, 1, 1, 1, 1, 1], np.float32)
"""Range of each plane that the network is told."""


@dataclass(frozen=True)
class PairOptions:
    """From where pictures are looked at in between.

    Attributes:
        each: Pairs a picture.
        behind_m: Least and largest distance behind it.
        aside_m: Standard deviation of the distance aside.
        turned_rad: Standard deviation of the angle.
        before_m: Least and largest distance to the frame before.
        size: Of the pictures.
    """

    each: int = 4
    behind_m: tuple[float, float] = (1.0, 13.0)
    aside_m: float = 0.5
    turned_rad: float = 0.03
    before_m: tuple[float, float] = (0.2, 0.9)
    size: tuple[int, int] = (480, 270)


def make_pairs(
    pictures: Sequence[Path],
    folder: Path,
    knowledge: str,
    options: PairOptions = PairOptions(),
    *,
    processes: int = 2,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[Path]:
    """Write the pairs of pictures and return all files; those that are there are kept.

    Pictures in which no street is seen give none.
    """
    folder.mkdir(parents=True, exist_ok=True)
    left = [path for path in pictures if not (folder / f"{_name(path)}.done").exists()]
    with ProcessPoolExecutor(processes, get_context("spawn"), cv2.setNumThreads, (1,)) as pool:
        jobs = [pool.submit(_write, path, folder, knowledge, options) for path in left]
        for number, job in enumerate(as_completed(jobs)):
            job.result()
            progress(len(pictures) - len(left) + number + 1, len(pictures))
    return sorted(folder.glob("*.npy"))


def _name(path: Path) -> str:
    return f"{path.parent.name}-{path.stem}"


def _write(path: Path, folder: Path, knowledge: str, options: PairOptions) -> None:
    generator = np.random.default_rng([*_name(path).encode()])
    try:
        for number, planes in enumerate(
            pairs_of(read_photo(path, options.size), knowledge, options, generator)
        ):
            with new_file(folder / f"{_name(path)}-{number}.npy") as partial, partial.open("wb") as file:
                np.save(file, planes)
    except InputError:
        pass  # nothing solid in it
    (folder / f"{_name(path)}.done").touch()


def pairs_of(
    photo: Photo, knowledge: str, options: PairOptions, generator: np.random.Generator
) -> Iterator[UInt8[np.ndarray, "15 h w"]]:
    """Pairs of one picture, as planes of bytes."""
    street, _, _ = seen_in(photo, knowledge, height_m=USUAL_M)
    layers = layers_of(street)
    own = cv2.dilate((street.classes == StreetClass.OWN_CAR).astype(np.uint8), np.ones((7, 7))) > 0
    truth = np.concatenate([street.rgb.transpose(2, 0, 1), np.where(own, 0, 255).astype(np.uint8)[None]])
    for _ in range(options.each):
        away = _drawn_pose(street, options, generator)
        between = _seen_from(street, layers, street.camera.at(away))
        spoilt = layers_of(between)
        here = street.camera.at(np.linalg.inv(away))
        sight = sight_of(spoilt, here, between.ground)
        before = _before(street, layers, spoilt, between, away, options, generator)
        seen = told(sight, here, before)
        scaled = (seen - LOW[:, None, None]) / (HIGH - LOW)[:, None, None]
        yield np.concatenate([np.rint(np.clip(scaled, 0, 1) * 255).astype(np.uint8), truth])


def _drawn_pose(
    street: Street, options: PairOptions, generator: np.random.Generator
) -> Float[np.ndarray, "4 4"]:
    axes, pose = level_axes(street.ground), np.eye(4)
    back = np.exp(generator.uniform(*np.log(options.behind_m)))
    pose[:3, 3] = axes @ [generator.normal(0, options.aside_m), 0, -back]
    turn = generator.normal(0, options.turned_rad)
    level = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
    pose[:3, :3] = axes @ level @ axes.T
    return pose


def _seen_from(street: Street, layers: Layers, camera: Camera) -> Street:
    """What is seen from elsewhere, as a picture with depth of its own."""
    sight = sight_of(layers, camera, street.ground)
    at = places_in(street.camera, camera, sight.depth_m)
    u, v = at[..., 0] - 0.5, at[..., 1] - 0.5
    ground = street.ground.seen_from(camera.world_from_camera)
    known, plane = sight.depth_m > 0, ground.depth_m(street.camera)
    made_up = known & (sight.made_up > 0.5)
    flat = np.where(
        np.abs(sight.depth_m / np.minimum(plane, 1e6) - 1) < 0.05, StreetClass.ROAD, StreetClass.STRUCTURE
    )
    classes = cv2.remap(street.classes, u, v, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)
    classes = np.where(made_up, flat, classes)
    classes = np.where(known, classes, StreetClass.SKY).astype(np.uint8)
    users = cv2.remap(street.users, u, v, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=0)
    users = np.where(known & ~made_up, users, 0).astype(np.uint16)
    depth = np.where(sight.sky, 0, _closed(sight.depth_m))
    return Street(sight.rgb, street.camera, depth, classes, users, ground)


def _closed(depth: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "h w"]:
    """Where surfaces mix, the depth of the farther one beside it."""
    around = cv2.dilate(depth, np.ones((5, 5), np.uint8))
    return np.where(depth > 0, depth, around).astype(np.float32)


def _before(
    street: Street,
    layers: Layers,
    spoilt: Layers,
    between: Street,
    away: Float[np.ndarray, "4 4"],
    options: PairOptions,
    generator: np.random.Generator,
) -> Before | None:
    """The frame before: none, as it should be, as it was not mended at all, or half of both."""
    kind = int(generator.integers(4))
    if kind == 0:
        return None
    pose = np.eye(4)
    pose[:3, 3] = level_axes(street.ground) @ [0, 0, -generator.uniform(*options.before_m)]
    true = sight_of(layers, street.camera.at(pose), street.ground).rgb.astype(np.float32)
    camera = street.camera.at(np.linalg.inv(away) @ pose)
    bad = sight_of(spoilt, camera, between.ground).rgb.astype(np.float32)
    share = (0.0, 1.0, 0.0, 0.5)[kind] if kind != 2 else generator.uniform(0.6, 1.0)
    return Before(np.rint(share * true + (1 - share) * bad).astype(np.uint8), camera)
