"""Motion decided for whole road users, over all the frames that show them."""

from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt16

from dreamdrive.geometry.depth import PosedFrames
from dreamdrive.geometry.moving.evidence import FLAGGED
from dreamdrive.geometry.moving.flow import PairFlow
from dreamdrive.geometry.moving.following import Sighting, follow
from dreamdrive.geometry.moving.riders import with_riders
from dreamdrive.geometry.options import RoadUserOptions
from dreamdrive.scene.camera import NEAR_M
from dreamdrive.scene.street.look import Look

_MOST_COUNTED_PX = 2000  # in one frame: a near view does not outvote many far ones
_LEAST_SIGHTINGS = 3  # that tell whether it keeps its place
_FARTHEST_INVERSE = 1 / 60  # 1/m; farther away contact with the road tells too little


def too_near(
    inverse: Float[np.ndarray, "f h w"],
    stereo: Float[np.ndarray, "f h w"],
    confidence: Float[np.ndarray, "f h w"],
    options: RoadUserOptions,
) -> Bool[np.ndarray, "f h w"]:
    """Pixels that stereo puts nearer than where their road user touches the road: oncoming traffic's.

    What stands has one distance. What comes agrees with stereo, too, but at another one: at half of it if it
    is as fast as the camera. Inverse depths in 1/m are those of fusion and of stereo, with stereo's trust.
    """
    nearer = stereo > inverse * np.float32(np.exp(options.nearer))
    return nearer & (inverse > _FARTHEST_INVERSE) & (confidence >= options.sure_stereo)


def whole_road_users(
    view: PosedFrames,
    look: Look,
    flows: Mapping[int, Sequence[PairFlow]],
    evidence: Float[np.ndarray, "f h w"],
    nearer: Bool[np.ndarray, "f h w"],
    inverse: Float[np.ndarray, "f h w"],
) -> tuple[Float[np.ndarray, "f h w"], UInt16[np.ndarray, "f h w"]]:
    """Evidence of motion in [0, 1] with each road user moving as a whole, in all its frames, or not at all.

    With it the number of the road user of each pixel, from 1, the same in all frames.

    A road user moves if enough of its pixels are flagged or nearer than they can be if it stands; less is
    enough if its distances (inverse depth in 1/m) belong to no one place. Who sits on a two-wheeler is one
    with it, and rides: at the camera's own speed neither flow nor distance tells. What surely is no road user
    does not move.
    """
    options = view.options.users
    look, ridden = with_riders(look, view.frames)
    whole, road_users = evidence.copy(), np.zeros(evidence.shape, np.uint16)
    for frame in view.frames:
        street = (look.instances[frame] == 0) & (look.confidence[frame] >= options.sure)
        whole[frame][street] = np.minimum(whole[frame][street], 0.9 * FLAGGED)
    followed = follow(view, look, flows, (evidence >= FLAGGED) | nearer)
    tracks = [part for track in followed for part in _unbroken(look, inverse, track, options.leap)]
    for number, track in enumerate(tracks, start=1):
        moves = _rides(look, ridden, track) or _moves(view, look, inverse, track, options)
        for seen in track:
            own = look.instances[seen.frame] == seen.label
            road_users[seen.frame][own] = number
            part = whole[seen.frame]
            part[own] = 1 if moves else np.minimum(part[own], 0.9 * FLAGGED)
    for frame in view.frames:
        thin = _thin((whole[frame] >= FLAGGED) & (road_users[frame] == 0), options.rim)
        whole[frame][thin] = np.minimum(whole[frame][thin], 0.9 * FLAGGED)
    return whole, road_users


def _thin(flagged: Bool[np.ndarray, "h w"], rim: float) -> Bool[np.ndarray, "h w"]:
    """Regions nowhere thicker than twice ``rim``, a share of the width: rims of road users, not these."""
    inside = flagged.astype(np.uint8)
    count, found = cv2.connectedComponents(inside)
    labels, depth = np.asarray(found, np.intp), np.asarray(cv2.distanceTransform(inside, cv2.DIST_L2, 3))
    deepest = np.zeros(count, np.float32)
    np.maximum.at(deepest, labels.ravel(), depth.ravel())
    return flagged & (deepest[labels] < rim * flagged.shape[1])


