"""What the street benchmark fits: seeded worlds, seen and understood in several ways."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import UInt8

from dreamdrive.data.corruption import corrupt, parse_corruption
from dreamdrive.data.intrinsics import guess_camera
from dreamdrive.data.select import held_out_mask
from dreamdrive.data.world import Drive, WorldBox, make_street
from dreamdrive.fit import StaticFit, fit_static, initialise
from dreamdrive.geometry import reconstruct
from dreamdrive.options import Quality
from dreamdrive.prior.appearance import appearance
from dreamdrive.scene.atomic import new_file
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.similarity import Similarity
from dreamdrive.stages import Stages, stage_seed

FRAMES, RATE_HZ, SIZE, HOLD_OUT = 24, 10.0, (320, 192), 8
SHIFTS_M = (1.0, 2.0, 3.0)
Poses = Literal["true", "estimated", "unknown_focal"]
References = Literal["clean", "corrupted"]
VIEWS = ("held_out", "shift_1", "shift_2", "shift_3", "raise_1", "yaw_10")
NOVEL = VIEWS[1:]


@dataclass(frozen=True)
class Case:
    """One world, known in one way, seen in one way."""

    seed: int
    geometry: Poses
    references: References

    @property
    def name(self) -> str:
        """For files."""
        return f"{self.seed}-{self.geometry}-{self.references}"


@dataclass(frozen=True)
class Start:
    """What all representations of a case begin with."""

    clip: Clip
    geometry: Geometry
    seeds: Gaussians
    static: StaticFit


@lru_cache(maxsize=2)
def world_of(seed: int) -> Drive:
    """The drive of a seed."""
    return make_street(seed, FRAMES, RATE_HZ, SIZE)


def clip_of(case: Case) -> Clip:
    """The frames as a prior would hand them over."""
    made = world_of(case.seed)
    frames = made.frames
    if case.references == "corrupted":
        frames = corrupt(frames, parse_corruption("generated", case.seed), made.depth_m)
    pinhole = made.cameras[0].at(np.eye(4))
    if case.geometry == "unknown_focal":
        pinhole = guess_camera(SIZE).camera
    poses = made.trajectory.world_from_camera if case.geometry == "true" else None
    clip = Clip(
        frames=frames,
        times_s=made.times_s,
        camera=np.zeros(FRAMES, dtype=np.int64),
        rig=(pinhole,),
        valid=np.ones(frames.shape[:3], dtype=bool),
        held_out=held_out_mask(FRAMES, HOLD_OUT),
        source_index=np.arange(FRAMES),
        known=Known(poses, intrinsics=case.geometry != "unknown_focal"),
    )
    return clip.with_features(appearance=appearance(clip.frames, clip.valid))


def start(case: Case, quality: Quality, folder: Path) -> Start:
    """Geometry, seeds and static fit of a case, kept in the folder."""
    about = [case.name, FRAMES, SIZE, world_of(case.seed).frames[0].mean().item()]
    return prepare(lambda: clip_of(case), about, quality, folder / case.name)


def prepare(
    make: Callable[[], Clip],
    about: list[object],
    quality: Quality,
    folder: Path,
    camera_height_m: float | None = None,
) -> Start:
    """What every fit of a clip begins with, kept in the folder; ``about`` tells the clip from others."""
    stages = Stages(folder, None, lambda *_: None, lambda: folder.mkdir(parents=True, exist_ok=True))
    clip = stages.run("prior", (), about, lambda _: make())
    seed = stage_seed(0, "geometry")
    geometry = stages.run(
        "geometry",
        ("prior",),
        seed if camera_height_m is None else [seed, camera_height_m],
        lambda _: reconstruct(clip, camera_height_m=camera_height_m, seed=seed),
    )
    seeds = stages.run(
        "initialise",
        ("prior", "geometry"),
        quality.seeds,
        lambda _: initialise(clip, geometry, quality.seeds),
    )
    number = stage_seed(0, "static")
    static = stages.run(
        "static",
        ("initialise",),
        [quality.static, number],
        lambda tell: fit_static(clip, geometry, seeds, quality.static, number, tell),
    )
    return Start(clip, geometry, seeds, static)


def to_scene(camera: Camera, similarity: Similarity) -> Camera:
    """A camera of the true world in that of a scene; what it sees is the same."""
    pose = np.eye(4)
    pose[:3, :3] = similarity.rotation.T @ camera.world_from_camera[:3, :3]
    away = camera.world_from_camera[:3, 3] - similarity.translation
    pose[:3, 3] = similarity.rotation.T @ away / similarity.scale
    return camera.at(pose)


def true_cameras(seed: int, view: str) -> list[Camera]:
    """The cameras of a view in the true world, one a frame.

    Shifts go to the side on which the boxes are further away: to the left or to the right.
    """
    made = world_of(seed)
    if view.startswith("shift"):
        metres = float(view[-1])
        offset = np.array([metres * _free_side(made, metres), 0.0, 0.0])
        return [_moved(camera, offset) for camera in made.cameras]
    if view == "raise_1":
        return [_moved(camera, np.array([0.0, -1.0, 0.0])) for camera in made.cameras]
    if view == "yaw_10":
        cos, sin = np.cos(np.deg2rad(10)), np.sin(np.deg2rad(10))
        turn = np.eye(4)
        turn[:3, :3] = [[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]]
        return [camera.at(camera.world_from_camera @ turn) for camera in made.cameras]
    return list(made.cameras)


def _moved(camera: Camera, offset_m: np.ndarray) -> Camera:
    pose = camera.world_from_camera.copy()
    pose[:3, 3] += pose[:3, :3] @ offset_m
    return camera.at(pose)


def _free_side(made: Drive, metres: float) -> int:
    """1 for right, -1 for left: where the nearest box is further away."""

    def clearance_m(side: int) -> float:
        offset = np.array([side * metres, 0.0, 0.0])
        centres = [_moved(camera, offset).world_from_camera[:3, 3] for camera in made.cameras]
        gaps = [_gap_m(box, k, centre) for box in made.boxes for k, centre in enumerate(centres)]
        return min(gaps, default=np.inf)

    return 1 if clearance_m(1) > clearance_m(-1) else -1


def _gap_m(box: WorldBox, frame: int, point: np.ndarray) -> float:
    """Distance on the ground of a point from a box."""
    local = _local(box.world_from_box[frame], point)[:2]
    return float(np.hypot(*np.maximum(np.abs(local) - box.size_m[:2] / 2, 0)))


def _local(pose: np.ndarray, point: np.ndarray) -> np.ndarray:
    return pose[:3, :3].T @ (point - pose[:3, 3])


def true_frames(seed: int, view: str, folder: Path) -> UInt8[np.ndarray, "f h w 3"]:
    """What those cameras see, kept in the folder; of the recorded path the frames themselves."""
    made = world_of(seed)
    if view == "held_out":
        return made.frames
    path = folder / f"truth-{seed}-{view}.npz"
    if path.exists():
        with np.load(path) as kept:
            if kept["first"] == made.frames[0].astype(np.int64).sum():
                return kept["frames"]
    seen = made.views(true_cameras(seed, view), made.times_s.tolist())
    frames = np.stack([v.frame for v in seen])
    with new_file(path) as partial:
        np.savez_compressed(partial, frames=frames, first=made.frames[0].astype(np.int64).sum())
    return frames
