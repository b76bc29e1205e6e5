"""The built-in street with its exact truth, as the nouns the stages exchange."""

from functools import lru_cache

import numpy as np

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.geometry import Focal, Geometry, Scale
from dreamdrive.scene.layout import Area, Box, Ego, Layout, TrackPoint
from dreamdrive.world import Drive, drive, make_street


def street_clip(street: Drive, hold_out: int | None = None) -> Clip:
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


def true_geometry(street: Drive, evidence: bool = True) -> Geometry:
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


def small_street(**changes: object) -> Drive:
    """A quick street for tests."""
    settings: dict[str, object] = {"seed": 3, "frames": 8, "size": (96, 64), "movers": 1, "parked": 3}
    return make_street(**{**settings, **changes})  # type: ignore[arg-type]


@lru_cache
def bare_street() -> Drive:
    """A car ahead on an empty road, 5 frames of 80x48: quick to draw; do not change it."""
    car = Box("ahead", "car", (4.4, 1.8, 1.5), [TrackPoint(0, 12, 0, 0), TrackPoint(2, 26, 0, 0)])
    road = Area("road", [(-20.0, -5.0), (60.0, -5.0), (60.0, 5.0), (-20.0, 5.0)])
    layout = Layout(Ego([TrackPoint(0, 0, 0, 0), TrackPoint(2, 14, 2, 0)]), areas=[road], boxes=[car])
    return drive(layout, 5, size=(80, 48))
