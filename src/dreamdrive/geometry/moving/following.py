"""Tracking of road users from frame to frame."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Integer, UInt8
from scipy.ndimage import gaussian_filter

from dreamdrive.geometry.depth import PosedFrames
from dreamdrive.geometry.moving.flow import PairFlow
from dreamdrive.scene.street.look import Look
from dreamdrive.scene.street.street_class import StreetClass

_LEAST_PX = 12  # of a road user that is followed
_TONES = 16  # of each channel that are told apart ...
_BLUR_TONES = 1.0  # ... but for such a blur: a cloud is no other car


@dataclass(frozen=True)
class Sighting:
    """A road user in one frame: its pixels, and how many of them tell that it moves."""

    frame: int
    label: int
    pixels: int
    telling: int


def follow(
    view: PosedFrames,
    look: Look,
    flows: Mapping[int, Sequence[PairFlow]],
    telling: Bool[np.ndarray, "f h w"],
) -> list[list[Sighting]]:
    """Road users from frame to frame: each goes on as the one that it shares most pixels with.

    A vehicle never goes on as a person: where one has left the picture, a sign behind it is taken for one.
    Nor does anything go on in other colours: where a car has left the picture, there comes the next.
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
            was = linked.get(label, 0)
            track = open_.get(was)
            if track is None or _alike(view, look, (before, was), (frame, label)) < view.options.users.alike:
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


def _alike(view: PosedFrames, look: Look, one: tuple[int, int], other: tuple[int, int]) -> float:
    """Share of the colours of two road users, each a frame and a label, that both have, in [0, 1]."""
    colours = [_colours(view.rgb[frame][look.instances[frame] == label]) for frame, label in (one, other)]
    return float(np.minimum(*colours).sum())


def _colours(rgb: UInt8[np.ndarray, "n 3"]) -> Float[np.ndarray, "t t t"]:
    """Share of the pixels of each colour."""
    tone = np.ravel_multi_index((rgb.T.astype(np.intp) * _TONES) // 256, (_TONES,) * 3)
    count = np.bincount(tone, minlength=_TONES**3).reshape((_TONES,) * 3)
    return gaussian_filter(count / max(len(rgb), 1), _BLUR_TONES, mode="constant")
