"""Checks of given poses against the frames."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.geometry.cameras.paths import path_length
from dreamdrive.geometry.evidence import Evidence, track
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip

MIN_OWN, MIN_OF_OWN = 0.5, 0.5
"""Share of tracks that a motion of their own has to explain before they count, and the part of it that given
poses have to. On three recorded drives and four drawn streets, also corrupted, right poses reach 0.94 to 1.03
of it, and 0.86 to 1.0 with 0.05 m of noise; inverted, reversed or shuffled ones and those of other axes 0 to
0.42."""
MIN_BEST = 0.8
"""The same of the pair that is explained best, which is enough where another camera of the car has borne out
its path: what drives along with a side camera can fill its pictures most of the time. On 120 side views of
drawn streets right poses reach 0.94 or more, nine of ten of those of another camera or other axes less."""
_PAIRS = 8
_APART = 3  # frames at most
_STILL_FOLLOWED = 0.5
"""Share of the tracks of one step that have to last a pair. Where a side camera passes things fast, only what
drives along with it lasts, and shows a motion of its own."""
_MIN_TRACKS = 30
_WITHIN_PX = 2.0  # at 320 px width
_MIN_FLOW_PX = 3.0
_STANDING = 1e-3  # of the path
_SAME_POSE = 0.01  # metres, and in the entries of the rotation


@dataclass(frozen=True)
class Explained:
    """Median shares of the tracks between pairs of frames that given poses, and the best motion, explain.

    ``best`` is the highest share of one pair that given poses explain, of what its best motion does.
    """

    given: float
    own: float
    best: float
    pairs: int

    @property
    def contradictory(self) -> bool:
        """Whether the frames show a clear motion of the camera, and another one."""
        return self.pairs > 0 and self.own >= MIN_OWN and self.given < MIN_OF_OWN * self.own


@dataclass(frozen=True)
class _Pair:
    """Two frames, and where corners are in both."""

    first: int
    second: int
    here: Float[np.ndarray, "n 2"]
    there: Float[np.ndarray, "n 2"]

    @property
    def is_clear(self) -> bool:
        """Whether there are enough tracks, and they move."""
        moved_px = np.linalg.norm(self.there - self.here, axis=1)
        return len(self.here) >= _MIN_TRACKS and float(np.median(moved_px)) >= _MIN_FLOW_PX


def check(clip: Clip, evidence: Evidence) -> None:
    """Refuse known poses that contradict the frames, where there are any and the user gave them."""
    if clip.known.world_from_camera is None or clip.known.generated:
        return
    poses = clip.known.world_from_camera
    beside = clip.known.ground is not None  # another camera told the road, and its path was checked
    stand = np.abs(poses - poses[0]).max() < (_SAME_POSE if clip.known.metric else 1e-9)  # up to rounding
    if stand and not beside and _moves(evidence):
        raise InputError(
            "the given poses are all the same, but the camera moves in the frames: with them nothing has a "
            "depth. Give the pose of each frame, or none to have them found"
        )
    found = explain(evidence, poses)
    if not found.contradictory or (beside and found.best >= MIN_BEST):
        return
    focal = "" if clip.known.intrinsics else "; the focal length is a guess: if it is known, give it too"
    raise InputError(
        f"the given poses contradict the frames: of what moves between them they explain {found.given:.0%}, "
        f"another motion {found.own:.0%}. Expected is world-from-camera with x right, y down, z forward, a "
        f"pose for each frame in their order{focal}"
    )


def explain(evidence: Evidence, world_from_camera: Float[np.ndarray, "f 4 4"]) -> Explained:
    """How much of the flow between frames the given poses, in any unit, explain.

    A track is explained if it ends within 2 px of its epipolar line, on the side of points before the camera:
    poses that were inverted, or have other axes, drive backwards. Pairs between which either nothing moves or
    the given camera stands tell nothing.
    """
    path, camera = path_length(world_from_camera), evidence.small
    given, own = [], []
    for pair in _clear_pairs(evidence):
        relative = np.linalg.inv(world_from_camera[pair.second]) @ world_from_camera[pair.first]
        if np.linalg.norm(relative[:3, 3]) > _STANDING * path:
            given.append(_share(pair, camera, relative))
            own.append(_share(pair, camera, _own(pair, camera)))
    if not own:
        return Explained(0.0, 0.0, 0.0, 0)
    best = max(one / max(most, MIN_OWN) for one, most in zip(given, own, strict=True))
    return Explained(float(np.median(given)), float(np.median(own)), best, len(own))


def _moves(evidence: Evidence) -> bool:
    """Whether most pairs of frames show one clear motion of the camera."""
    camera = evidence.small
    shares = [_share(pair, camera, _own(pair, camera)) for pair in _clear_pairs(evidence)]
    unclear = len(_firsts(len(evidence.grey))) - len(shares)
    return float(np.median([*shares, *[0.0] * unclear])) >= MIN_OWN


def _firsts(count: int) -> list[int]:
    """First frames of pairs all over a clip."""
    last = count - 1 - min(_APART, count - 1)
    return np.unique(np.linspace(0, last, _PAIRS).round().astype(int)).tolist()


def _clear_pairs(evidence: Evidence) -> list[_Pair]:
    """Pairs that show a motion, as far apart as most of their tracks last."""
    found = [_lasting(evidence, first) for first in _firsts(len(evidence.grey))]
    return [pair for pair in found if pair.is_clear]


def _lasting(evidence: Evidence, first: int) -> _Pair:
    near = _followed(evidence, first, first + 1)
    for second in range(min(first + _APART, len(evidence.grey) - 1), first + 1, -1):
        pair = _followed(evidence, first, second)
        if len(pair.here) >= _STILL_FOLLOWED * len(near.here):
            return pair
    return near


def _followed(evidence: Evidence, first: int, second: int) -> _Pair:
    tracks = track(evidence.grey[first], evidence.grey[second], evidence.street[first])
    return _Pair(first, second, *tracks)


def _own(pair: _Pair, camera: Camera) -> Float[np.ndarray, "4 4"]:
    """The motion that most tracks agree with: the second camera from the first, its step of length 1."""
    matrix = camera.matrix.copy()
    matrix[:2, 2] -= 0.5  # tracks count pixels from 0
    cv2.setRNGSeed(0)
    essential: Any  # None where nothing fits
    essential, inliers = cv2.findEssentialMat(pair.here, pair.there, matrix, cv2.RANSAC, 0.999, 1.0)
    found = np.eye(4)
    if essential is not None and essential.shape == (3, 3):
        _, found[:3, :3], step, _ = cv2.recoverPose(essential, pair.here, pair.there, matrix, mask=inliers)
        found[:3, 3] = step[:, 0]
    return found


def _share(pair: _Pair, camera: Camera, second_from_first: Float[np.ndarray, "4 4"]) -> float:
    """Share of tracks that a motion explains.

    A point at infinity is only turned; a nearer one goes on from there towards where the step of the camera
    would lead it, however near it is.
    """
    inverse = np.linalg.inv(camera.matrix)
    rays = (
        np.column_stack([pair.here + 0.5, np.ones(len(pair.here))]) @ inverse.T @ second_from_first[:3, :3].T
    )
    turned = rays[:, :2] / rays[:, 2:]
    step = second_from_first[:3, 3]
    towards = (step[:2] - turned * step[2]) * [camera.fx_px, camera.fy_px]
    towards /= np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-12)
    rest = pair.there + 0.5 - (turned * [camera.fx_px, camera.fy_px] + [camera.cx_px, camera.cy_px])
    along = (rest * towards).sum(axis=1)
    across = rest[:, 0] * towards[:, 1] - rest[:, 1] * towards[:, 0]
    return float(((rays[:, 2] > 0) & (np.abs(across) <= _WITHIN_PX) & (along >= -_WITHIN_PX)).mean())
