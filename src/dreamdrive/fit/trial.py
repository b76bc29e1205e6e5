"""Trial fits: how well a geometry predicts frames that a small fit has not seen."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil
from typing import Any

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float

from dreamdrive.compute.device import CPU
from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.fit.initialise import SeedOptions, initialise
from dreamdrive.fit.static import fit_static
from dreamdrive.fit.trainer import FitOptions
from dreamdrive.progress import silent
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry


@dataclass(frozen=True)
class TrialOptions:
    """A small static fit to some of the frames; what it is worth: docs/results/ablation.md.

    Attributes:
        withheld: Every so many of the frames that may be seen are withheld from it.
        width_px: Width of its pictures at most.
        visits: Steps for each frame that it sees.
        stereo_db: PSNR in dB by which stereo's depth has to predict withheld frames better than a network's.
    """

    withheld: int = 4
    width_px: int = 240
    visits: float = 5.0
    stereo_db: float = 0.3


@dataclass(frozen=True)
class Trial:
    """What a trial fit makes of the frames that were withheld from it.

    Attributes:
        clip: The clip at the size of the trial; what the trial did not see is held out.
        frames: The withheld frames.
        errors: Mean absolute difference over colours, in [0, 1], of each of them (K, h, w).
        judged: Pixels of the street (K, h, w); the sky is among them, since what is taken for it may be the
            roof of a tunnel.
    """

    clip: Clip
    frames: tuple[int, ...]
    errors: Float[np.ndarray, "k h w"]
    judged: Bool[np.ndarray, "k h w"]

    @property
    def psnr_db(self) -> float:
        """Of what is judged, over all withheld frames, from absolute differences."""
        return -10 * np.log10(max(float((self.errors[self.judged] ** 2).mean()), 1e-10))


def better_depth(
    clip: Clip,
    geometry: Geometry,
    seeds: SeedOptions,
    options: TrialOptions,
    seed: int,
    stands: Callable[[Trial], bool],
    device: torch.device = CPU,
) -> tuple[Geometry, Trial | None]:
    """The geometry with that of its two depths which predicts withheld frames better, and its trial.

    What a network makes of a street is a guess, which frames check; what both scored stands in its details.
    Stereo takes its place only where the street then ``stands``: where no street explains the frames it is
    noise. Without a second depth, or where too little is seen to judge, there is no trial.
    """
    ratio, trust = geometry.stereo_ratio, geometry.stereo_confidence
    fused = replace(geometry, stereo_ratio=None, stereo_confidence=None)
    if ratio is None or trust is None:
        return fused, None
    stereo = replace(fused, depth_m=ratio * geometry.depth_m, confidence=trust)
    first, second = (trial(clip, each, seeds, options, seed, device) for each in (fused, stereo))
    if first is None or second is None:
        return fused, None
    scores = {"fused": round(first.psnr_db, 2), "stereo": round(second.psnr_db, 2)}
    better = scores["stereo"] > scores["fused"] + options.stereo_db
    taken = "stereo" if better and stands(second) else "fused"
    chosen, found = (stereo, second) if taken == "stereo" else (fused, first)
    return replace(chosen, details={**chosen.details, "depth_trial_db": scores, "depth": taken}), found


@one_torch_thread()
def trial(
    clip: Clip,
    geometry: Geometry,
    seeds: SeedOptions,
    options: TrialOptions,
    seed: int,
    device: torch.device = CPU,
) -> Trial | None:
    """Fit a street that stands to most of the frames that may be seen, small and short; judge the others.

    What moves is no part of it: smeared over the street it would hide what stands. Where road users are
    known, only they are left out: what else moves, as seen from behind a handlebar, is a street that was
    not understood. None where that leaves too few frames to fit, or nothing to judge.
    """
    seen = np.flatnonzero(~clip.held_out)
    frames = tuple(seen[options.withheld // 2 :: options.withheld].tolist())
    small, shown = _reduced(clip, geometry, options.width_px)
    held_out = small.held_out.copy()
    held_out[list(frames)] = True
    if not frames or (~held_out).sum() < 2:
        return None
    small = replace(small, held_out=held_out)
    gaussians = initialise(small, shown, seeds)
    steps = ceil(options.visits * (~held_out).sum())
    fitted = fit_static(small, shown, gaussians, FitOptions(steps=steps), seed, silent, device).on(device)
    picture = fitted.pictures(small, shown)
    found = torch.stack([picture(i) for i in frames]).cpu().numpy()
    each = list(frames)
    errors = np.abs(found - small.frames[each] / np.float32(255)).mean(axis=3)
    judged = small.valid[each] & (shown.fixed_regions[small.camera[each]] == 0)
    return Trial(small, frames, errors, judged) if judged.any() else None


def _reduced(clip: Clip, geometry: Geometry, width_px: int) -> tuple[Clip, Geometry]:
    """Clip and geometry with pictures of at most that width, of the street alone."""
    width, height = clip.size
    size = min(width_px, width), max(1, round(height * min(width_px, width) / width))

    def near(maps: np.ndarray) -> np.ndarray:
        kind = np.uint8 if maps.dtype == bool else maps.dtype
        resized = [cv2.resize(each.astype(kind), size, interpolation=cv2.INTER_NEAREST) for each in maps]
        return np.stack(resized).astype(maps.dtype)

    moves = geometry.moving >= 0.5
    if geometry.road_users is not None:
        moves &= geometry.road_users > 0
    frames = np.stack([cv2.resize(each, size, interpolation=cv2.INTER_AREA) for each in clip.frames])
    small = replace(
        clip,
        frames=frames,
        valid=near(clip.valid & ~moves),
        rig=tuple(camera.resized(*size) for camera in clip.rig),
        features={},
        latents=None,
        known=type(clip.known)(),
        set_in_motion=None,
        looks=(),
    )
    maps: dict[str, Any] = {name: near(getattr(geometry, name)) for name in ("depth_m", "confidence", "sky")}
    regions = near(geometry.fixed_regions.astype(np.int32))
    cameras = tuple(camera.resized(*size) for camera in geometry.cameras)
    maps["moving"] = np.zeros_like(maps["confidence"])
    maps |= dict.fromkeys(("spread", "road_users", "stereo_ratio", "stereo_confidence"))
    return small, replace(geometry, cameras=cameras, fixed_regions=regions, **maps)
