"""Choice of stereo in place of fused depth, where the frames clearly say so."""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from jaxtyping import Bool, Float, Integer

from dreamdrive.geometry.depth.fusion import Fused
from dreamdrive.geometry.depth.sweep import Correlation, Source, Warp, choose_sources, similarity
from dreamdrive.geometry.depth.view import PosedFrames, by_frame
from dreamdrive.vision.windows import grown

_BLUR_PX = 1.5  # of pictures that are 480 wide: what one pixel prefers is noise
_FEW_PX = 12  # of a road user, whose stereo tells where it stands


def preferred(
    view: PosedFrames,
    inverse: Float[np.ndarray, "f h w"],
    swept_inverse: Float[np.ndarray, "f h w"],
    confidence: Float[np.ndarray, "f h w"],
    free: Bool[np.ndarray, "f h w"],
) -> Float[np.ndarray, "f h w"]:
    """Inverse depth in 1/m of all frames, with stereo where neighbours match it clearly better.

    What a network sees, or what is smooth along a surface, is a guess that the frames can check: the picture
    is compared with its neighbours at both depths. Stereo is taken where it has some support in several
    frames, too, and only of pixels that are free.
    """
    options = view.options.fusion
    chosen = inverse.copy()

    def one(frame: int) -> Float[np.ndarray, "h w"]:
        both = free[frame] & (swept_inverse[frame] > 0) & (inverse[frame] > 0)
        both &= confidence[frame] >= options.supported
        ratio = np.where(both, swept_inverse[frame], 1) / np.where(both, inverse[frame], 1)
        both &= np.abs(np.log(ratio)) < options.preferred_within
        sources = _sources(view, frame)
        if not sources or not both.any():
            return inverse[frame]
        correlation = Correlation(view.grey[frame])
        gain = similarity(correlation, sources, swept_inverse[frame])
        gain -= similarity(correlation, sources, inverse[frame])
        gain = cv2.GaussianBlur(gain, (0, 0), grown(_BLUR_PX, gain.shape[1]))
        return np.where(both & (gain > options.preferred), swept_inverse[frame], inverse[frame])

    for frame, each in by_frame(view, one).items():
        chosen[frame] = each
    return chosen


def shifted_road_users(
    view: PosedFrames,
    instances: Integer[np.ndarray, "f h w"],
    found: Fused,
    swept_inverse: Float[np.ndarray, "f h w"],
    confidence: Float[np.ndarray, "f h w"],
    standing: Bool[np.ndarray, "f h w"],
) -> Fused:
    """Road users that stand, moved along the view as wholes to where their neighbours match them better.

    Their depth is that of their contact with a road that is taken to be level; on a road that bends or rises
    it is off. A car is too plain for its stereo to be believed pixel by pixel, but many pixels say the same.
    """
    options = view.options.fusion

    def one(frame: int) -> Float[np.ndarray, "h w"]:
        inverse, sources = found.inverse[frame].copy(), _sources(view, frame)
        labels = np.where(standing[frame], instances[frame], 0).astype(np.intp)
        sure = (confidence[frame] >= options.supported) & (swept_inverse[frame] > 0) & (inverse > 0)
        if not sources or not (labels[sure] > 0).any():
            return inverse
        off = np.log(np.where(sure, swept_inverse[frame], 1) / np.where(sure, inverse, 1))
        moved = inverse.copy()
        numbers = [
            k for k in np.unique(labels[sure & (labels > 0)]) if (sure & (labels == k)).sum() >= _FEW_PX
        ]
        for k in numbers:
            moved[labels == k] *= np.exp(np.median(off[sure & (labels == k)]))
        correlation = Correlation(view.grey[frame])
        gain = similarity(correlation, sources, moved)
        gain -= similarity(correlation, sources, inverse)
        for k in numbers:
            if gain[labels == k].mean() > options.preferred:
                inverse[labels == k] = moved[labels == k]
        return inverse

    shifted = found.inverse.copy()
    for frame, each in by_frame(view, one).items():
        shifted[frame] = each
    return replace(found, inverse=shifted)


def _sources(view: PosedFrames, frame: int) -> Sequence[Source]:
    """The neighbours with which a frame is compared."""
    near = choose_sources(view.positions_m, view.used, frame, view.options.depth.reach_frames)
    return [(Warp(view.cameras[frame], view.cameras[i]), view.grey[i], view.usable[i]) for i in near]
