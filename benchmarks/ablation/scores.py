"""Scores that are trained on errors brought to another scale."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import torch
from jaxtyping import Float

from dreamdrive.decompose import error_maps, score
from dreamdrive.options import Options
from dreamdrive.run import stage_seed

FULL_PERCENTILE = 98.0
"""Of a frame's errors, which counts as 1 where they are scaled frame by frame."""


def by_frame(
    before: Mapping[str, Any], options: Options, usual: Callable[[], torch.Tensor]
) -> Float[torch.Tensor, " n"]:
    """F_score of error maps that are each relative to their own frame."""
    clip, geometry, static = before["prior"], before["geometry"], before["static"]
    errors = error_maps(clip, geometry, static.gaussians, static.sky, static.exposure, options.score.error)
    scaled = scaled_by_frame(errors, options.score.error_scale)
    seed = stage_seed(options.seed, "score")
    return score(clip, geometry, before["initialise"], scaled, options.score, seed, lambda *_: None)


def scaled_by_frame(errors: Float[np.ndarray, "f h w"], full: float) -> Float[np.ndarray, "f h w"]:
    """Each frame's errors over their own 98th percentile, which counts as ``full``."""
    top = np.percentile(errors, FULL_PERCENTILE, axis=(1, 2), keepdims=True)
    return (full * errors / np.maximum(top, 1e-6)).astype(errors.dtype)
