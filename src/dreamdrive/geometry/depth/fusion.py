"""Fusion of depth: stereo, the road, contact with it, and the street network."""

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Integer

from dreamdrive.geometry.depth.contact import on_the_road
from dreamdrive.geometry.depth.view import PosedFrames, by_frame
from dreamdrive.geometry.options import FusionOptions
from dreamdrive.geometry.road import scale
from dreamdrive.scene.street.look import Look
from dreamdrive.scene.street.street_class import FLAT, ROAD_USERS, StreetClass

PAVED = (StreetClass.ROAD, StreetClass.MARKING)
_NEAREST_M, _FARTHEST_M = 0.5, 500.0
_FAR_INVERSE = 1 / 150  # 1/m; farther away stereo anchors nothing
_ROAD_INVERSE = 1 / 150
_FEW = 50  # sure pixels, from which on the network can be aligned
_ODD = 1.0  # of log depth: a pixel that far from all others anchors nothing
_COARSE = 0.12  # of the image width
_TRUSTED = 0.03  # spread of a depth that is as good as sure stereo
_PRIOR = 0.03  # weight of the coarser ratio against that of sure pixels


@dataclass(frozen=True)
class NetworkDepth:
    """What the street network says of one frame; depth along z in any unit, 0 where there is none."""

    depth: Float[np.ndarray, "h w"]
    spread: Float[np.ndarray, "h w"]
    classes: Integer[np.ndarray, "h w"]
    instances: Integer[np.ndarray, "h w"]

    @property
    def road_users(self) -> Bool[np.ndarray, "h w"]:
        """Pixels of road users."""
        return (self.instances > 0) | np.isin(self.classes, ROAD_USERS)

    def is_vehicle(self) -> Bool[np.ndarray, " n"]:
        """Whether most pixels of each label, 0 included, are a vehicle's."""
        labels = self.instances.ravel().astype(np.intp)
        of_vehicle = (self.classes == StreetClass.VEHICLE).ravel()
        return 2 * np.bincount(labels, weights=of_vehicle) > np.bincount(labels)


@dataclass(frozen=True)
class Fused:
    """Inverse depth in 1/m, 0 where there is none; trust in [0, 1]; the depth's relative spread, 0 there."""

    inverse: Float[np.ndarray, "*f h w"]
    confidence: Float[np.ndarray, "*f h w"]
    spread: Float[np.ndarray, "*f h w"]


def fused(
    view: PosedFrames,
    look: Look,
    inverse: Float[np.ndarray, "f h w"],
    confidence: Float[np.ndarray, "f h w"],
    tilt_rad: float = 0.0,
) -> Fused:
    """The depth of every used frame.

    Inverse depth and confidence are those of stereo or of a network that measures; 0 where there is none.
    ``tilt_rad`` is the standard deviation of the tilt of the road's plane.
    """
    height_m = scale.USUAL_HEIGHT_M if view.ground is None else view.ground.offset_m

    def one(frame: int) -> Fused:
        return fuse(
            NetworkDepth(
                look.depth[frame] * np.float32(height_m),
                look.spread[frame],
                look.classes[frame],
                look.instances[frame],
            ),
            inverse[frame],
            confidence[frame],
            RoadDepth(view.plane_inverse[frame], tilt_rad / height_m, height_m),
            view.usable[frame],
            view.options.fusion,
        )

    return _of_frames(by_frame(view, one), len(inverse))


def with_stereo(
    view: PosedFrames,
    found: Fused,
    standing: Bool[np.ndarray, "f h w"],
    swept_inverse: Float[np.ndarray, "f h w"],
    confidence: Float[np.ndarray, "f h w"],
) -> Fused:
    """The depth of every used frame, with stereo where it is sure of standing road users, near their contact.

    What lies between such pixels follows them: a car has no steps.
    """
    options = view.options.fusion

    def one(frame: int) -> Fused:
        inverse, sure, stands = found.inverse[frame], confidence[frame], standing[frame]
        off = _log_depth(swept_inverse[frame]) - _log_depth(inverse)
        near = stands & (inverse > 0) & (sure >= options.sure) & (np.abs(off) < options.user_stereo)
        off = np.where(near, off, 0)
        follow = _carried(off, sure * near, np.zeros_like(off), options.user_reach * off.shape[1])
        return Fused(
            inverse * np.exp(-np.where(near, off, follow * stands)),
            np.where(near, sure, found.confidence[frame]),
            np.where(near, np.float32(options.user_spread), found.spread[frame]),
        )

    return _of_frames(by_frame(view, one), len(found.inverse))


def _of_frames(found: Mapping[int, Fused], count: int) -> Fused:
    """The maps of all frames; 0 in those that are not used."""
    shape = count, *next(iter(found.values())).inverse.shape
    depth, trust, spread = (np.zeros(shape, np.float32) for _ in range(3))
    for frame, each in found.items():
        depth[frame], trust[frame], spread[frame] = each.inverse, each.confidence, each.spread
    return Fused(depth, trust, spread)


@dataclass(frozen=True)
class RoadDepth:
    """The road's plane in one frame: inverse depth in 1/m, and its relative spread a metre of depth.

    The camera is ``height_m`` above it.
    """

    inverse: Float[np.ndarray, "h w"]
    spread_per_m: float = 0.0
    height_m: float = scale.USUAL_HEIGHT_M

    @property
    def spread(self) -> Float[np.ndarray, "h w"]:
        """Relative spread of the depth that comes from the tilt."""
        return self.spread_per_m / np.maximum(self.inverse, 1e-4)


