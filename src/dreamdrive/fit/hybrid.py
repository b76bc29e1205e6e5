"""The joint fit of static and dynamic Gaussians (eq. 11-14), and its baselines."""

from dataclasses import dataclass, replace

import torch

from dreamdrive.compute.device import CPU
from dreamdrive.fit.densify import DENSIFIERS, DensifySettings
from dreamdrive.fit.exposure import ExposureNetwork
from dreamdrive.fit.memory import check_holds, size_of
from dreamdrive.fit.parameters import LearningRates, Parameters
from dreamdrive.fit.static import StaticFit, footprints
from dreamdrive.fit.trainer import FitOptions, Model, optimise
from dreamdrive.fit.views import training_views
from dreamdrive.motion import Motion, MotionConfig, Start, Tracks, start_motion
from dreamdrive.progress import Progress
from dreamdrive.scene.actor import Actor
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene


@dataclass(frozen=True)
class Parts:
    """What a scene is fitted from.

    Attributes:
        static: Gaussians free of time; may be empty.
        dynamic: Gaussians that move; may be empty.
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
    motion: MotionConfig,
    densify: DensifySettings,
    seed: int,
    progress: Progress,
    device: torch.device = CPU,
) -> Scene:
    """Optimise Gaussians, motion and exposure jointly (eq. 13-14).

    All motions take ``options.steps`` steps from the same static fit, whose sky is kept; the paper's is
    F_deform. Held-out frames are not read, their exposure is interpolated. Without dynamic Gaussians the
    result is a static scene. It is computed on ``device``; the scene is on the CPU.

    Raises:
        InputError: The memory of a CUDA device cannot hold it.
    """
    most = 0 if densify.strategy == "none" else densify.most
    check_holds(device, size_of(clip, parts.static, parts.dynamic, motion, most))
    views = training_views(clip, geometry, device)
    moving, dynamic = None, parts.dynamic
    if len(dynamic):
        moving, dynamic = start_motion(motion, Start(clip, geometry, dynamic, parts.tracks, seed))
    rates = LearningRates(interval_s=clip.interval_s)
    model = Model(
        static=_parameters(parts.static.to(device), rates),
        dynamic=_parameters(dynamic.to(device), rates),
        deformation=None if moving is None else moving.to(device),
        sky=start.sky,
        exposure=ExposureNetwork(len(clip), seed).to(device),
    )
    half_size = (clip.size[0] / 2, clip.size[1] / 2)
    densifiers = [DENSIFIERS[densify.strategy](densify, len(p), half_size, device) for p in model.parts()]
    optimise(model, views, densifiers, options, seed, progress)
    empty = parts.static.select(torch.zeros(0, dtype=torch.int64))
    dynamic = model.dynamic.frozen() if model.dynamic is not None else empty
    return Scene(
        static=model.static.frozen() if model.static is not None else empty,
        dynamic=dynamic,
        deformation=None if moving is None else moving.requires_grad_(False).to(CPU),
        actors=tuple(_fitted(actor, dynamic, moving) for actor in parts.actors),
        sky=start.sky,
        exposure=model.exposure.freeze(clip.times_s, ~clip.held_out, clip.camera),
        cameras=geometry.cameras,
        times_s=clip.times_s,
        held_out=clip.held_out,
        camera=clip.camera if len(clip.rig) > 1 else None,
    )


def _parameters(gaussians: Gaussians, rates: LearningRates) -> Parameters | None:
    return Parameters(gaussians, footprints(gaussians), rates) if len(gaussians) else None


def _fitted(actor: Actor, gaussians: Gaussians, motion: Motion | None) -> Actor:
    """The actor with the track and the Gaussians that the fit has left it."""
    count = 0 if gaussians.actor is None else int((gaussians.actor == actor.id).sum())
    return replace(
        actor, count=count, track=actor.track if motion is None else motion.refined(actor.id, actor.track)
    )
