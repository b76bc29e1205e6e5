"""G_init: pixel-aligned points become Gaussians that carry features and their source frame (eq. 4)."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float

from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, pixel_features
from dreamdrive.scene.gaussians import SH_C0, Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.surfels import surfels, tangents


@dataclass(frozen=True)
class SeedOptions:
    """How pixels become Gaussians; what it is worth: docs/results/ablation.md.

    Attributes:
        stride_px: Distance between static seeds of one frame; 1 where the camera stays at one place.
        moving_stride_px: Distance between seeds on pixels with moving evidence, added by every frame.
        reach: Seeds of one moving thing have a neighbour within so many strides: a diagonal is 1.41.
        moving_evidence: Evidence from which a pixel counts as moving for seeding.
        far_m: Depth at which everything farther is put.
        footprint: Standard deviation over the seeds' spacing.
        agreement: Relative depth difference within which an older seed already explains a pixel.
        sky_fringe_px: Width of the band beside the sky that seeds nothing: half-sky pixels are seen most.
        sh_degree: Degree of the spherical harmonics that are kept.
    """

    stride_px: int = 2
    moving_stride_px: int = 3
    reach: float = 1.5
    moving_evidence: float = 0.5
    far_m: float = 250.0
    footprint: float = 0.55
    agreement: float = 0.08
    sky_fringe_px: int = 1
    sh_degree: int = 1

    @property
    def reach_px(self) -> float:
        """How far apart in their image neighbouring seeds on a moving thing are at most."""
        return self.reach * self.moving_stride_px


def initialise(clip: Clip, geometry: Geometry, options: SeedOptions | None = None) -> Gaussians:
    """Seed Gaussians from the depth of all frames that may be seen.

    Frames are taken from the last to the first, since a forward drive sees each surface finest just before it
    leaves the view; a frame adds only what later frames have not explained yet. Pixels with moving evidence
    are added by every frame: a moving thing stands somewhere else in each of them.

    Args:
        clip: Frames and features; held-out frames are not read.
        geometry: Depth, confidence, sky and moving evidence.
        options: Density and sizes of the seeds.

    Returns:
        Gaussians with features Z_ref, see ``scene.clip.pixel_features``.

    Raises:
        InputError: No pixel of any frame has depth.
    """
    options = options or SeedOptions()
    if geometry.at_one_place:
        options = replace(options, stride_px=1)
    kept: list[_Seeds] = []
    for frame in np.flatnonzero(~clip.held_out)[::-1].tolist():
        usable = _usable(clip, geometry, frame, options)
        moving = usable & (geometry.moving[frame] >= options.moving_evidence)
        explained = _explained(kept, geometry.cameras[frame], geometry.depth_m[frame], options)
        static = usable & ~moving & ~explained
        chosen = (_lattice(static.shape, options.stride_px, frame) & static) | (
            _lattice(static.shape, options.moving_stride_px, frame) & moving
        )
        if chosen.any():
            kept.append(_seeds(clip, geometry, frame, chosen, moving[chosen], options))
    if not kept:
        raise InputError(
            "no frame shows anything solid: all of it is sky, fixed to the camera or without a picture; "
            "choose other --frames"
        )
    return _gaussians(kept, options)


@dataclass(frozen=True)
class _Seeds:
    """Points of one frame."""

    points: Float[np.ndarray, "m 3"]
    tangents: Float[np.ndarray, "m 2 3"]
    spacing_m: Float[np.ndarray, " m"]
    colour: Float[np.ndarray, "m 3"]
    confidence: Float[np.ndarray, " m"]
    moving: Bool[np.ndarray, " m"]
    features: Float[np.ndarray, "m c"]
    frame: int


def _usable(clip: Clip, geometry: Geometry, frame: int, options: SeedOptions) -> Bool[np.ndarray, "h w"]:
    sky = geometry.sky[frame].astype(np.uint8)
    if options.sky_fringe_px:
        size = 2 * options.sky_fringe_px + 1
        sky = cv2.dilate(sky, np.ones((size, size), np.uint8))
    free = clip.valid[frame] & (geometry.fixed_regions[clip.camera[frame]] == 0) & (sky == 0)
    return free & (geometry.depth_m[frame] > 0)


def _lattice(shape: tuple[int, int], stride: int, frame: int) -> Bool[np.ndarray, "h w"]:
    """Every ``stride``-th pixel; the phase changes with the frame so that copies do not line up."""
    lattice = np.zeros(shape, dtype=bool)
    phase = frame % stride
    lattice[phase::stride, (stride - 1 - phase) :: stride] = True
    return lattice


def _explained(
    kept: list[_Seeds], camera: Camera, depth_m: Float[np.ndarray, "h w"], options: SeedOptions
) -> Bool[np.ndarray, "h w"]:
    """Pixels beside which a static seed of comparable size already lies, not behind what is seen there."""
    shape = (camera.height_px, camera.width_px)
    nearest = np.full(shape, np.inf, dtype=np.float32)
    for seeds in kept:
        static = ~seeds.moving
        projected = camera.project(seeds.points[static])
        u, v, z = np.floor(projected[:, 0]), np.floor(projected[:, 1]), np.maximum(projected[:, 2], 1e-6)
        fine = seeds.spacing_m[static] / z * camera.fx_px < 2.0 * options.stride_px
        inside = camera.shows(projected) & fine
        np.minimum.at(nearest, (v[inside].astype(int), u[inside].astype(int)), z[inside].astype(np.float32))
    reach = 2 * options.stride_px - 1
    around = cv2.erode(nearest, np.ones((reach, reach), np.uint8), borderValue=float("inf"))
    return around < depth_m * (1 + options.agreement)


def _seeds(
    clip: Clip,
    geometry: Geometry,
    frame: int,
    chosen: Bool[np.ndarray, "h w"],
    moving: Bool[np.ndarray, " m"],
    options: SeedOptions,
) -> _Seeds:
    camera = geometry.cameras[frame]
    depth = np.minimum(geometry.depth_m[frame], options.far_m).astype(np.float64)
    stride = np.where(moving, options.moving_stride_px, options.stride_px)
    rotation = camera.world_from_camera[:3, :3]
    points = camera.rays() * depth[..., None]
    steps = tangents(camera, depth)[chosen] * stride[:, None, None]
    return _Seeds(
        points=points[chosen] @ rotation.T + camera.world_from_camera[:3, 3],
        tangents=steps @ rotation.T,
        spacing_m=depth[chosen] / camera.fx_px * stride,
        colour=clip.frames[frame][chosen].astype(np.float64) / 255,
        confidence=geometry.confidence[frame][chosen],
        moving=moving,
        features=pixel_features(clip, geometry, frame)[chosen],
        frame=frame,
    )


def _gaussians(kept: list[_Seeds], options: SeedOptions) -> Gaussians:
    steps = np.concatenate([s.tangents for s in kept])
    spacing = np.concatenate([s.spacing_m for s in kept])
    rotations, extents = surfels(steps, spacing)
    scales = extents * options.footprint
    colour = np.concatenate([s.colour for s in kept])
    confidence = np.concatenate([s.confidence for s in kept])
    coefficients = (options.sh_degree + 1) ** 2
    sh = np.zeros((len(colour), coefficients, 3))
    sh[:, 0] = (colour - 0.5) / SH_C0
    opacity = 0.25 + 0.5 * np.clip(confidence, 0, 1)
    return Gaussians(
        means=_tensor(np.concatenate([s.points for s in kept])),
        quaternions=_tensor(rotations),
        log_scales=_tensor(np.log(scales)),
        logit_opacities=_tensor(np.log(opacity / (1 - opacity))),
        sh=_tensor(sh),
        source_frame=torch.tensor(np.concatenate([np.full(len(s.points), s.frame) for s in kept])),
        features=_tensor(np.concatenate([s.features for s in kept])),
    )


def _tensor(values: np.ndarray) -> Float[torch.Tensor, "..."]:
    return torch.tensor(values, dtype=torch.float32)