def fuse(
    seen: NetworkDepth,
    swept_inverse: Float[np.ndarray, "h w"],
    confidence: Float[np.ndarray, "h w"],
    plane: RoadDepth,
    usable: Bool[np.ndarray, "h w"],
    options: FusionOptions,
) -> Fused:
    """Depth of one frame.

    The network's depth is aligned to sure stereo and to the road, region by region. Stereo counts where it
    is sure, or less sure and near the aligned depth; the road has the depth of its plane; a road user that of
    its contact with the road, or the aligned depth where its foot is hidden.
    """
    road_users = seen.road_users & usable
    shown = usable & (seen.classes != StreetClass.SKY) & (seen.depth > 0)
    road = np.isin(seen.classes, PAVED) & (plane.inverse > _ROAD_INVERSE) & usable
    swept, level = _log_depth(swept_inverse), _log_depth(plane.inverse)
    level_spread = np.hypot(options.stereo_spread, plane.spread)
    sure = np.where(
        shown & ~road_users & (swept_inverse > _FAR_INVERSE) & (confidence >= options.sure), confidence, 0
    )
    believable = 0.5 * (options.stereo_spread / level_spread) ** 2
    weight = np.where(road & (sure == 0), believable, sure).astype(np.float32)
    known = np.where(sure > 0, swept, level)
    network = np.log(np.clip(seen.depth, 1e-3, 1e6)).astype(np.float32)
    aligned, spread = _align(network, seen, known, weight, road_users, options)
    off = np.abs(swept - aligned)
    stereo = shown & ~road_users & (swept_inverse > 1 / _FARTHEST_M)
    believed = (confidence >= options.sure) & (off < options.sure_spreads * spread + 0.1)
    believed |= (confidence >= options.hinted) & (off < options.hinted_spreads * spread)
    # Of what is far the network knows only that it is far; its parallax tells how far.
    far = (
        shown
        & ~road_users
        & (confidence >= options.sure)
        & (aligned > np.log(options.far_m))
        & (swept > aligned)
    )
    stereo = stereo & believed | shown & ~road_users & far
    log_depth = np.where(stereo, swept, aligned)
    spread = np.where(stereo, options.stereo_spread, spread)
    flat = road & ~stereo & (level_spread < spread)
    log_depth[flat], spread[flat] = level[flat], level_spread[flat]
    ground = np.isin(seen.classes, FLAT)
    contact = on_the_road(seen.instances, ground, plane.inverse, plane.height_m, seen.is_vehicle(), options)
    contact_spread = np.hypot(contact.spread, plane.spread_per_m / np.maximum(contact.inverse, 1e-4))
    standing = (contact.inverse > 0) & shown & ((plane.spread_per_m == 0) | (contact_spread < spread))
    log_depth[standing], spread[standing] = _log_depth(contact.inverse)[standing], contact_spread[standing]
    thin = np.isin(seen.classes, (StreetClass.PERSON, StreetClass.TWO_WHEELER))
    spread[thin] = np.maximum(spread[thin], options.thin_spread)
    depth = np.clip(np.exp(log_depth), _NEAREST_M, _FARTHEST_M)
    trust = np.where(stereo, confidence, np.clip(_TRUSTED / spread, 0, 1))
    maps = (np.where(shown, each, 0).astype(np.float32) for each in (1 / depth, trust, spread))
    return Fused(*maps)


def _log_depth(inverse: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "h w"]:
    return -np.log(np.maximum(inverse, 1e-4)).astype(np.float32)


def _align(
    network: Float[np.ndarray, "h w"],
    seen: NetworkDepth,
    known: Float[np.ndarray, "h w"],
    weight: Float[np.ndarray, "h w"],
    road_users: Bool[np.ndarray, "h w"],
    options: FusionOptions,
) -> tuple[Float[np.ndarray, "h w"], Float[np.ndarray, "h w"]]:
    """The network's log depth in the unit of what is known, and its spread.

    The ratio of both is carried from sure pixels to their surroundings: coarsely by all, then among pixels of
    the ground and among those of what stands on it. Without enough of them the network's own unit is kept.
    """
    width = network.shape[1]
    anchors = weight > 0
    own = np.maximum(seen.spread, options.least_spread)
    if anchors.sum() < _FEW:
        return network, own
    ratio = np.where(anchors, known - network, 0).astype(np.float32)
    middle = _median(ratio[anchors], weight[anchors])
    weight = np.where(np.abs(ratio - middle) < _ODD, weight, 0).astype(np.float32)
    ratio = np.where(weight > 0, ratio, 0)
    coarse = _carried(ratio, weight, np.full_like(ratio, middle), _COARSE * width)
    shift, spread = coarse.copy(), own.copy()
    reach = options.reach * width
    ground = np.isin(seen.classes, FLAT)
    for region in (ground, ~ground & ~road_users):
        inside = weight * region
        fine = _carried(ratio, inside, coarse, reach)
        # How well the network follows the sure pixels nearby, as far as there are any.
        missed = _carried((ratio - fine) ** 2, inside, own**2, reach)
        shift[region], spread[region] = fine[region], np.sqrt(missed)[region]
    return network + shift, np.maximum(spread, options.least_spread)


def _carried(
    values: Float[np.ndarray, "h w"],
    weight: Float[np.ndarray, "h w"],
    prior: Float[np.ndarray, "h w"],
    reach_px: float,
) -> Float[np.ndarray, "h w"]:
    """Weighted means of values around each pixel, which become the prior where there are none."""
    total = cv2.GaussianBlur(weight * values, (0, 0), reach_px) + _PRIOR * prior
    return np.asarray(total / (cv2.GaussianBlur(weight, (0, 0), reach_px) + _PRIOR))


def _median(values: Float[np.ndarray, " n"], weight: Float[np.ndarray, " n"]) -> float:
    order = np.argsort(values)
    total = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(total, total[-1] / 2)])
