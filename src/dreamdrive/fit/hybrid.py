"""The joint fit of static and dynamic Gaussians (eq. 11-14), and its two baselines."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import torch

from dreamdrive.fit.densify import DensifySettings, GradientDensifier
from dreamdrive.fit.parameters import LearningRates, Parameters
from dreamdrive.fit.static import StaticFit, footprints
from dreamdrive.fit.trainer import FitOptions, Model, Progress, optimise
from dreamdrive.fit.views import training_views
from dreamdrive.scene.actor import Actor
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.deformation import DeformationConfig, DeformationField, Domain, Tracks
from dreamdrive.scene.exposure import ExposureNetwork
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene

Representation = Literal["static", "deformable", "hybrid"]


@dataclass(frozen=True)
class Parts:
    """What a scene is fitted from.

    Attributes:
        static: Gaussians free of time; may be empty.
        dynamic: Gaussians that go through the deformation field; may be empty.
        tracks: Motion of the actors, or None.
        actors: The actors.
    """

    static: Gaussians
    dynamic: Gaussians
    tracks: Tracks | None
    actors: tuple[Actor, ...]


def fit(
    clip: Clip,
    geometry: Geometry,
    parts: Parts,
    start: StaticFit,
    options: FitOptions,
    network: DeformationConfig,
    densify: DensifySettings,
    seed: int,
    progress: Progress,
) -> Scene:
    """Optimise Gaussians, deformation, sky and exposure jointly (eq. 13-14).

    Args:
        clip: References; held-out frames are not read, their exposure is interpolated.
        geometry: Cameras, depth, masks, up axis.
        parts: Static and dynamic Gaussians; with no dynamic ones the result is a static scene.
        start: The static fit, whose sky is kept.
        options: Length, rates and weights.
        network: Size of F_deform.
        densify: When and what to grow and prune.
        seed: Order of the frames, weights, places of split Gaussians.
        progress: Called with steps done and steps in all.
    """
    views = {1: training_views(clip, geometry), 2: training_views(clip, geometry, 2)}
    field = _field(clip, geometry, parts, network, seed) if len(parts.dynamic) else None
    model = Model(
        static=_parameters(parts.static),
        dynamic=_parameters(parts.dynamic),
        deformation=field,
        sky=start.sky,
        exposure=ExposureNetwork(len(clip), seed),
    )
    half_size = (clip.size[0] / 2, clip.size[1] / 2)
    densifiers = [GradientDensifier(densify, len(p), half_size) for p in model.parts()]
    optimise(model, views, densifiers, options, seed, progress)
    empty = parts.static.select(torch.zeros(0, dtype=torch.int64))
    dynamic = model.dynamic.frozen() if model.dynamic is not None else empty
    return Scene(
        static=model.static.frozen() if model.static is not None else empty,
        dynamic=dynamic,
        deformation=None if field is None else field.requires_grad_(False),
        actors=tuple(replace(a, count=_members(dynamic, a.id)) for a in parts.actors),
        sky=start.sky,
        exposure=model.exposure.freeze(clip.times_s, ~clip.held_out),
        cameras=geometry.cameras,
        times_s=clip.times_s,
        held_out=clip.held_out,
    )


def _parameters(gaussians: Gaussians) -> Parameters | None:
    return Parameters(gaussians, footprints(gaussians), LearningRates()) if len(gaussians) else None


def _members(gaussians: Gaussians, actor: int) -> int:
    return 0 if gaussians.actor is None else int((gaussians.actor == actor).sum())


def _field(
    clip: Clip, geometry: Geometry, parts: Parts, network: DeformationConfig, seed: int
) -> DeformationField:
    """F_deform over the space of the dynamic Gaussians and the time of the clip."""
    means = parts.dynamic.means.numpy().astype(np.float64)
    centre = np.median(means, axis=0)
    radius = float(np.quantile(np.linalg.norm(means - centre, axis=1), 0.95))
    up = geometry.ground.normal_world if geometry.ground is not None else np.array([0.0, -1.0, 0.0])
    domain = Domain(centre, max(radius, 1e-3), float(clip.times_s[0]), float(clip.times_s[-1]), up)
    tracks = parts.tracks
    if tracks is not None:
        network = replace(network, actors=len(tracks.pivot_m), track_times=len(tracks.times_s))
    return DeformationField(network, domain, tracks, seed)
