"""A clip through DUSt3R: pairs, pointmaps, alignment."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Int

from dreamdrive.errors import InputError
from dreamdrive.geometry.classical import contradiction
from dreamdrive.geometry.classical.evidence import Evidence, free_pixels, look
from dreamdrive.geometry.dust3r.align.aligned import Aligned
from dreamdrive.geometry.dust3r.align.alignment import AlignOptions, Known, align
from dreamdrive.geometry.dust3r.align.memory import check_budget, predicted_bytes
from dreamdrive.geometry.dust3r.network.checkpoint import load_dust3r
from dreamdrive.geometry.dust3r.network.images import fitting
from dreamdrive.geometry.dust3r.network.inference import infer
from dreamdrive.geometry.dust3r.pairmaps import PairMaps
from dreamdrive.geometry.dust3r.pairs import make_pairs, video_graph
from dreamdrive.geometry.finish import finish
from dreamdrive.geometry.fitting import Fitting, in_frames, prepare, prepare_mask
from dreamdrive.geometry.frames import check_frames
from dreamdrive.geometry.measured import Measured, trusted
from dreamdrive.geometry.standing import stands, without_poses
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry

_NARROWER = ("swin-3-noncyclic", "swin-2-noncyclic")


def reconstruct(
    clip: Clip, *, camera_height_m: float | None = None, seed: int = 0, weights: Path | None = None
) -> Geometry:
    """Pointmaps of pairs of frames, aligned, brought to metres; see ``geometry.protocol``.

    Held-out frames take part in the alignment, which poses them; their depth is not handed on.

    Args:
        clip: Frames of one camera.
        camera_height_m: Height of the camera above the road; None assumes 1.5 m.
        seed: Seed of everything random.
        weights: The network: a ``.pth`` of the authors, or the folder of its hub form.

    Raises:
        InputError: No weights, frames as ``frames.check_frames`` refuses them, known poses that contradict
            them, or weights or pointmaps that cannot be used.
    """
    if weights is None:
        raise InputError("geometry dust3r needs the weights of its network")
    check_frames(clip, "dust3r")
    network = load_dust3r(weights)
    evidence = look(clip)
    contradiction.check(clip, evidence)
    # Of a standing camera the path is noise, in which no unit can be read.
    shown = without_poses(clip) if stands(clip, evidence) else clip
    how = fitting(*clip.size, network.config.image_size)
    pictures = [prepare(frame, how) for frame in clip.frames]
    maps = infer(network, pictures, planned_pairs(len(clip), how.size))
    aligned = align(masked(maps, _usable(clip, evidence, how)), AlignOptions(seed=seed), _known(shown, how))
    return finish(clip, measured(shown, aligned, how), evidence, camera_height_m=camera_height_m, seed=seed)


def planned_pairs(frames: int, size: tuple[int, int]) -> Int[np.ndarray, "e 2"]:
    """Pairs (E, 2) of frames: those of ``video_graph``, or of narrower windows where they would not fit.

    Args:
        frames: Number of frames.
        size: Width and height of the pictures.

    Raises:
        InputError: Not even the alignment of pairs of close neighbours fits into the memory allowed.
    """
    options = AlignOptions()
    budget = int(options.memory_gb * 1e9)
    sizes = [(size[1], size[0])] * frames
    choices = [make_pairs(frames, graph) for graph in (video_graph(frames), *_NARROWER)]
    needs = [predicted_bytes(sizes, edges, options.samples_per_image) for edges in choices]
    chosen = next((k for k, need in enumerate(needs) if need <= budget), len(choices) - 1)
    check_budget(needs[chosen], budget, frames, len(choices[chosen]))
    return choices[chosen]


def masked(maps: PairMaps, usable: Bool[np.ndarray, "n h w"]) -> PairMaps:
    """The pairs with a confidence of 1, which weighs nothing, where an image (N, H, W) is not usable."""
    confidence = tuple(
        (np.where(usable[i], first, np.float32(1)), np.where(usable[j], second, np.float32(1)))
        for (i, j), (first, second) in zip(maps.edges.tolist(), maps.confidence, strict=True)
    )
    return replace(maps, confidence=confidence)


def measured(clip: Clip, aligned: Aligned, how: Fitting) -> Measured:
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
    if not aligned.focal_observed:
        notes.append("the pairs do not agree on a focal length")
    return Measured(
        world_from_camera=aligned.world_from_camera,
        camera=replace(camera, world_from_camera=np.eye(4)),
        focal_observed=aligned.focal_observed,
        depth=depth,
        confidence=confidence,
        unit="poses" if clip.known.metric and clip.known.world_from_camera is not None else None,
        notes=tuple(notes),
        details={
            "pairs_residual": float(np.median(aligned.residual)),
            "focal_spread": aligned.focal_spread,
            "pair_spread": aligned.pair_spread,
            "masked_share": float(aligned.masked_share.mean()),
        },
    )


def _usable(clip: Clip, evidence: Evidence, how: Fitting) -> Bool[np.ndarray, "n h w"]:
    """Pixels of the pictures that show the street."""
    return np.stack([prepare_mask(one, how) for one in free_pixels(clip, evidence)])


def _known(clip: Clip, how: Fitting) -> Known:
    intrinsics = None
    if clip.known.intrinsics:
        matrix = how.picture_camera(clip.rig[0]).matrix.copy()
        matrix[:2, 2] -= 0.5  # the alignment counts pixels from 0
        intrinsics = np.tile(matrix, (len(clip), 1, 1))
    return Known(intrinsics, clip.known.world_from_camera)
