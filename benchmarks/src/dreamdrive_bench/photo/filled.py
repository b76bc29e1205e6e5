"""Views of a photo in layers in which something has to be filled, and how each way fills it."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, UInt8

from dreamdrive.prior.photo import (
    Before,
    Layers,
    PhotoNetwork,
    PhotoStreet,
    Sight,
    free_m,
    layers_of,
    mended,
    sight_of,
)
from dreamdrive.scene.street.truth import Semantic
from dreamdrive_bench.photo.cases import drawn, pandaset
from dreamdrive_train.photo import true_street

WAYS = ("network", "library", "none")
_PLACES_M = ((0.0, 3.0), (0.0, 6.0), (-1.0, 0.0), (1.0, 0.0), (-1.0, 5.0), (1.0, 5.0))
"""Metres aside and ahead."""
_BEFORE = 0.8
"""Share of the way to each place at which the frame before was drawn."""
_KEEP_M = 3.0
_LEAST = 0.01


@dataclass(frozen=True)
class Filled:
    """The truth, where it has to be filled, and the truth with each way's pixels there."""

    name: str
    truth: UInt8[np.ndarray, "h w 3"]
    region: Bool[np.ndarray, "h w"]
    pasted: dict[str, UInt8[np.ndarray, "h w 3"]]


def drawn_ones(seed: int, network: PhotoNetwork) -> Iterator[Filled]:
    """Views of a drawn street, whose depth is known."""
    case = drawn(seed)
    assert case.made is not None
    made = case.made
    street, camera = true_street(made), made.cameras[0]
    layers, room_m = layers_of(street), free_m(street) - _KEEP_M
    for aside_m, ahead_m in _PLACES_M:
        if ahead_m > room_m:
            continue
        pose = np.eye(4)
        pose[[0, 2], 3] = aside_m, ahead_m
        truth = made.views([camera.at(pose)], [0.0])[0]
        shown = truth.semantic != Semantic.OWN_CAR
        name = f"street {seed}, {aside_m:g} m aside, {ahead_m:g} m ahead"
        yield from _filled(name, layers, street, pose, truth.frame, shown, network)


def recorded_ones(network: PhotoNetwork) -> Iterator[Filled]:
    """Views of PandaSet 1 s later."""
    for case in pandaset():
        sight = next(each for each in case.sights if each.name == "1 s")
        everywhere = np.ones(sight.rgb.shape[:2], bool)
        layers, street = case.start.layers, case.start.street
        yield from _filled(case.name, layers, street, sight.pose, sight.rgb, everywhere, network)


def _filled(
    name: str,
    layers: Layers,
    street: PhotoStreet,
    pose: Float[np.ndarray, "4 4"],
    truth: UInt8[np.ndarray, "h w 3"],
    shown: Bool[np.ndarray, "h w"],
    network: PhotoNetwork,
) -> Iterator[Filled]:
    """One view, if there is enough to be filled in it."""
    sight, mended_rgb = _at_the_end(layers, street, pose, network)
    region = ((sight.made_up > 0.5) | sight.holes) & shown
    if region.mean() < _LEAST:
        return
    seen = (~layers.behind).nonzero()[:, 0]
    bare = replace(
        layers,
        gaussians=layers.gaussians.select(seen),
        behind=layers.behind[seen],
        carried_m=layers.carried_m[seen],
        moving=layers.moving[seen],
    )
    none = sight_of(bare, street.camera.at(pose), street.ground).rgb
    said = {"network": mended_rgb, "library": sight.filled, "none": none}
    pasted = {way: np.where(region[..., None], rgb, truth) for way, rgb in said.items()}
    yield Filled(name, truth, region, pasted)


def _at_the_end(
    layers: Layers, street: PhotoStreet, pose: Float[np.ndarray, "4 4"], network: PhotoNetwork
) -> tuple[Sight, UInt8[np.ndarray, "h w 3"]]:
    """The last view of a way, and what the network makes of it, told of the frame before."""
    there = np.eye(4)
    there[:3, 3] = _BEFORE * pose[:3, 3]
    cameras = street.camera.at(there), street.camera.at(pose)
    before, sight = (sight_of(layers, camera, street.ground) for camera in cameras)
    told_of = Before(before.filled, cameras[0])
    return sight, mended(network, sight, cameras[1], told_of)[0]
