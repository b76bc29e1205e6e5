"""What moves are whole road users, over all the frames that show them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Integer, UInt16

from dreamdrive.geometry.depth import View
from dreamdrive.geometry.moving.evidence import FLAGGED
from dreamdrive.geometry.moving.flow import PairFlow
from dreamdrive.geometry.options import UserOptions
from dreamdrive.scene.camera import NEAR_M
from dreamdrive.scene.look import Look
from dreamdrive.scene.street_class import StreetClass

_LEAST_PX = 12  # of a road user that is followed
_MOST_COUNTED_PX = 2000  # in one frame: a near view does not outvote many far ones
_LEAST_SIGHTINGS = 3  # that tell whether it keeps its place
_FARTHEST_INVERSE = 1 / 60  # 1/m; farther away contact with the road tells too little


@dataclass(frozen=True)
class Sighting:
    """A road user in one frame: its pixels, and how many of them tell that it moves."""

    frame: int
    label: int
    pixels: int
    telling: int


def too_near(
    inverse: Float[np.ndarray, "f h w"],
    stereo: Float[np.ndarray, "f h w"],
    confidence: Float[np.ndarray, "f h w"],
    options: UserOptions,
) -> Bool[np.ndarray, "f h w"]:
    """Pixels that stereo puts nearer than where their road user touches the road: oncoming traffic's.

    What stands has one distance. What comes agrees with stereo, too, but at another one: at half of it if it
    is as fast as the camera. Inverse depths in 1/m are those of fusion and of stereo, with stereo's trust.
    """
    nearer = stereo > inverse * np.float32(np.exp(options.nearer))
    return nearer & (inverse > _FARTHEST_INVERSE) & (confidence >= options.sure_stereo)


def whole_users(
    view: View,
    look: Look,
    flows: Mapping[int, Sequence[PairFlow]],
    evidence: Float[np.ndarray, "f h w"],
    nearer: Bool[np.ndarray, "f h w"],
    inverse: Float[np.ndarray, "f h w"],
) -> tuple[Float[np.ndarray, "f h w"], UInt16[np.ndarray, "f h w"]]:
    """Evidence of motion in [0, 1] with each road user moving as a whole, in all its frames, or not at all.

    With it the number of the road user of each pixel, from 1, the same in all frames.

    A road user moves if enough of its pixels are flagged or nearer than they can be if it stands; less is
    enough if its distances (inverse depth in 1/m) belong to no one place. What surely is no road user does
    not move.
    """
    options = view.options.users
    whole, users = evidence.copy(), np.zeros(evidence.shape, np.uint16)
    for frame in view.frames:
        street = (look.instances[frame] == 0) & (look.confidence[frame] >= options.sure)
        whole[frame][street] = np.minimum(whole[frame][street], 0.9 * FLAGGED)
    tracks = follow(view, look, flows, (evidence >= FLAGGED) | nearer)
    for number, track in enumerate(tracks, start=1):
        moves = _moves(view, look, inverse, track, options)
        for seen in track:
            own = look.instances[seen.frame] == seen.label
            users[seen.frame][own] = number
            part = whole[seen.frame]
            part[own] = 1 if moves else np.minimum(part[own], 0.9 * FLAGGED)
    for frame in view.frames:
        thin = _thin((whole[frame] >= FLAGGED) & (users[frame] == 0), options.rim)
        whole[frame][thin] = np.minimum(whole[frame][thin], 0.9 * FLAGGED)
    return whole, users


def _thin(flagged: Bool[np.ndarray, "h w"], rim: float) -> Bool[np.ndarray, "h w"]:
    """Regions nowhere thicker than twice ``rim``, a share of the width: the rims of users, not users."""
    inside = flagged.astype(np.uint8)
    count, found = cv2.connectedComponents(inside)
    labels, depth = np.asarray(found, np.intp), np.asarray(cv2.distanceTransform(inside, cv2.DIST_L2, 3))
    deepest = np.zeros(count, np.float32)
    np.maximum.at(deepest, labels.ravel(), depth.ravel())
    return flagged & (deepest[labels] < rim * flagged.shape[1])


def _moves(
    view: View,
    look: Look,
    inverse: Float[np.ndarray, "f h w"],
    track: Sequence[Sighting],
    options: UserOptions,
) -> bool:
    share = telling_share(track)
    if share > options.moving_share:
        return True
    return share > options.doubtful_share and off_place(view, look, inverse, track) > options.off_place


def telling_share(track: Sequence[Sighting]) -> float:
    """Share of the pixels of a road user that was followed which tell that it moves."""
    counted = np.array([min(seen.pixels, _MOST_COUNTED_PX) for seen in track], np.float64)
    return float(counted @ [seen.telling / seen.pixels for seen in track] / counted.sum())


def off_place(
    view: View, look: Look, inverse: Float[np.ndarray, "f h w"], track: Sequence[Sighting]
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


def follow(
    view: View,
    look: Look,
    flows: Mapping[int, Sequence[PairFlow]],
    telling: Bool[np.ndarray, "f h w"],
) -> list[list[Sighting]]:
    """Road users from frame to frame: each goes on as the one that it shares most pixels with.

    A vehicle never goes on as a person: where one has left the picture, a sign behind it is taken for one.
    """
    instances = look.instances
    tracks: list[list[Sighting]] = []
    open_: dict[int, list[Sighting]] = {}
    for at, frame in enumerate(view.frames):
        counts = np.bincount(instances[frame].ravel())
        labels = [label for label in range(1, len(counts)) if counts[label] >= _LEAST_PX]
        going_on: dict[int, list[Sighting]] = {}
        before = view.frames[at - 1] if at else frame
        linked = _linked(look, before, frame, flows.get(before, ())) if open_ else {}
        for label in labels:
            track = open_.get(linked.get(label, 0))
            if track is None:
                track = []
                tracks.append(track)
            told = int((telling[frame] & (instances[frame] == label)).sum())
            track.append(Sighting(frame, label, int(counts[label]), told))
            going_on[label] = track
        open_ = going_on
    return tracks


def _linked(look: Look, before: int, after: int, flows: Sequence[PairFlow]) -> dict[int, int]:
    """Of each label in a frame that of the frame before, where both share most pixels with one another.

    Pixels are carried along the flow, or stay where they are: of fast traffic the flow may be lost.
    """
    first, second = look.instances[before], look.instances[after]
    shape = int(first.max(initial=0)) + 1, int(second.max(initial=0)) + 1
    shared = _counts(first, second, shape)
    for flow in flows:
        if flow.source == after:
            height, width = first.shape
            x = np.clip(np.rint(flow.x), 0, width - 1).astype(np.intp)
            y = np.clip(np.rint(flow.y), 0, height - 1).astype(np.intp)
            shared = np.maximum(shared, _counts(first, second[y, x], shape))
    shared[0], shared[:, 0] = 0, 0
    was, becomes = _kinds(look, before, shape[0]), _kinds(look, after, shape[1])
    shared[np.outer(was == StreetClass.VEHICLE, becomes == StreetClass.PERSON)] = 0
    shared[np.outer(was == StreetClass.PERSON, becomes == StreetClass.VEHICLE)] = 0
    forward, back = shared.argmax(axis=1), shared.argmax(axis=0)
    return {
        label: int(back[label])
        for label in range(1, shape[1])
        if shared[back[label], label] > 0 and forward[back[label]] == label
    }


def _kinds(look: Look, frame: int, count: int) -> Integer[np.ndarray, " n"]:
    """The class of each label of a frame, the first so many; that of 0, which is none, is -1."""
    kinds = np.full(count, -1)
    known = [int(user.kind) for user in look.road_users[frame]][: count - 1]
    kinds[1 : 1 + len(known)] = known
    return kinds


def _counts(
    first: Integer[np.ndarray, "h w"], second: Integer[np.ndarray, "h w"], shape: tuple[int, int]
) -> Integer[np.ndarray, "n m"]:
    both = first.astype(np.intp) * shape[1] + second
    return np.bincount(both.ravel(), minlength=shape[0] * shape[1]).reshape(shape)
