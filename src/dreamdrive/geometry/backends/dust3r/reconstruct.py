"""Reconstruction of a clip with DUSt3R: pairs, pointmaps, alignment."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.compute.device import chosen_device
from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.dust3r.align import (
    Aligned,
    AlignOptions,
    KnownCameras,
    align,
    check_memory,
)
from dreamdrive.geometry.backends.dust3r.network import (
    BUDGET_BYTES,
    Dust3r,
    infer,
    load_dust3r,
    plan_memory,
    resize_crop,
)
from dreamdrive.geometry.backends.dust3r.pairs import PairMaps, make_pairs, video_graph
from dreamdrive.geometry.cameras import stands
from dreamdrive.geometry.depth import above_horizon, sky_mask
from dreamdrive.geometry.evidence import Evidence, free_pixels
from dreamdrive.geometry.finish import begin, finish
from dreamdrive.geometry.measured import Measured, trusted
from dreamdrive.geometry.moving import FLAGGED
from dreamdrive.geometry.options import GeometryOptions
from dreamdrive.geometry.resize import ResizeCrop, in_frames, prepare, prepare_mask
from dreamdrive.progress import Progress, Work
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry

_LEFT = 0.3  # of the usable pixels of a picture, so that it is aligned without what moves
_MOVING = 0.01  # of all usable pixels; less moves no camera
_WORTH_A_NOTE = 0.03  # relative, of the focal length
_NARROWER = ("swin-3-noncyclic", "swin-2-noncyclic")


def reconstruct(clip: Clip, options: GeometryOptions, *, seed: int = 0, work: Work = Work()) -> Geometry:
    """Pointmaps of pairs of frames, aligned, brought to metres; see ``geometry.protocol``.

    Held-out frames take part in the alignment, which poses them; their depth is not handed on. Work is told
    of frames and pairs that the network has seen, then of the alignment.

    Raises:
        InputError: As ``finish.begin`` says; or weights or pointmaps cannot be used.
    """
    path, evidence, shown = begin(clip, "dust3r", options.weights)
    maps, how = _seen(clip, path, lambda done, total: work(done, total + 1))
    usable = _usable(clip, evidence, how)
    maps = maps.masked(tuple(usable))

    def found(still: tuple[Bool[np.ndarray, "h w"], ...] | None) -> Geometry:
        aligned = align(maps, AlignOptions(seed=seed), _known(shown, how), still)
        seen = measured(shown, aligned, how)
        return finish(clip, seen, evidence, options, seed=seed)

    first = found(None)
    still = None if stands(clip, evidence) else _still(first.moving, usable, how)
    return first if still is None else found(tuple(still))


def _seen(clip: Clip, weights: Path, progress: Progress) -> tuple[PairMaps, ResizeCrop]:
    """What the network says of pairs of frames; it is gone from memory afterwards."""
    device = chosen_device()
    network = load_dust3r(weights, bfloat16=device.type == "cuda").to(device)
    how = resize_crop(*clip.size, network.config.image_size)
    pictures = [prepare(frame, how) for frame in clip.frames]
    return infer(network, pictures, planned_pairs(network, len(clip), how.size), progress=progress), how


def planned_pairs(network: Dust3r, frames: int, size: tuple[int, int]) -> Int[np.ndarray, "e 2"]:
    """Pairs of frames: those of ``video_graph``, or of narrower windows where they would not fit.

    They have to fit into the memory allowed through the network and in the alignment.
    """
    sizes = [(size[1], size[0])] * frames
    refused: InputError | None = None
    for graph in (video_graph(frames), *_NARROWER):
        edges = make_pairs(frames, graph)
        try:
            plan_memory(network, sizes, edges, BUDGET_BYTES)
            check_memory(sizes, edges, AlignOptions())
        except InputError as error:
            refused = error
        else:
            return edges
    assert refused is not None
    raise refused


def measured(clip: Clip, aligned: Aligned, how: ResizeCrop) -> Measured:
    """The alignment in pixels of the clip; confidence becomes the share of pixels that are trusted less."""
    width, height = how.size
    focal_px = float(np.median(aligned.focals_px))
    # The network counts pixels from 0 and has its principal point at half the size.
    picture = Camera(focal_px, focal_px, width / 2 + 0.5, height / 2 + 0.5, width, height)
    camera = clip.rig[0] if clip.known.intrinsics else how.frame_camera(picture)
    depth, trust = (in_frames(part, how) for part in (aligned.depth, aligned.confidence))
    there = (trust > 1) & ~clip.held_out[:, None, None]
    depth, confidence = trusted(depth, trust, there)
    notes = [] if aligned.path_observed else ["the pairs do not agree on a path: it is not to be believed"]
    notes += _focal_notes(clip, aligned)
    return Measured(
        world_from_camera=aligned.world_from_camera,
        camera=replace(camera, world_from_camera=np.eye(4)),
        focal_observed=aligned.focal_observed,
        depth=depth,
        confidence=confidence,
        unit="poses" if clip.known.metric and clip.known.world_from_camera is not None else None,
        focal_spread=aligned.focal_error,
        notes=tuple(notes),
        details={
            "pairs_residual": float(np.median(aligned.residual)),
            "focal_spread": aligned.focal_spread,
            "focal_error": aligned.focal_error,
            "focal_over_network": focal_px / aligned.network_focal_px,
            "pair_spread": aligned.pair_spread,
            "masked_share": float(aligned.masked_share.mean()),
        },
    )


def _focal_notes(clip: Clip, aligned: Aligned) -> list[str]:
    """What to know about the focal length, where it is not given."""
    if clip.known.intrinsics:
        return []
    if not aligned.focal_agreed and not aligned.focal_observed:
        return ["the pairs do not agree on a focal length"]
    if not aligned.focal_observed:
        return [
            "the camera turns too little to show its focal length: it is the network's, which may be off by "
            f"{aligned.focal_error:.0%} or more"
        ]
    off = float(np.median(aligned.focals_px)) / aligned.network_focal_px - 1
    if abs(off) < _WORTH_A_NOTE:
        return []
    word = "longer" if off > 0 else "shorter"
    return [f"the turns of the camera show a focal length {abs(off):.1%} {word} than the network's"]


def _usable(clip: Clip, evidence: Evidence, how: ResizeCrop) -> Bool[np.ndarray, "n h w"]:
    """Pixels of the pictures that show the street, and not the sky."""
    free = free_pixels(clip, evidence)
    return np.stack([prepare_mask(one & ~_sky(clip, k, one), how) for k, one in enumerate(free)])


def _still(
    moving: Float[np.ndarray, "n _ _"], usable: Bool[np.ndarray, "n h w"], how: ResizeCrop
) -> Bool[np.ndarray, "n h w"] | None:
    """Usable pixels of the pictures without what was found to move; None where next to nothing does.

    What moves is seen by its depth and the path, so it takes a first alignment with all pixels. A picture in
    which little else is left keeps them. Where movers fill a tenth of drawn streets, the robust cost has
    dealt with them before, and the path stays as good, 0.17 to 0.18 % of its length off with and without;
    one thing that fills a third and goes its own way takes the path along, unless it is left out.
    """
    still = usable & np.stack([prepare_mask(one < FLAGGED, how) for one in moving])
    left = still.sum(axis=(1, 2)) / np.maximum(usable.sum(axis=(1, 2)), 1)
    still = np.where((left < _LEFT)[:, None, None], usable, still)
    return None if still.sum() > (1 - _MOVING) * usable.sum() else still


def _sky(clip: Clip, frame: int, free: Bool[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    """The sky where it is known, else as it looks above a level horizon."""
    if clip.known.sky is not None:
        return clip.known.sky[frame]
    return sky_mask(clip.frames[frame], above_horizon(clip.rig[0].at(np.eye(4)), None), free)


def _known(clip: Clip, how: ResizeCrop) -> KnownCameras:
    intrinsics = None
    if clip.known.intrinsics:
        matrix = how.picture_camera(clip.rig[0]).matrix.copy()
        matrix[:2, 2] -= 0.5  # the alignment counts pixels from 0
        intrinsics = np.tile(matrix, (len(clip), 1, 1))
    return KnownCameras(intrinsics, clip.known.world_from_camera)
