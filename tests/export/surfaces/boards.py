"""Scenes of boards, whose surfaces and ways are known in closed form."""

from dataclasses import replace

import numpy as np
import torch

from dreamdrive.motion import DeformationConfig, DeformationField, Domain, Tracks
from dreamdrive.scene.actor import Actor, Track
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Provenance, Scene
from dreamdrive.scene.sky import Sky
from tests.edit.test_behind import GREEN, RED, board

PINHOLE = Camera(80.0, 80.0, 48.0, 32.0, 96, 64)
TIMES_S = np.array([0.0, 0.1, 0.2])
AHEAD_M, ASIDE_M = 0.5, 0.25
"""How far the camera goes ahead from frame to frame, and the red board to the right."""
WALL_M, CAR_M = 10.0, 5.0
"""How far both stand from the first camera."""


def striped(made: Gaussians) -> Gaussians:
    """With colours that change from place to place."""
    x, y = made.means[:, 0], made.means[:, 1]
    wave = 0.6 * torch.stack([torch.sin(5 * x + 3 * y), torch.sin(4 * y), torch.sin(3 * x)], dim=1)
    return replace(made, sh=made.sh + wave[:, None])


def boards() -> Scene:
    """A car before a wall that fills the lower half of the picture; above it is the sky."""
    wall = board(WALL_M, (8.0, 4.0), GREEN, 0.1)
    wall = replace(wall, means=wall.means + torch.tensor([0.0, 4.0, 0.0]))
    car = replace(board(CAR_M, (0.5, 0.5), RED, 0.05), actor=None)
    car = replace(
        car,
        means=car.means + torch.tensor([0.0, 1.0, 0.0]),
        actor=torch.zeros(len(car), dtype=torch.int64),
        lifespan=torch.tensor([[0.1, 100.0]]).repeat(len(car), 1),
    )
    way_m = np.zeros((3, 3))
    way_m[:, 0] = ASIDE_M * np.arange(3)
    pivot_m = np.array([0.0, 1.5, CAR_M])
    tracks = Tracks(TIMES_S, way_m[None], np.zeros((1, 3)), pivot_m[None])
    motion = DeformationField(
        DeformationConfig(depth=1, width=4, actors=1, track_times=3),
        Domain(pivot_m, 2.0, 0.0, 0.2, np.array([0.0, -1.0, 0.0])),
        tracks,
    )
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[:, 2, 3] = AHEAD_M * np.arange(3)
    return Scene(
        static=striped(wall),
        dynamic=striped(car),
        deformation=motion.requires_grad_(False),
        actors=(Actor(0, "actor 0", "vehicle", len(car), Track(TIMES_S, pivot_m + way_m, np.zeros(3))),),
        sky=Sky(torch.full((4, 6, 3), 0.7), (-1.5, 1.5), (-1.0, 1.0)),
        exposure=None,
        cameras=tuple(PINHOLE.at(pose) for pose in poses),
        times_s=TIMES_S,
        held_out=np.zeros(3, bool),
        provenance=Provenance(up=(0.0, -1.0, 0.0), camera_height_m=1.5),
    )
