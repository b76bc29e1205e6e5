"""The built-in street with its exact truth, as the nouns the stages exchange."""

from functools import lru_cache

import numpy as np
import torch

from dreamdrive.decompose import Grouping, source_pixels
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Focal, Geometry, Scale
from dreamdrive.scene.street.layout import Area, Box, Ego, Layout, TrackPoint
from dreamdrive.scene.street.truth import DriveTruth
from streetworld import drive, make_street


def street_clip(street: DriveTruth, hold_out: int | None = None) -> Clip:
    """The frames as a clip with known intrinsics and simple colour features."""
    count, height, width = street.frames.shape[:3]
    rig = street.cameras[0]
    held_out = np.zeros(count, dtype=bool)
    if hold_out is not None:
        held_out = np.arange(count) % hold_out == hold_out // 2
        held_out[[0, -1]] = False
    colour = street.frames.astype(np.float32) / 255 - 0.5
    return Clip(
        frames=street.frames.copy(),
        times_s=street.times_s,
        camera=np.zeros(count, dtype=np.int64),
        rig=(Camera(rig.fx_px, rig.fy_px, rig.cx_px, rig.cy_px, width, height),),
        valid=np.ones((count, height, width), dtype=bool),
        held_out=held_out,
        source_index=np.arange(count),
        features={"appearance": colour},
        known=Known(intrinsics=True),
    )


def true_geometry(street: DriveTruth, evidence: bool = True) -> Geometry:
    """Exact cameras, depth, sky and, unless switched off, moving evidence."""
    moving = street.moving.astype(np.float32)
    return Geometry(
        cameras=street.cameras,
        depth_m=street.depth_m.copy(),
        confidence=(street.depth_m > 0).astype(np.float32),
        sky=street.sky.copy(),
        moving=moving if evidence else np.zeros_like(moving),
        fixed_regions=np.zeros((1, *street.depth_m.shape[1:]), dtype=np.int64),
        region_names=(),
        ground=street.ground,
        scale=Scale("poses", 0.0),
        focal=Focal(street.cameras[0].fx_px, True),
    )


def small_street(**changes: object) -> DriveTruth:
    """A quick street, drawn once for all tests that follow one another; do not change it."""
    settings: dict[str, object] = {"seed": 3, "frames": 8, "size": (96, 64), "movers": 1, "parked": 3}
    return _drawn(tuple(sorted({**settings, **changes}.items())))


@lru_cache(maxsize=4)
def _drawn(settings: tuple[tuple[str, object], ...]) -> DriveTruth:
    made = make_street(**dict(settings))  # type: ignore[arg-type]
    for pictures in (made.frames, made.depth_m, made.instance, made.semantic, made.moving, made.flow_px):
        pictures.flags.writeable = False
    return made


@lru_cache
def bare_street() -> DriveTruth:
    """A car ahead on an empty road, 5 frames of 80x48: quick to draw; do not change it."""
    car = Box("ahead", "car", (4.4, 1.8, 1.5), [TrackPoint(0, 12, 0, 0), TrackPoint(2, 26, 0, 0)])
    road = Area("road", [(-20.0, -5.0), (60.0, -5.0), (60.0, 5.0), (-20.0, 5.0)])
    layout = Layout(Ego([TrackPoint(0, 0, 0, 0), TrackPoint(2, 14, 2, 0)]), areas=[road], boxes=[car])
    return drive(layout, 5, size=(80, 48))


def car(name: str, points: list[tuple[float, float, float, float]], look: int = 0) -> Box:
    """A car that is at these places (time, x ahead, y to the left, yaw) of the map."""
    return Box(name, "car", (4.4, 1.8, 1.5), [TrackPoint(*point) for point in points], look)


def traffic(*boxes: Box, frames: int, fps: float = 10.0, size: tuple[int, int] = (96, 64)) -> DriveTruth:
    """Road users on a bare road, seen by a camera that drives at 7 m/s."""
    road = Area("road", [(-20.0, -8.0), (120.0, -8.0), (120.0, 8.0), (-20.0, 8.0)])
    ego = Ego([TrackPoint(0, 0, 0, 0), TrackPoint(6, 42, 0, 0)])
    return drive(Layout(ego, areas=[road], boxes=list(boxes)), frames, fps, size)


def true_labels(street: DriveTruth, geometry: Geometry, seeds: Gaussians) -> Grouping:
    """What moves, a cluster for each thing in the order of the boxes."""
    every = np.arange(len(seeds))
    column, row = np.floor(source_pixels(geometry, seeds, every)[:, :2]).astype(int).T
    shown = street.instance[seeds.source_frame.numpy(), row, column]
    cluster = np.full(len(seeds), -1)
    for number, box in enumerate(box for box in street.boxes if box.moving):
        cluster[shown == box.instance] = number
    return Grouping(torch.from_numpy(cluster >= 0), torch.from_numpy(cluster))
