"""Figures of held-out frames, beside those of baselines that need no scene."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float, UInt8

from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import render_scene, ssim_map
from dreamdrive.vision.flow import in_between


@dataclass(frozen=True)
class Likeness:
    """PSNR in decibels, of values in [0, 1], and SSIM, with a window of 11 pixels and a deviation of 1.5."""

    psnr: float
    ssim: float


Predictor = Callable[[Clip, int], Float[np.ndarray, "h w 3"]]
"""Guesses a held-out frame of a clip, by index, from the frames that may be seen."""


def score_scene(clip: Clip, geometry: Geometry, scene: Scene) -> dict[int, Likeness]:
    """Likeness of the scene's view of each held-out frame, by index in the clip."""

    def rendered(clip: Clip, frame: int) -> Float[np.ndarray, "h w 3"]:
        camera, of_rig = geometry.cameras[frame], int(clip.camera[frame])
        return render_scene(scene, camera, float(clip.times_s[frame]), of_rig=of_rig).colour.numpy()

    return _score(clip, geometry, rendered)


def score_baselines(clip: Clip, geometry: Geometry) -> dict[str, dict[int, Likeness]]:
    """Likeness of what ``BASELINES`` predict for each held-out frame."""
    return {name: _score(clip, geometry, predict) for name, predict in BASELINES.items()}


def _score(clip: Clip, geometry: Geometry, predict: Predictor) -> dict[int, Likeness]:
    street = geometry.fixed_regions[clip.camera] == 0
    held_out = np.flatnonzero(clip.held_out).tolist()
    return {i: likeness(predict(clip, i), clip.frames[i], clip.valid[i] & street[i]) for i in held_out}


def likeness(
    image: Float[np.ndarray, "h w 3"], frame: UInt8[np.ndarray, "h w 3"], mask: Bool[np.ndarray, "h w"]
) -> Likeness:
    """Compare an image in [0, 1] with a recorded frame where ``mask`` is set.

    The image is rounded to 8 bits first, as it would be on disk. Outside the mask it counts as met, so that
    what lies there does not leak in through the window of the similarity.
    """
    if not mask.any():
        raise ValueError("no pixel to compare")
    reference = frame.astype(np.float32) / 255
    image = np.rint(np.clip(image, 0, 1) * 255).astype(np.float32) / 255
    image = np.where(mask[..., None], image, reference)
    squared = float(np.mean((image[mask].astype(np.float64) - reference[mask]) ** 2))
    similarity = ssim_map(torch.from_numpy(image), torch.from_numpy(reference)).numpy()
    return Likeness(float(-10 * np.log10(max(squared, 1e-10))), float(similarity[mask].mean()))


def repeat_previous(clip: Clip, frame: int) -> Float[np.ndarray, "h w 3"]:
    """The last frame before it that may be seen."""
    return clip.frames[_neighbours(clip, frame)[0]].astype(np.float32) / 255


def average_neighbours(clip: Clip, frame: int) -> Float[np.ndarray, "h w 3"]:
    """The mean of the nearest frames before and after."""
    before, after = _neighbours(clip, frame)
    return (clip.frames[before].astype(np.float32) + clip.frames[after].astype(np.float32)) / 510


def interpolate_flow(clip: Clip, frame: int) -> Float[np.ndarray, "h w 3"]:
    """Both neighbours carried along dense optical flow, see ``decompose.flow``."""
    before, after = _neighbours(clip, frame)
    return in_between(clip, before, frame, after)


BASELINES: dict[str, Predictor] = {
    "repeat_previous": repeat_previous,
    "average_neighbours": average_neighbours,
    "flow_interpolation": interpolate_flow,
}
"""Predictions that know nothing of space."""


def _neighbours(clip: Clip, frame: int) -> tuple[int, int]:
    seen = np.array(clip.seen_of(int(clip.camera[frame])))
    return int(seen[seen < frame].max()), int(seen[seen > frame].min())
