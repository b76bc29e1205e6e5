"""A per-frame street: surfaces of single frames that move as the picture does.

Where no path of the camera explains what is seen, as in a queue that drives, a street fitted to all frames at
once is a blur. The frames beside one still tell what it shows.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from dreamdrive.decompose.group import source_pixels
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.vision.flow import carried, cells, in_between, neighbour_flow

_LEAST_PIXELS = 500
_LIKE = 0.3  # in the logarithm of depth, what one surface may change by from frame to frame
_DOUBT = 1e-3  # what flow that does not lead back weighs beside flow that does


@dataclass(frozen=True)
class PerFrameOptions:
    """Constants of a per-frame street; what they are worth: docs/results/ablation.md.

    Attributes:
        allowed: Whether a street may be one.
        lifespan_frames: Deviation of the life spans at the start, in intervals between training frames.
        spacing_px: Distance between seeds.
        footprint: Standard deviation of a seed over their distance.
        opacity: Opacity to start from.
        steps: Steps of the joint fit over those of a street that stands: it sees the frames between as well.
        margin_db: PSNR in dB by which a street that stands may fall behind the frames beside each frame.
        finest_db: PSNR in dB to which a street of single frames can be fitted to pictures at best.
    """

    allowed: bool = True
    lifespan_frames: float = 1.4
    spacing_px: int = 3
    footprint: float = 0.5
    opacity: float = 0.8
    steps: float = 2.0
    margin_db: float = 0.3
    finest_db: float = 34.0


def stands(
    clip: Clip,
    frames: Sequence[int],
    errors: Float[np.ndarray, "k h w"],
    judged: Bool[np.ndarray, "k h w"],
    options: PerFrameOptions,
) -> bool:
    """Whether a street that stands predicts frames about as well as the frames beside each do.

    Args:
        clip: Of which the frames were withheld from a fit of a street that stands; they are held out in it.
        frames: These frames.
        errors: By how much the fit misses each of them, mean absolute difference over colours, in [0, 1].
        judged: The pixels that count.
        options: Constants.

    Every frame is also made from its neighbours, carried along optical flow; no better than a street of
    single frames can be fitted to pictures. The mean over the frames of the differences in dB decides,
    against the margin.
    """
    behind: list[float] = []
    for frame, error, counts in zip(frames, errors, judged, strict=True):
        seen = np.array(clip.seen_of(int(clip.camera[frame])))
        before, after = seen[seen < frame], seen[seen > frame]
        if counts.sum() < _LEAST_PIXELS or not len(before) or not len(after):
            continue
        carried_on = in_between(clip, int(before[-1]), frame, int(after[0]))
        beside = np.abs(carried_on - clip.frames[frame] / np.float32(255)).mean(axis=2)
        best = np.square(beside[counts]).mean() + 10 ** (-options.finest_db / 10)
        behind.append(float(10 * np.log10(max(np.square(error[counts]).mean(), 1e-8) / best)))
    return not behind or float(np.mean(behind)) <= options.margin_db


def per_frame_street(clip: Clip, geometry: Geometry, seeds: Gaussians, options: PerFrameOptions) -> Gaussians:
    """Seeds of all pixels of every training frame, each alive around its frame and on its way to the others.

    The velocity is the mean of those to the frames beside it, along optical flow and from depth to depth:
    what stands stays where path and depth are right. Held-out frames are not read.
    """
    times_s = torch.from_numpy(clip.times_s)[seeds.source_frame].to(torch.float32)
    span_s = torch.full_like(times_s, options.lifespan_frames * clip.seen_interval_s)
    logit = float(np.log(options.opacity / (1 - options.opacity)))
    return replace(
        seeds,
        log_scales=torch.from_numpy(_log_size(geometry, seeds, options)).to(torch.float32),
        logit_opacities=torch.full_like(seeds.logit_opacities, logit),
        lifespan=torch.stack([times_s, span_s], dim=1),
        velocity=torch.from_numpy(_velocity(clip, geometry, seeds)).to(torch.float32),
        actor=None,
    )


def _log_size(geometry: Geometry, seeds: Gaussians, options: PerFrameOptions) -> Float[np.ndarray, "n 3"]:
    """Logarithm of the deviations (N, 3) in metres of balls that cover the picture of their frame.

    Depth of single frames has folds, in which surfaces would be seen edge on, with gaps between.
    """
    frames, size_m = seeds.source_frame.numpy(), np.zeros(len(seeds))
    for frame in np.unique(frames).tolist():
        rows, camera = frames == frame, geometry.cameras[frame]
        depth_m = camera.project(seeds.means.numpy()[rows].astype(np.float64))[:, 2]
        size_m[rows] = depth_m / camera.fx_px * options.spacing_px * options.footprint
    return np.log(np.maximum(size_m, 1e-6))[:, None].repeat(3, axis=1)


def _velocity(clip: Clip, geometry: Geometry, seeds: Gaussians) -> Float[np.ndarray, "n 3"]:
    frames, places_m = seeds.source_frame.numpy(), seeds.means.numpy().astype(np.float64)
    sums, weights = np.zeros_like(places_m), np.zeros((len(seeds), 1))
    for camera in np.unique(clip.camera).tolist():
        seen = clip.seen_of(camera)
        for first, second in pairwise(seen):
            there, back = neighbour_flow(clip, first, second), neighbour_flow(clip, second, first)
            for frame, other, ahead, home in ((first, second, there, back), (second, first, back, there)):
                rows = np.flatnonzero(frames == frame)
                start = geometry.cameras[frame].project(places_m[rows])
                end = carried(start[:, :2], ahead)
                trust = np.exp(-np.linalg.norm(carried(end, home) - start[:, :2], axis=1)) + _DOUBT
                end_m = np.column_stack([end, _depth_m(geometry, other, end, start[:, 2])])
                way_m = geometry.cameras[other].lift(end_m) - places_m[rows]
                sums[rows] += trust[:, None] * way_m / (clip.times_s[other] - clip.times_s[frame])
                weights[rows, 0] += trust
    return sums / np.maximum(weights, 1e-9)


def _depth_m(
    geometry: Geometry, frame: int, pixels: Float[np.ndarray, "m 2"], expected_m: Float[np.ndarray, " m"]
) -> Float[np.ndarray, " m"]:
    """Depth at pixels of a frame where it is about what is expected; else that is taken.

    What drives along keeps its distance and what stands comes nearer; only depth tells them apart.
    """
    there_m = geometry.depth_m[frame][cells(pixels, geometry.depth_m.shape[1:])].astype(np.float64)
    like = np.abs(np.log(np.maximum(there_m, 1e-6) / expected_m)) < _LIKE
    return np.where(like, there_m, expected_m)


def pixels_of(
    geometry: Geometry, gaussians: Gaussians, index: Int[np.ndarray, " m"], reach_px: int
) -> Bool[np.ndarray, "f h w"]:
    """Pixels (F, H, W) that some Gaussians were seeded from, with those around."""
    mask = np.zeros(geometry.depth_m.shape, dtype=np.uint8)
    places = cells(source_pixels(geometry, gaussians, index), mask.shape[1:])
    mask[gaussians.source_frame.numpy()[index], *places] = 1
    box = np.ones((2 * reach_px + 1, 2 * reach_px + 1), np.uint8)
    return np.stack([cv2.dilate(each, box) for each in mask]) > 0


def outside(geometry: Geometry, seeds: Gaussians, mask: Bool[np.ndarray, "f h w"]) -> Bool[Tensor, " n"]:
    """Which seeds do not lie in the mask of their frame."""
    places = cells(source_pixels(geometry, seeds, np.arange(len(seeds))), mask.shape[1:])
    return torch.from_numpy(~mask[seeds.source_frame.numpy(), *places])


def without_sky(geometry: Geometry, far_m: float) -> Geometry:
    """The geometry with the sky as a surface far away.

    A sky that is one panorama stands; behind a pane with reflections, or in fog, it does not.
    """
    nothing = np.zeros_like(geometry.sky)
    return replace(geometry, depth_m=np.where(geometry.sky, np.float32(far_m), geometry.depth_m), sky=nothing)
