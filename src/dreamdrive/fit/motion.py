"""How each representation of motion starts: from the clip, its geometry and the Gaussians that move."""

from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float

from dreamdrive.scene.clip import Clip
from dreamdrive.scene.deformation import DeformationConfig, DeformationField, Domain, Tracks
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.hexplane import Bounds, HexPlaneConfig, HexPlaneField
from dreamdrive.scene.motion import Motion
from dreamdrive.scene.vibration import Vibration, VibrationConfig

MotionConfig = DeformationConfig | HexPlaneConfig | VibrationConfig
"""Its type says which representation is fitted."""

# Share of the Gaussians beyond each side of a hexplane's box: a few are at the far end of the street, and
# nodes that reach out to them are missing nearby.
OUTSIDE = 0.01


def start_motion(
    clip: Clip,
    geometry: Geometry,
    dynamic: Gaussians,
    tracks: Tracks | None,
    config: MotionConfig,
    seed: int,
) -> tuple[Motion, Gaussians]:
    """What moves the Gaussians, before any step, and they themselves with what it needs of each.

    Args:
        clip: The frames' times.
        geometry: The up axis.
        dynamic: What moves; at least one.
        tracks: Motion of the actors, or None; a deformation field alone takes them.
        config: Which representation, and its size.
        seed: Of initial weights.

    Raises:
        ValueError: There are tracks, and the representation knows none.
    """
    if isinstance(config, DeformationConfig):
        return _field(clip, geometry, dynamic, tracks, config, seed), dynamic
    if tracks is not None:
        raise ValueError(f"motion: {type(config).__name__} knows no tracks of actors")
    if isinstance(config, HexPlaneConfig):
        return _planes(clip, dynamic, config, seed), dynamic
    config = replace(config, interval_s=_interval_s(clip))
    return Vibration(config), _swinging(clip, dynamic, config)


def _field(
    clip: Clip,
    geometry: Geometry,
    dynamic: Gaussians,
    tracks: Tracks | None,
    network: DeformationConfig,
    seed: int,
) -> DeformationField:
    """F_deform over the space of the dynamic Gaussians and the time of the clip."""
    means = _means(dynamic)
    centre = np.median(means, axis=0)
    radius = float(np.quantile(np.linalg.norm(means - centre, axis=1), 0.95))
    up = geometry.ground.normal_world if geometry.ground is not None else np.array([0.0, -1.0, 0.0])
    domain = Domain(centre, max(radius, 1e-3), float(clip.times_s[0]), float(clip.times_s[-1]), up)
    if tracks is not None:
        network = replace(network, actors=len(tracks.pivot_m), track_times=len(tracks.times_s))
    return DeformationField(network, domain, tracks, seed)


def _planes(clip: Clip, dynamic: Gaussians, config: HexPlaneConfig, seed: int) -> HexPlaneField:
    """Planes over the box that holds nearly all Gaussians and over the time of the clip."""
    low, high = np.quantile(_means(dynamic), [OUTSIDE, 1 - OUTSIDE], axis=0)
    bounds = Bounds(low, np.maximum(high, low + 1e-3), float(clip.times_s[0]), float(clip.times_s[-1]))
    config = replace(config, times=max(2, len(clip) // 2), coefficients=dynamic.sh.shape[1])
    return HexPlaneField(config, bounds, seed)


def _swinging(clip: Clip, dynamic: Gaussians, config: VibrationConfig) -> Gaussians:
    """Gaussians at rest that are seen best in the frame they come from, as PVG starts from LiDAR points."""
    peak_s = torch.from_numpy(clip.times_s)[dynamic.source_frame].to(torch.float32)
    span_s = torch.full_like(peak_s, config.span_frames * config.interval_s)
    return replace(
        dynamic, velocity=torch.zeros_like(dynamic.means), lifespan=torch.stack([peak_s, span_s], dim=1)
    )


def _interval_s(clip: Clip) -> float:
    return float(np.median(np.diff(np.unique(clip.times_s))))


def _means(gaussians: Gaussians) -> Float[np.ndarray, "n 3"]:
    return gaussians.means.numpy().astype(np.float64)
