"""What moves are whole road users, over all the frames that show them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Integer, UInt16

from dreamdrive.geometry.depth import View
from dreamdrive.geometry.moving.evidence import FLAGGED
from dreamdrive.geometry.moving.flow import PairFlow
from dreamdrive.geometry.options import UserOptions
from dreamdrive.scene.look import Look

_LEAST_SIGHTINGS = 4  # from which a speed is read
_LEAST_PX = 12  # of a road user that is followed
_FOOT_SHARE = 0.3  # of its pixels, the lowest, that tell where it stands
_MOST_COUNTED_PX = 2000  # in one frame: a near view does not outvote many far ones


@dataclass(frozen=True)
class Sighting:
    """A road user in one frame: its pixels, how many are flagged, and its foot on the map in metres.

    ``off_m`` is the standard deviation of the place; the place is not a number where no depth is known.
    """

    frame: int
    label: int
    pixels: int
    flagged: int
    place_m: Float[np.ndarray, "3"]
    off_m: float


def whole_users(
    view: View,
    look: Look,
    flows: Mapping[int, Sequence[PairFlow]],
    evidence: Float[np.ndarray, "f h w"],
    inverse: Float[np.ndarray, "f h w"],
    spread: Float[np.ndarray, "f h w"],
    times_s: Float[np.ndarray, " f"],
) -> tuple[Float[np.ndarray, "f h w"], UInt16[np.ndarray, "f h w"]]:
    """Evidence of motion in [0, 1] with each road user moving as a whole, in all its frames, or not at all.

    With it the number of the road user of each pixel, from 1, the same in all frames.

    A road user moves if enough of its pixels do, or if its foot changes its place on the map. What surely is
    no road user does not move.
    """
    options = view.options.users
    whole, users = evidence.copy(), np.zeros(evidence.shape, np.uint16)
    for frame in view.frames:
        street = (look.instances[frame] == 0) & (look.confidence[frame] >= options.sure)
        whole[frame][street] = np.minimum(whole[frame][street], 0.9 * FLAGGED)
    tracks = follow(view, look.instances, flows, evidence, inverse, spread)
    for number, track in enumerate(tracks, start=1):
        moves = is_moving(track, times_s, options)
        for seen in track:
            own = look.instances[seen.frame] == seen.label
            users[seen.frame][own] = number
            part = whole[seen.frame]
            part[own] = np.maximum(part[own], FLAGGED) if moves else np.minimum(part[own], 0.9 * FLAGGED)
    return whole, users


def is_moving(track: Sequence[Sighting], times_s: Float[np.ndarray, " f"], options: UserOptions) -> bool:
    """Whether a road user that was followed moves."""
    counted = np.array([min(seen.pixels, _MOST_COUNTED_PX) for seen in track], np.float64)
    share = float(counted @ [seen.flagged / seen.pixels for seen in track] / counted.sum())
    speed, off = _speed(track, times_s)
    return share > options.moving_share or speed - 2 * off > options.moving_m_s


def _speed(track: Sequence[Sighting], times_s: Float[np.ndarray, " f"]) -> tuple[float, float]:
    """Speed over the map in m/s, and its standard deviation; 0 where it is not seen often enough.

    Of what stands another part is seen from each place, which looks like a few metres a second.
    """
    placed = [seen for seen in track if np.isfinite(seen.off_m)]
    if len(placed) < _LEAST_SIGHTINGS:
        return 0.0, 0.0
    weight = 1 / np.array([seen.off_m for seen in placed])
    times = times_s[[seen.frame for seen in placed]]
    terms = np.stack([np.ones(len(times)), times - times.mean()], axis=1) * weight[:, None]
    places = np.stack([seen.place_m for seen in placed]) * weight[:, None]
    velocity = np.linalg.lstsq(terms, places, rcond=None)[0][1]
    return float(np.linalg.norm(velocity)), float(np.sqrt(np.linalg.inv(terms.T @ terms)[1, 1]))


def follow(
    view: View,
    instances: Integer[np.ndarray, "f h w"],
    flows: Mapping[int, Sequence[PairFlow]],
    evidence: Float[np.ndarray, "f h w"],
    inverse: Float[np.ndarray, "f h w"],
    spread: Float[np.ndarray, "f h w"],
) -> list[list[Sighting]]:
    """Road users from frame to frame: each goes on as the one that it shares most pixels with."""
    tracks: list[list[Sighting]] = []
    open_: dict[int, list[Sighting]] = {}
    for at, frame in enumerate(view.frames):
        counts = np.bincount(instances[frame].ravel())
        labels = [label for label in range(1, len(counts)) if counts[label] >= _LEAST_PX]
        going_on: dict[int, list[Sighting]] = {}
        before = view.frames[at - 1] if at else frame
        linked = _linked(instances, before, frame, flows.get(before, ())) if open_ else {}
        for label in labels:
            track = open_.get(linked.get(label, 0))
            if track is None:
                track = []
                tracks.append(track)
            track.append(_sighting(view, frame, label, instances[frame], evidence[frame], inverse, spread))
            going_on[label] = track
        open_ = going_on
    return tracks


def _linked(
    instances: Integer[np.ndarray, "f h w"], before: int, after: int, flows: Sequence[PairFlow]
) -> dict[int, int]:
    """Of each label in a frame that of the frame before, where both share most pixels with one another.

    Pixels are carried along the flow, or stay where they are: of fast traffic the flow may be lost.
    """
    first, second = instances[before], instances[after]
    shape = int(first.max(initial=0)) + 1, int(second.max(initial=0)) + 1
    shared = _counts(first, second, shape)
    for flow in flows:
        if flow.source == after:
            height, width = first.shape
            x = np.clip(np.rint(flow.x), 0, width - 1).astype(np.intp)
            y = np.clip(np.rint(flow.y), 0, height - 1).astype(np.intp)
            shared = np.maximum(shared, _counts(first, second[y, x], shape))
    shared[0], shared[:, 0] = 0, 0
    forward, back = shared.argmax(axis=1), shared.argmax(axis=0)
    return {
        label: int(back[label])
        for label in range(1, shape[1])
        if shared[back[label], label] > 0 and forward[back[label]] == label
    }


def _counts(
    first: Integer[np.ndarray, "h w"], second: Integer[np.ndarray, "h w"], shape: tuple[int, int]
) -> Integer[np.ndarray, "n m"]:
    both = first.astype(np.intp) * shape[1] + second
    return np.bincount(both.ravel(), minlength=shape[0] * shape[1]).reshape(shape)


def _sighting(
    view: View,
    frame: int,
    label: int,
    instances: Integer[np.ndarray, "h w"],
    evidence: Float[np.ndarray, "h w"],
    inverse: Float[np.ndarray, "f h w"],
    spread: Float[np.ndarray, "f h w"],
) -> Sighting:
    own: Bool[np.ndarray, "h w"] = instances == label
    rows = np.nonzero(own)[0]
    pixels = len(rows)
    low = own & (np.arange(len(own))[:, None] >= np.quantile(rows, 1 - _FOOT_SHARE)) & (inverse[frame] > 0)
    place, off = np.full(3, np.nan), np.inf
    if low.any():
        camera = view.cameras[frame]
        points = camera.rays()[low] / inverse[frame][low][:, None]
        middle = np.median(points, axis=0)
        place = camera.world_from_camera[:3, :3] @ middle + camera.world_from_camera[:3, 3]
        off = float(np.median(spread[frame][low]) * np.linalg.norm(middle))
    return Sighting(frame, label, pixels, int((own & (evidence >= FLAGGED)).sum()), place, off)
