"""Pairs of a spoilt view and the picture it should be, from single pictures and from drawn streets.

A street is driven into, and its truth is drawn. A picture in layers is drawn from some way behind and aside;
what is seen there becomes layers in turn, and from these the place of the picture is drawn: holes, stretched
surfaces and torn edges as on a drive, and the picture itself is the truth. No truth of depth is needed (as in
AdaMPI: Han et al. 2022).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from dreamdrive.data.photo import read_photo
from dreamdrive.prior.photo.fill import grown
from dreamdrive.prior.photo.height import USUAL_M
from dreamdrive.prior.photo.layers import Layers, layers_of
from dreamdrive.prior.photo.make import seen_in
from dreamdrive.prior.photo.network import Before, told
from dreamdrive.prior.photo.sight import places_in, sight_of
from dreamdrive.prior.photo.street import FAR_M, PhotoStreet
from dreamdrive.prior.photo.way import free_m, level_axes
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.geometry import Ground
from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive.scene.street.truth import DriveTruth, Semantic
from dreamdrive_train.pairs import PlaneRange, Source
from dreamdrive_train.street_network import CLASS_OF
from streetworld import make_street

RANGE = PlaneRange((0, 0, 0, 0, 0, -1, 0, 0, 0, 0, 0), (1, 1, 1, 1, 1, 3, 1, 1, 1, 1, 1))
FIRST_SEED = 1_200_000
"""Of the drawn streets: none of these is judged by."""
HEIGHTS_M = (1.2, 2.1)
"""Of the camera in drawn streets."""
_KEEP_M = 3.0
"""From what is in the way."""


@dataclass(frozen=True)
class PairOptions:
    """From where pictures are looked at in between.

    Attributes:
        each: Pairs a picture or street.
        way_m: Least and largest way that is driven.
        aside_m: Standard deviation of the distance aside.
        turned_rad: Standard deviation of the angle.
        before_m: Least and largest distance to the frame before.
        size: Of the pictures.
    """

    each: int = 4
    way_m: tuple[float, float] = (1.0, 13.0)
    aside_m: float = 0.5
    turned_rad: float = 0.03
    before_m: tuple[float, float] = (0.2, 0.9)
    size: tuple[int, int] = (480, 270)


def photo_pairs(
    pictures: Sequence[Path], seeds: Sequence[int], knowledge: str, options: PairOptions = PairOptions()
) -> dict[str, Source]:
    """The sources of pairs by their names: pictures and drawn streets.

    Pictures in which no street is seen give no pairs.
    """
    named = {f"{path.parent.name}-{path.stem}": path for path in pictures}
    return {
        name: partial(picture_pairs, path=path, knowledge=knowledge, options=options)
        for name, path in named.items()
    } | {f"street-{seed}": partial(street_pairs, seed=seed, options=options) for seed in seeds}


def picture_pairs(
    generator: np.random.Generator, path: Path, knowledge: str, options: PairOptions
) -> Iterator[UInt8[np.ndarray, "15 h w"]]:
    """Pairs of one picture, as planes of bytes."""
    photo = read_photo(path, options.size)
    street, _, _ = seen_in(photo, knowledge, height_m=USUAL_M)
    layers = layers_of(street)
    own = grown(street.classes == StreetClass.OWN_CAR, 7)
    for _ in range(options.each):
        away = _moved(street.ground, -_way_m(options, generator), options, generator)
        between = _seen_from(street, layers, street.camera.at(away))
        spoilt, towards = layers_of(between), np.linalg.inv(away)
        here = street.camera.at(towards)
        sight = sight_of(spoilt, here, between.ground)
        back = _stepped_back(street.ground, options, generator)
        earlier = street.camera.at(towards @ back)
        before = _before(
            sight_of(layers, street.camera.at(back), street.ground).rgb,
            sight_of(spoilt, earlier, between.ground).rgb,
            earlier,
            generator,
        )
        yield RANGE.packed(told(sight, here, before), street.rgb, ~own)


def street_pairs(
    generator: np.random.Generator, seed: int, options: PairOptions
) -> Iterator[UInt8[np.ndarray, "15 h w"]]:
    """Pairs of one street of the second edition: what is behind things is truly known there."""
    tall_m = float(generator.uniform(*HEIGHTS_M))
    made = make_street(seed, 1, 10.0, options.size, camera_height_m=tall_m, edition=2)
    street = true_street(made)
    layers, room_m = layers_of(street), max(free_m(street) - _KEEP_M, 0.0)
    for _ in range(options.each):
        ahead = min(_way_m(options, generator), room_m)
        pose = _moved(made.ground, ahead, options, generator)
        here = street.camera.at(pose)
        earlier = here.at(pose @ _stepped_back(made.ground, options, generator))
        truth, past = made.views([here, earlier], [0.0, 0.0])
        before = _before(past.frame, sight_of(layers, earlier, made.ground).rgb, earlier, generator)
        seen = told(sight_of(layers, here, made.ground), here, before)
        yield RANGE.packed(seen, truth.frame, truth.semantic != Semantic.OWN_CAR)


def true_street(made: DriveTruth) -> PhotoStreet:
    """The first frame of a drawn street, with its true depth, classes and road users."""
    classes, depth = CLASS_OF[made.semantic[0]], np.minimum(made.depth_m[0], FAR_M)
    depth[(classes == StreetClass.SKY) | (classes == StreetClass.OWN_CAR)] = 0
    road_users = made.instance[0].astype(np.uint16)
    return PhotoStreet(
        made.frames[0], made.cameras[0], depth.astype(np.float32), classes, road_users, made.ground
    )


def _way_m(options: PairOptions, generator: np.random.Generator) -> float:
    return float(np.exp(generator.uniform(*np.log(options.way_m))))


def _moved(
    ground: Ground, ahead_m: float, options: PairOptions, generator: np.random.Generator
) -> Float[np.ndarray, "4 4"]:
    """A pose so far ahead, a little aside and turned."""
    axes, pose = level_axes(ground), np.eye(4)
    pose[:3, 3] = axes @ [generator.normal(0, options.aside_m), 0, ahead_m]
    turn = generator.normal(0, options.turned_rad)
    level = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
    pose[:3, :3] = axes @ level @ axes.T
    return pose


def _stepped_back(
    ground: Ground, options: PairOptions, generator: np.random.Generator
) -> Float[np.ndarray, "4 4"]:
    pose = np.eye(4)
    pose[:3, 3] = level_axes(ground) @ [0, 0, -generator.uniform(*options.before_m)]
    return pose


def _seen_from(street: PhotoStreet, layers: Layers, camera: Camera) -> PhotoStreet:
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
    road_users = cv2.remap(
        street.road_users, u, v, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=0
    )
    road_users = np.where(known & ~made_up, road_users, 0).astype(np.uint16)
    depth = np.where(sight.sky, 0, _closed(sight.depth_m))
    return PhotoStreet(sight.rgb, street.camera, depth, classes, road_users, ground)


def _closed(depth: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "h w"]:
    """Where surfaces mix, the depth of the farther one beside it."""
    around = cv2.dilate(depth, np.ones((5, 5), np.uint8))
    return np.where(depth > 0, depth, around).astype(np.float32)


def _before(
    true: UInt8[np.ndarray, "h w 3"],
    bad: UInt8[np.ndarray, "h w 3"],
    camera: Camera,
    generator: np.random.Generator,
) -> Before | None:
    """The frame before: none, as it should be, as it was not mended at all, or some of both."""
    kind = int(generator.integers(4))
    if kind == 0:
        return None
    share = (0.0, 1.0, float(generator.uniform(0.6, 1.0)), 0.0)[kind]
    mixed = share * true.astype(np.float32) + (1 - share) * bad
    return Before(np.rint(mixed).astype(np.uint8), camera)
