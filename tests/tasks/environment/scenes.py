"""A street of a few thousand Gaussians to drive in, with a wall to the right and any cars."""

from dataclasses import replace

import numpy as np
import torch

from dreamdrive.motion import DeformationConfig, DeformationField, Domain, Tracks
from dreamdrive.scene.actor import Actor, ActorBox, Track
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.exposure import Exposure
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Provenance, Scene
from dreamdrive.scene.sky import Sky

UP = np.array([0.0, -1.0, 0.0])
HEIGHT_M, SPEED_M_S, RATE_HZ = 1.5, 8.0, 10.0
WALL_M = -4.0
"""To the left of the path: the wall is to the right."""


def splats(places_m: np.ndarray, seed: int, size_m: float = 0.2, **more: torch.Tensor) -> Gaussians:
    """Opaque Gaussians at places in the world."""
    count, rng = len(places_m), np.random.default_rng(seed)
    return Gaussians(
        means=torch.tensor(places_m, dtype=torch.float32),
        quaternions=torch.tensor(rng.normal(size=(count, 4)), dtype=torch.float32),
        log_scales=torch.full((count, 3), float(np.log(size_m))),
        logit_opacities=torch.full((count,), 3.0),
        sh=torch.tensor(rng.normal(size=(count, 4, 3)), dtype=torch.float32),
        source_frame=torch.zeros(count, dtype=torch.int64),
        **more,
    )


def world(ahead_m: np.ndarray, left_m: np.ndarray, over_m: np.ndarray) -> np.ndarray:
    """Places in the world, whose camera looks ahead 1.5 m over the road."""
    return np.stack([-left_m, HEIGHT_M - over_m, ahead_m], axis=-1)


def standing(seconds: float) -> Gaussians:
    """The road, and a wall along it to the right."""
    rng = np.random.default_rng(0)
    along_m = rng.uniform(-5.0, SPEED_M_S * seconds + 40.0, 600)
    road = world(along_m, rng.uniform(-5.0, 5.0, 600), np.zeros(600))
    ahead_m, over_m = np.meshgrid(np.arange(-5.0, 80.0, 0.25), np.arange(0.4, 2.0, 0.25))
    wall = world(ahead_m.ravel(), np.full(ahead_m.size, WALL_M), over_m.ravel())
    return splats(np.concatenate([road, wall]), 1)


def recorded(poses: np.ndarray, seconds: float) -> tuple[tuple[Camera, ...], np.ndarray]:
    camera = Camera(50.0, 50.0, 32.0, 20.0, 64, 40)
    times_s = np.arange(round(seconds * RATE_HZ) + 1) / RATE_HZ
    return tuple(camera.at(pose) for pose in poses[: len(times_s)]), times_s


def straight(seconds: float) -> np.ndarray:
    """Poses of a camera that drives straight ahead."""
    poses = np.tile(np.eye(4), (round(seconds * RATE_HZ) + 1, 1, 1))
    poses[:, 2, 3] = SPEED_M_S * np.arange(len(poses)) / RATE_HZ
    return poses


Path = tuple[float, float, float, float]
"""Ahead and left at the first time, and metres a second in these directions."""
AHEAD: Path = (14.0, 0.0, SPEED_M_S, 0.0)
BEHIND: Path = (-12.0, 0.0, SPEED_M_S, 0.0)
ONCOMING: Path = (60.0, 3.5, -9.0, 0.0)


def scene(
    *paths: Path,
    seconds: float = 3.0,
    seen_s: tuple[float, float] | None = None,
    kind: str = "vehicle",
    poses: np.ndarray | None = None,
) -> Scene:
    """A drive of some seconds with an actor on each path, seen all the time or from one to another time."""
    cameras, times_s = recorded(straight(seconds) if poses is None else poses, seconds)
    first_s, last_s = (times_s[0], times_s[-1]) if seen_s is None else seen_s
    actors: list[Actor] = []
    parts: list[Gaussians] = []
    for index, (ahead_m, left_m, ahead_m_s, left_m_s) in enumerate(paths):
        places_m = world(ahead_m + ahead_m_s * times_s, left_m + left_m_s * times_s, np.zeros(len(times_s)))
        known = (times_s >= first_s - 1e-9) & (times_s <= last_s + 1e-9)
        track = Track(times_s[known], places_m[known], np.zeros(int(known.sum())))
        heading = np.array([-left_m_s, 0.0, ahead_m_s]) / np.hypot(ahead_m_s, left_m_s)
        box = ActorBox(np.array([4.4, 1.8, 1.5]), heading)
        actors.append(Actor(index, f"actor {index}", kind, 60, track, box))
        offsets = np.random.default_rng(index).uniform([-0.8, -1.4, -2.0], [0.8, -0.2, 2.0], (60, 3))
        life = torch.tensor([[float(0.5 * (first_s + last_s)), 2.0]]).repeat(60, 1)
        parts.append(splats(places_m[0] + offsets, 5 + index, lifespan=life, actor=torch.full((60,), index)))
    dynamic, field = splats(np.zeros((0, 3)), 9), None
    if paths:
        dynamic = Gaussians.concatenate(*parts)
        field = _field(paths, times_s)
    return Scene(
        static=standing(seconds),
        dynamic=dynamic,
        deformation=field,
        actors=tuple(actors),
        sky=Sky(torch.rand(4, 6, 3, generator=torch.Generator().manual_seed(0)), (-1.0, 1.0), (-0.1, 0.8)),
        exposure=Exposure(0.9 * torch.eye(3, 4).repeat(2, 1, 1), np.array([0.0, seconds])),
        cameras=cameras,
        times_s=times_s,
        held_out=np.zeros(len(times_s), dtype=bool),
        provenance=Provenance(up=(0.0, -1.0, 0.0), camera_height_m=HEIGHT_M),
    )


def _field(paths: tuple[Path, ...], times_s: np.ndarray) -> DeformationField:
    """What moves the actors along straight paths; its network changes a little, too."""
    moves = np.stack([world(a * times_s, b * times_s, np.full(len(times_s), HEIGHT_M)) for *_, a, b in paths])
    pivots = np.stack([world(np.array(ahead), np.array(left), np.array(0.0)) for ahead, left, *_ in paths])
    config = DeformationConfig(depth=2, width=8, actors=len(paths), track_times=len(times_s))
    domain = Domain(np.zeros(3), 20.0, float(times_s[0]), float(times_s[-1]), UP)
    tracks = Tracks(times_s, moves, np.zeros(moves.shape[:2]), pivots)
    field = DeformationField(config, domain, tracks)
    torch.nn.init.constant_(field.head_mean.bias, 0.02)
    return field.requires_grad_(False)


def two_cameras(made: Scene) -> Scene:
    """The same with a second camera that looks to the left from half a metre aside."""
    turned = np.eye(4)
    turned[:3, :3] = [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]
    turned[:3, 3] = -0.5, 0.0, 0.0
    others = tuple(each.at(each.world_from_camera @ turned) for each in made.cameras)
    count = len(made.cameras)
    exposure = Exposure(
        torch.cat([0.9 * torch.eye(3, 4)[None], 0.5 * torch.eye(3, 4)[None]]),
        np.zeros(2),
        np.array([0, 1]),
    )
    return replace(
        made,
        cameras=made.cameras + others,
        times_s=np.tile(made.times_s, 2),
        held_out=np.zeros(2 * count, dtype=bool),
        camera=np.repeat([0, 1], count),
        exposure=exposure,
    )
