"""A small scene with everything in it."""

from dataclasses import replace

import numpy as np
import torch

from dreamdrive.motion import (
    Bounds,
    DeformationConfig,
    DeformationField,
    Domain,
    HexPlaneConfig,
    HexPlaneField,
    Motion,
    Tracks,
    Vibration,
    VibrationConfig,
)
from dreamdrive.scene.actor import Actor, ActorBox, Track
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.exposure import Exposure
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Provenance, Scene
from dreamdrive.scene.sky import Sky


def gaussians(count: int, seed: int, **more: torch.Tensor) -> Gaussians:
    g = torch.Generator().manual_seed(seed)
    return Gaussians(
        means=torch.randn(count, 3, generator=g),
        quaternions=torch.randn(count, 4, generator=g),
        log_scales=torch.randn(count, 3, generator=g),
        logit_opacities=torch.randn(count, generator=g),
        sh=torch.randn(count, 4, 3, generator=g),
        source_frame=torch.arange(count) % 3,
        **more,
    )


def make_scene(dynamic: int = 4, full: bool = True) -> Scene:
    config = DeformationConfig(depth=6, width=8, actors=2, track_times=3)
    tracks = Tracks(
        np.array([0.0, 0.5, 1.0]),
        np.random.default_rng(0).normal(size=(2, 3, 3)),
        np.ones((2, 3)),
        np.ones((2, 3)),
    )
    domain = Domain(np.array([1.0, 2, 3]), 4.0, 0.0, 1.0, np.array([0, -1.0, 0]))
    field = DeformationField(config, domain, tracks)
    torch.nn.init.constant_(field.head_mean.bias, 0.25)
    more = {"lifespan": torch.ones(dynamic, 2), "actor": torch.arange(dynamic) % 3 - 1}
    return Scene(
        static=gaussians(7, 1, features=torch.ones(7, 2)),
        dynamic=gaussians(dynamic, 2, **more),
        deformation=field if full else None,
        actors=(
            Actor(
                0,
                "actor 0",
                "vehicle",
                2,
                Track(np.array([0.0, 0.1]), np.ones((2, 3)) / 3, np.array([0.0, 0.1])),
                ActorBox(np.array([4.4, 1.8, 1.5]), np.array([0.0, 0.6, 0.8])),
                np.ones(2),
            ),
        )
        if full
        else (),
        sky=Sky(torch.rand(4, 6, 3), (-1.0, 1.0), (-0.1, 0.8)) if full else None,
        exposure=Exposure(torch.eye(3, 4).repeat(2, 1, 1), np.array([0.0, 0.1])) if full else None,
        cameras=tuple(Camera(50.0, 51.0, 16.5, 12.0, 33, 24) for _ in range(3)),
        times_s=np.array([0.0, 0.1, 0.2]) + 1 / 3,
        held_out=np.array([False, True, False]),
        provenance=Provenance(input="a.mp4", up=(0.0, -1.0, 0.0)),
    )


def make_baseline(kind: str) -> Scene:
    """The scene with all of it moved by a hexplane or a vibration that does something."""
    scene = make_scene()
    dynamic, motion = _moved_by(kind, replace(scene.dynamic, lifespan=None, actor=None))
    return replace(scene, static=gaussians(0, 1), dynamic=dynamic, deformation=motion, actors=())


def _moved_by(kind: str, dynamic: Gaussians) -> tuple[Gaussians, Motion]:
    if kind == "hexplane":
        config = HexPlaneConfig(width=8, features=2, resolution=4, levels=2, times=3)
        made = HexPlaneField(config, Bounds(-np.ones(3), np.ones(3), 0.0, 1.0))
        torch.nn.init.constant_(made.head_mean[-1].weight, 0.1)
        torch.nn.init.uniform_(made.time[0], generator=torch.Generator().manual_seed(2))
        return dynamic, made.requires_grad_(False)
    count = len(dynamic)
    lifespan = torch.stack([torch.linspace(0.2, 0.6, count), torch.full((count,), 0.5)], dim=1)
    swinging = replace(dynamic, velocity=torch.ones(count, 3), lifespan=lifespan)
    return swinging, Vibration(VibrationConfig(interval_s=0.25))


def per_frame_scene() -> Scene:
    """One whose street is of single frames; its Gaussian i is in place at i / 10 s, and goes i m/s ahead."""
    scene = make_scene()
    number = torch.arange(len(scene.static), dtype=torch.float32)
    velocity = torch.stack([0 * number, 0 * number, number], dim=1)
    life = torch.stack([number / 10, torch.full_like(number, 0.2)], dim=1)
    return replace(scene, static=replace(scene.static, velocity=velocity, lifespan=life))
