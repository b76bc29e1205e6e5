"""Two scenes compared where nothing changed, and where the edge of a road lies."""

import cv2
import numpy as np

from dreamdrive.scene.street.layout import Layout
from dreamdrive_bench.control.layout_edits import widen_road
from dreamdrive_bench.control.made import FPS, Made, render
from dreamdrive_bench.control.shift import lowest
from streetworld import drive

RIM_PX = 8
DIFFERENT = 2  # grey levels between clean frames from which on a pixel counts as changed
EDGES_M = np.arange(-0.25, 1.001, 0.125)


def compare(before: Made, after: Made, instance: int | None) -> tuple[float, float, float]:
    """PSNR of the renders, share of the pixels that it is of, PSNR of the clean frames there."""
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * RIM_PX + 1, 2 * RIM_PX + 1))
    squared, clean, kept = 0.0, 0.0, 0
    for frame in range(len(before.views)):
        frames = [made.drive.frames[frame].astype(float) for made in (before, after)]
        changed = np.abs(frames[1] - frames[0]).max(axis=-1) >= DIFFERENT
        if instance is not None:
            changed |= (before.truth.instance[frame] == instance) | (after.truth.instance[frame] == instance)
        keep = cv2.dilate(changed.astype(np.uint8), disc) == 0
        images = [render(made, frame) for made in (before, after)]
        squared += float(np.square(images[1] - images[0])[keep].sum())
        clean += float(np.square((frames[1] - frames[0]) / 255)[keep].sum())
        kept += int(keep.sum())
    return psnr(squared, 3 * kept), kept / before.truth.moving.size, psnr(clean, 3 * kept)


def psnr(squared: float, count: int) -> float:
    """PSNR in dB from a sum of squares; at most 99."""
    return float(min(99.0, -10 * np.log10(max(squared, 1e-12) / count)))


def edge_of(made: Made, layout: Layout) -> float | None:
    """By how much the road of a layout has to be widened to look most like a scene, in metres.

    Every trial is a clean drawing; they are compared where any two of them differ, and a parabola goes
    through the best and its neighbours. None where the best is the first or the last.
    """
    count, size = len(made.views), made.truth.size
    chosen = range(0, count, max(1, count // 4))
    trials = np.stack([drive(widen_road(layout, float(m)), count, FPS, size).frames[chosen] for m in EDGES_M])
    differs = np.ptp(trials, axis=0).max(axis=-1) >= DIFFERENT
    shown = np.stack([render(made, frame) for frame in chosen])
    errors = np.array([np.square(trial / 255 - shown)[differs].mean() for trial in trials])
    return lowest(EDGES_M, errors)
