"""Frames that repeat the one before: of a slow camera stored at a faster rate, or of one that hung."""

from dataclasses import replace
from itertools import pairwise

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from dreamdrive.data.frames.select import held_out_mask
from dreamdrive.scene.clip import Clip

_WIDTH_PX, _CELL_PX = 160, 8
_STILL = 0.15
"""Part of the usual step that a repeat differs by at most, in the place of a picture that changes most:
repeats that H.264 stored at low quality have 0.13."""
_MOST = 2
"""Such steps in a row: more of them may be a camera that stands, whose noise is as little."""
_FULL = 0.5
"""Part of the usual step that those around have at least: a car takes several frames to stop and to start."""
_LEAST = 4
"""Frames that have to be left."""


def without_repeats(clip: Clip, hold_out: int | None) -> Clip:
    """The clip without times at which every camera shows what it showed before, and a note about them.

    Frames repeat the one before if they equal it, or differ next to nothing for a step or two of a drive: no
    car stops and goes within these. The times of the others stay as they are.
    What is all alike stays as it is, as do clips of few frames. Every N-th of what is left is held out.
    """
    again = np.zeros(len(clip), bool)
    for camera in range(len(clip.rig)):
        rows = clip.of_camera(camera)
        again[rows] = _repeats(clip.frames[rows])
    at = np.unique(clip.times_s, return_inverse=True)[1]
    repeats = np.bincount(at, ~again) == 0
    if not repeats.any() or (~repeats).sum() < _LEAST:
        return clip
    rest = clip.of_frames(np.flatnonzero(~repeats[at]))
    left = np.unique(rest.times_s, return_inverse=True)[1]
    held_out = held_out_mask(int((~repeats).sum()), hold_out)[left]
    verb = "repeats the one before and is" if repeats.sum() == 1 else "repeat the one before and are"
    said = f"{repeats.sum()} of {len(repeats)} frames {verb} left out; the times of the others stay."
    notes = [*clip.provenance.get("notes", []), said]
    return replace(rest, held_out=held_out, provenance={**clip.provenance, "notes": notes})


def _repeats(frames: UInt8[np.ndarray, "f h w 3"]) -> Bool[np.ndarray, " f"]:
    """Which frames of one camera show the one before them again."""
    same = np.array([False, *(np.array_equal(a, b) for a, b in pairwise(frames))])
    small = np.array([_small(frame) for frame in frames])
    return same | _still_in_a_drive(np.array([_step(a, b) for a, b in pairwise(small)]))


def _still_in_a_drive(steps: Float[np.ndarray, " s"]) -> Bool[np.ndarray, " f"]:
    """Frames behind one or two steps of next to no change, between two of full ones.

    At either end of the clip one full step is enough where the clip holds other such frames.
    """
    found = np.zeros(len(steps) + 1, bool)
    if not steps.any():
        return found
    usual = np.median(steps[steps > _STILL * steps.max()])
    still, full = steps <= _STILL * usual, steps >= _FULL * usual
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int))).reshape(-1, 2)
    short = [(a, b) for a, b in edges.tolist() if b - a <= _MOST]
    inner = [(a, b) for a, b in short if a > 0 and b < len(steps) and full[a - 1] and full[b]]
    outer = [(a, b) for a, b in short if (a == 0) != (b == len(steps)) and full[b if a == 0 else a - 1]]
    for first, end in inner + (outer if inner else []):
        found[first + 1 : end + 1] = True
    return found


def _small(frame: UInt8[np.ndarray, "h w 3"]) -> Float[np.ndarray, "h2 w2"]:
    """In grey and so small that noise averages out."""
    height = max(_CELL_PX, round(_WIDTH_PX * frame.shape[0] / frame.shape[1]))
    grey = cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY)
    return cv2.resize(grey, (_WIDTH_PX, height), interpolation=cv2.INTER_AREA).astype(np.float32)


def _step(first: Float[np.ndarray, "h w"], second: Float[np.ndarray, "h w"]) -> float:
    """Grey levels by which the place that changes most does."""
    return float(cv2.blur(np.abs(first - second), (_CELL_PX, _CELL_PX)).max())