def _moves(
    view: PosedFrames,
    look: Look,
    inverse: Float[np.ndarray, "f h w"],
    track: Sequence[Sighting],
    options: RoadUserOptions,
) -> bool:
    share = telling_share(track)
    if share > options.moving_share:
        return True
    return share > options.doubtful_share and off_place(view, look, inverse, track) > options.off_place


def _unbroken(
    look: Look, inverse: Float[np.ndarray, "f h w"], track: Sequence[Sighting], leap: float
) -> list[list[Sighting]]:
    """The parts of a track between leaps away: where a parked car has left the picture comes the next one."""
    parts: list[list[Sighting]] = []
    before_m = 0.0
    for seen in track:
        depth_m = float(_seen_at(look, inverse, seen)[2])
        if not parts or (before_m < 1 / _FARTHEST_INVERSE and depth_m > before_m * np.exp(leap)):
            parts.append([])
        parts[-1].append(seen)
        before_m = depth_m
    return parts


def _rides(look: Look, ridden: Bool[np.ndarray, "f h w"], track: Sequence[Sighting]) -> bool:
    """Whether most sightings are of a two-wheeler and its rider."""
    both = [bool(ridden[seen.frame][look.instances[seen.frame] == seen.label].any()) for seen in track]
    return sum(both) > 0.5 * len(both)


def telling_share(track: Sequence[Sighting]) -> float:
    """Share of the pixels of a road user that was followed which tell that it moves."""
    counted = np.array([min(seen.pixels, _MOST_COUNTED_PX) for seen in track], np.float64)
    return float(counted @ [seen.telling / seen.pixels for seen in track] / counted.sum())


def off_place(
    view: PosedFrames, look: Look, inverse: Float[np.ndarray, "f h w"], track: Sequence[Sighting]
) -> float:
    """By how much the distances of a road user are wrong if it stands: a median of logarithms of ratios.

    It is that of the place which explains most, among those where single frames see it. What drives beside
    the camera at its speed shows no flow at all, but neither does it come nearer. 0 where fewer than three
    frames see it.
    """
    seen = [(each, _seen_at(look, inverse, each)) for each in track]
    near = [(each, place) for each, place in seen if place[2] < 1 / _FARTHEST_INVERSE]
    if len(near) < _LEAST_SIGHTINGS:
        return 0.0
    cameras = [view.cameras[each.frame] for each, _ in near]
    weight = np.array([min(each.pixels, _MOST_COUNTED_PX) for each, _ in near], np.float64)
    depth_m = np.array([place[2] for _, place in near])
    places = np.stack([c.lift(place[None])[0] for c, (_, place) in zip(cameras, near, strict=True)])
    there_m = np.stack([camera.project(places)[:, 2] for camera in cameras], axis=1)
    wrong = np.abs(np.log(np.maximum(there_m, NEAR_M) / depth_m))
    order = np.argsort(wrong, axis=1)
    below = np.cumsum(weight[order], axis=1) >= 0.5 * weight.sum()
    medians = np.take_along_axis(wrong, order, axis=1)[np.arange(len(wrong)), below.argmax(axis=1)]
    return float(medians.min())


def _seen_at(look: Look, inverse: Float[np.ndarray, "f h w"], seen: Sighting) -> Float[np.ndarray, "3"]:
    """The middle of a sighting: column, row, depth."""
    rows, columns = np.nonzero(look.instances[seen.frame] == seen.label)
    depth_m = 1 / max(float(np.median(inverse[seen.frame][rows, columns])), 1e-6)
    return np.array([np.median(columns) + 0.5, np.median(rows) + 0.5, depth_m])
