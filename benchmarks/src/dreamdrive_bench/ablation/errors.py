"""Other errors of the static fit that hybrid's is compared with, and errors relative to their own frame."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import torch
from jaxtyping import Float

from dreamdrive.decompose import error_maps, score
from dreamdrive.files.digest import stage_seed
from dreamdrive.options import Options
from dreamdrive.scene.clip import OF_GEOMETRY, pixel_features
from dreamdrive.splat import render, ssim_map
from dreamdrive_bench.street.fit import Around

Before = Mapping[str, Any]
"""Results of the stages before, by name."""
Errors = Callable[[Before, Options], Float[np.ndarray, "f h w"]]
"""From a static fit to the error maps that the scores are trained on."""
FULL_PERCENTILE = 98.0
"""Of a frame's errors, which counts as 1 where they are scaled frame by frame."""
FEATURE_RANGE = 4.0
"""Features of a clip have unit variance: two deviations to either side count as all there is."""


def scored_on(errors: Errors) -> Around:
    """F_score, trained on other errors."""

    def trained(before: Before, options: Options, usual: Callable[[], Any]) -> Float[torch.Tensor, " n"]:
        maps, seed = errors(before, options), stage_seed(0, "score")
        clip, geometry, seeds = before["prior"], before["geometry"], before["initialise"]
        return score(clip, geometry, seeds, maps, options.score, seed, lambda *_: None)

    return trained


def own_errors(before: Before, options: Options) -> Float[np.ndarray, "f h w"]:
    """Hybrid's errors: of colour, absolute."""
    clip, geometry = before["prior"], before["geometry"]
    return error_maps(clip, geometry, before["static"].pictures(clip, geometry))


def dssim_errors(before: Before, options: Options) -> Float[np.ndarray, "f h w"]:
    """(1 - SSIM) / 2 of static fit and references."""
    clip, geometry = before["prior"], before["geometry"]
    picture = before["static"].pictures(clip, geometry)

    def error(frame: int) -> np.ndarray:
        image = picture(frame)
        reference = torch.from_numpy(clip.frames[frame] / np.float32(255))
        return ((1 - ssim_map(image, reference)) / 2).mean(dim=2).numpy()

    return _of_street(before, error)


@torch.no_grad()
def feature_errors(before: Before, options: Options) -> Float[np.ndarray, "f h w"]:
    """Mean distance of the splatted features from those of the frame, where anything is splatted."""
    clip, geometry, gaussians = before["prior"], before["geometry"], before["static"].gaussians
    assert gaussians.features is not None
    channels = gaussians.features[:, OF_GEOMETRY:].contiguous()

    def error(frame: int) -> np.ndarray:
        drawn = render(gaussians, geometry.cameras[frame], channels=channels, sh_degree=0)
        reference = torch.from_numpy(pixel_features(clip, geometry, frame)[..., OF_GEOMETRY:])
        mean = drawn.channels / drawn.alpha.clamp(min=1e-3)[..., None]
        far = (mean - reference).abs().mean(dim=2)
        return ((far / FEATURE_RANGE).clamp(0, 1) * drawn.alpha).numpy()

    return _of_street(before, error)


def by_frame(errors: Errors) -> Errors:
    """Each frame's errors relative to its own."""
    return lambda before, options: scaled_by_frame(errors(before, options), options.score.error_scale)


def scaled_by_frame(errors: Float[np.ndarray, "f h w"], full: float) -> Float[np.ndarray, "f h w"]:
    """Each frame's errors over their own 98th percentile, which counts as ``full``."""
    top = np.percentile(errors, FULL_PERCENTILE, axis=(1, 2), keepdims=True)
    return (full * errors / np.maximum(top, 1e-6)).astype(errors.dtype)


def _of_street(before: Before, error: Callable[[int], np.ndarray]) -> Float[np.ndarray, "f h w"]:
    """Errors of all frames; 0 in held-out ones and where a pixel shows no street."""
    clip, geometry = before["prior"], before["geometry"]
    errors = np.zeros(clip.frames.shape[:3], dtype=np.float32)
    for frame in np.flatnonzero(~clip.held_out).tolist():
        street = clip.valid[frame] & (geometry.fixed_regions[clip.camera[frame]] == 0)
        errors[frame] = np.where(street, error(frame), 0)
    return errors
