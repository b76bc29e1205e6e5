"""Reconstruction of a clip with a network that sees many frames at once."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Bool, Float

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.feedforward.chunks import Joined, chunks, join
from dreamdrive.geometry.backends.feedforward.network import (
    FeedforwardResult,
    Network,
    Views,
    fit_patches,
    show,
)
from dreamdrive.geometry.cameras import unit_in
from dreamdrive.geometry.evidence import free_pixels
from dreamdrive.geometry.finish import begin, finish
from dreamdrive.geometry.measured import Measured, trusted
from dreamdrive.geometry.options import GeometryOptions
from dreamdrive.geometry.resize import ResizeCrop, in_frames, prepare_mask
from dreamdrive.progress import Progress, Work, silent
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.similarity import nearest_rotation

_FOCAL_SPREAD = 0.2  # of the logarithm; beyond it the frames speak of different cameras
_FOCAL_APART = 0.1  # relative
_CHUNK_MISS = 0.1  # relative to depth


@dataclass(frozen=True)
class FeedForward:
    """Reconstruct by such a network, loaded from the file or folder of its weights.

    See ``geometry.protocol.Reconstruct``.
    """

    name: str  # for messages
    load: Callable[[Path], Network]
    long_side_px: int  # of the pictures that it is shown, a multiple of 14
    chunk: int = 24  # frames that it is shown at once
    overlap: int = 8  # frames that two chunks share

    def __call__(
        self, clip: Clip, options: GeometryOptions, *, seed: int = 0, work: Work = Work()
    ) -> Geometry:
        """Cameras and depth of the network, brought to metres.

        Held-out frames are seen, which poses them; their depth is not handed on. What the network measured is
        kept.

        Raises:
            InputError: As ``finish.begin`` says; or weights or results cannot be used.
        """
        path, evidence, shown = begin(clip, self.name, options.weights)
        free = free_pixels(clip, evidence)
        found = work.keep("measured", lambda: self.measure(shown, free, path, seed, work))
        return finish(clip, found, evidence, options, seed=seed)

    def measure(
        self,
        clip: Clip,
        free: Bool[np.ndarray, "f h w"],
        weights: Path,
        seed: int = 0,
        progress: Progress = silent,
    ) -> Measured:
        """Cameras and depth of the network, in its unit or that of known poses.

        ``free`` are pixels that show the street. Progress is told after each chunk of frames; a last step is
        left for what follows.
        """
        how = fit_patches(*clip.size, self.long_side_px)
        with torch.random.fork_rng(range(torch.cuda.device_count())):
            torch.manual_seed(seed)
            network = self.load(weights)
            parts: list[tuple[range, FeedforwardResult]] = []
            cut = chunks(len(clip), self.chunk, self.overlap)
            for frames in cut:
                parts.append((frames, _see(network, clip, frames, how)))
                progress(len(parts), len(cut) + 1)
        own, spread = share(np.concatenate([seen.intrinsics for _, seen in parts]), how)
        camera = clip.rig[0] if clip.known.intrinsics else own
        usable = np.stack([prepare_mask(one, how) for one in free])
        joined = join(parts, how.picture_camera(camera), usable, clip.source_index)
        return _measured(clip, joined, camera, (own.fx_px, spread), free, how, network)


def _measured(
    clip: Clip,
    joined: Joined,
    camera: Camera,
    focal: tuple[float, float],
    free: Bool[np.ndarray, "f h w"],
    how: ResizeCrop,
    network: Network,
) -> Measured:
    """What was seen, in pixels of the clip; confidence becomes the share of pixels that are trusted less.

    Known poses are kept, and give the depth their unit. ``focal`` is the network's focal length in pixels of
    the clip, and its spread.
    """
    poses, factor, others = joined.world_from_camera, 1.0, dict[str, float]()
    unit, spread = network.unit, network.unit_spread
    if clip.known.world_from_camera is not None:
        poses = clip.known.world_from_camera.astype(np.float64)
        there = joined.depth[joined.depth > 0]
        middle = float(np.median(there)) if len(there) else 0.0
        both = clip.known.metric and network.unit is not None
        factor = unit_in(poses, joined.world_from_camera, middle, metric=both)
        others = {} if network.unit is None else {network.unit: 1 / factor}
        unit, spread = ("poses" if clip.known.metric else None), 0.0
    depth, trust = (in_frames(tuple(part), how) for part in (joined.depth, joined.confidence))
    there = np.isfinite(depth) & (depth > 0) & free & ~clip.held_out[:, None, None]
    depth, confidence = trusted(depth * np.float32(factor), trust, there)
    return Measured(
        world_from_camera=poses,
        camera=replace(camera, world_from_camera=np.eye(4)),
        focal_observed=clip.known.intrinsics or focal[1] <= _FOCAL_SPREAD,
        depth=depth,
        confidence=confidence,
        unit=unit,
        unit_spread=spread,
        others=others,
        notes=tuple(_notes(clip, joined, *focal)),
        details={
            "focal_by_network_px": focal[0],
            "focal_spread": focal[1],
            "chunk_scales": joined.scales.tolist(),
            "chunk_miss": joined.miss.tolist(),
        },
    )


def _see(network: Network, clip: Clip, frames: range, how: ResizeCrop) -> FeedforwardResult:
    """One chunk through the network."""
    own = slice(frames.start, frames.stop)
    poses = clip.known.world_from_camera
    views = Views(
        show(clip.frames[own], how),
        how.picture_camera(clip.rig[0]) if clip.known.intrinsics else None,
        None if poses is None else poses[own],
        clip.known.metric,
    )
    with torch.inference_mode():
        seen = network.predict(views)
    depth = np.where(np.isfinite(seen.depth) & (seen.depth > 0), seen.depth, 0).astype(np.float32)
    seen = replace(seen, depth=depth)
    return seen if views.camera is None else seen_through(seen, views.camera)


def share(intrinsics: Float[np.ndarray, "n 3 3"], how: ResizeCrop) -> tuple[Camera, float]:
    """The pinhole of the frames that took all pictures, with square pixels, and how far they disagree.

    It is the median of all pinholes, and of both axes for the focal length; the disagreement is the robust
    standard deviation (1.4826 times the median distance) of the logarithm of the focal lengths.
    """
    focals_px = intrinsics[:, [0, 1], [0, 1]] * np.divide(how.frame_size, how.size)
    if not (focals_px > 0).all() or not np.isfinite(intrinsics).all():
        raise InputError("the network gives focal lengths that are not positive: are these its weights?")
    focal_px = float(np.median(focals_px))
    spread = 1.4826 * float(np.median(np.abs(np.log(focals_px / focal_px))))
    cx_px, cy_px = how.to_frame(np.median(intrinsics[:, :2, 2], axis=0))
    return Camera(focal_px, focal_px, float(cx_px), float(cy_px), *how.frame_size), spread


def seen_through(seen: FeedforwardResult, camera: Camera) -> FeedforwardResult:
    """What a network saw through pinholes of its own, as it is through the known one of the pictures.

    Networks that cannot be told have the principal point in the middle. What they see is right for a camera
    that looks along the middle of the picture: it is turned to look along the true axis, by the rotation that
    brings the rays of all pixels nearest together. What a rotation does not mend, a focal length of their
    own, stays.
    """
    poses, depth = seen.world_from_camera.copy(), np.empty_like(seen.depth)
    rays = camera.rays()
    towards = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    for frame, matrix in enumerate(seen.intrinsics):
        size = camera.width_px, camera.height_px
        own = Camera(matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *size).rays()
        own_towards = own / np.linalg.norm(own, axis=-1, keepdims=True)
        turn = nearest_rotation(np.einsum("hwi,hwj->ij", own_towards, towards))
        poses[frame, :3, :3] = poses[frame, :3, :3] @ turn
        depth[frame] = seen.depth[frame] * (own @ turn[:, 2])
    return replace(seen, world_from_camera=poses, depth=depth)


def _notes(clip: Clip, joined: Joined, own_focal_px: float, spread: float) -> list[str]:
    notes = []
    if spread > _FOCAL_SPREAD:
        notes.append("the frames do not agree on a focal length")
    focal_px = clip.rig[0].fx_px
    if clip.known.intrinsics and abs(own_focal_px / focal_px - 1) > _FOCAL_APART:
        notes.append(f"the network sees a focal length of {own_focal_px:.0f} px, not {focal_px:.0f}")
    if (joined.miss > _CHUNK_MISS).any():
        notes.append(f"chunks of frames miss each other by {joined.miss.max():.0%} of the depth")
    return notes
