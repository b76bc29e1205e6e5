"""A drive through a world: its frames and the truth behind them, as the nouns that stages exchange."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.level import pitched, upright
from dreamdrive.scene.street.hills import hills_of, road_plane
from dreamdrive.scene.street.layout import BENCHMARK_EDITION, Layout, track_function
from dreamdrive.scene.street.truth import DriveTruth, Mount, WorldBox
from streetworld.editions import draw_street, edition_of
from streetworld.engine.view import WorldView
from streetworld.options import StreetOptions
from streetworld.picture import picture_of
from streetworld.world import World

_MOUNT_YAW_RAD: dict[Mount, float] = {
    "front": 0.0,
    "front_left": np.deg2rad(55),
    "front_right": -np.deg2rad(55),
    "back": np.pi,
    "back_left": np.deg2rad(110),
    "back_right": -np.deg2rad(110),
}
_MOUNT_OUT_M = 0.5


@dataclass(frozen=True)
class DrawnDrive(DriveTruth):
    """One that was just drawn: its street is still there, for views from elsewhere."""

    world: World

    def views(self, cameras: Sequence[Camera], times_s: Sequence[float]) -> list[WorldView]:
        """What cameras elsewhere in the world see, each at its time; flow leads 0.1 s ahead."""
        map_from_world = np.linalg.inv(self.world_from_map)
        placed = [camera.at(map_from_world @ camera.world_from_camera) for camera in cameras]
        later = [t + 0.1 for t in times_s]
        return list(pictures(self.world, placed, list(times_s), placed, later, antialiased=True))


def ego_poses(
    layout: Layout, times_s: Float[np.ndarray, " f"], mount: Mount = "front"
) -> Float[np.ndarray, "f 4 4"]:
    """``map_from_camera`` (F, 4, 4) of a camera of the recording car, which nods and rolls a little."""
    ego, hills = layout.ego, hills_of(layout)
    pitch = ego.shake_rad * np.sin(4.1 * times_s + 0.7)
    roll = 0.7 * ego.shake_rad * np.sin(2.3 * times_s + 1.9)
    mounted, axes = _mounted(mount), edition_of(layout).level_from_camera(layout)
    poses: list[np.ndarray] = []
    for place, p, r in zip(track_function(ego.track)(times_s), pitch, roll, strict=True):
        pose = hills.laid(upright(place))
        about_y = pitched((0, 0, 0), p)[:3, :3]
        about_x = np.array([[1, 0, 0], [0, np.cos(r), -np.sin(r)], [0, np.sin(r), np.cos(r)]])
        nodding = pose[:3, :3] @ about_y @ about_x
        pose[:3, :3] = nodding @ mounted[:3, :3] @ axes
        pose[:3, 3] += nodding @ mounted[:3, 3] + [0, 0, ego.camera_height_m]
        poses.append(pose)
    return np.stack(poses)


def front_from_mount(layout: Layout, mount: Mount) -> Float[np.ndarray, "4 4"]:
    """Pose (4, 4) of a camera of the recording car in the frame of its front camera."""
    mounted, axes = _mounted(mount), edition_of(layout).level_from_camera(layout)
    pose = np.eye(4)
    pose[:3, :3] = axes.T @ mounted[:3, :3] @ axes
    pose[:3, 3] = axes.T @ mounted[:3, 3]
    return pose


def pinhole_of(layout: Layout, size: tuple[int, int]) -> Camera:
    """The recording camera of a layout, for pictures of a width and height in pixels."""
    return edition_of(layout).pinhole(layout, size)


def _mounted(mount: Mount) -> Float[np.ndarray, "4 4"]:
    """Pose of a camera on the car: x ahead, y left, z up from the front camera."""
    turn = _MOUNT_YAW_RAD[mount]
    out = 0.0 if mount == "front" else _MOUNT_OUT_M
    return upright((out * np.cos(turn), out * np.sin(turn), turn))


def drive(
    layout: Layout,
    frames: int,
    fps: float = 10.0,
    size: tuple[int, int] = (320, 192),
    *,
    world: World | None = None,
    mount: Mount = "front",
    antialiased: bool = True,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> DrawnDrive:
    """Drive through the street of a layout, or of its world if that is made already.

    The size is width and height in pixels; the horizontal field of view is 64 degrees in the first
    edition and that of the layout's lens in later ones. ``progress`` is called with frames done and frames
    in all.
    """
    if frames < 1 or fps <= 0 or min(size) < 2:
        raise ValueError(f"world: cannot drive {frames} frames of {size} at {fps}/s")
    world = World(layout) if world is None else world
    times = np.arange(frames + 1) / fps
    poses = ego_poses(layout, times, mount)
    camera = pinhole_of(layout, size)
    placed = [camera.at(pose) for pose in poses]
    seen: list[WorldView] = []
    for view in pictures(world, placed[:-1], times[:-1], placed[1:], times[1:], antialiased=antialiased):
        seen.append(view)
        progress(len(seen), frames)
    world_from_map = np.linalg.inv(poses[0])
    # The product of the first pose with its inverse is the identity only up to rounding; say it exactly.
    cameras = [camera, *(camera.at(world_from_map @ pose) for pose in poses[1:-1])]
    return DrawnDrive(
        frames=np.stack([v.frame for v in seen]),
        times_s=times[:-1],
        cameras=tuple(cameras),
        depth_m=np.stack([v.depth_m for v in seen]),
        instance=np.stack([v.instance for v in seen]),
        semantic=np.stack([v.semantic for v in seen]),
        moving=np.stack([v.moving for v in seen]),
        flow_px=np.stack([v.flow_px for v in seen]),
        boxes=_boxes(world, times[:-1], world_from_map),
        ground=road_plane(world_from_map, layout),
        layout=layout,
        world_from_map=world_from_map,
        world=world,
    )


def make_street(
    seed: int = 0,
    frames: int = 24,
    fps: float = 10.0,
    size: tuple[int, int] = (320, 192),
    *,
    movers: int | None = None,
    parked: int | None = None,
    speed_m_s: float | None = None,
    camera_height_m: float = 1.5,
    edition: int = BENCHMARK_EDITION,
) -> DrawnDrive:
    """Draw a street and drive through it; None leaves a choice to the seed."""
    options = StreetOptions(frames / fps, speed_m_s, movers, parked, camera_height_m, edition)
    return drive(draw_street(seed, options), frames, fps, size)


def pictures(
    world: World,
    cameras: Sequence[Camera],
    times_s: Sequence[float] | np.ndarray,
    next_cameras: Sequence[Camera],
    next_times_s: Sequence[float] | np.ndarray,
    *,
    antialiased: bool = True,
) -> Iterator[WorldView]:
    """Pictures of any cameras in the map frame, each at its time, with the flow to a next camera and time.

    Two at a time: NumPy and Embree leave Python's lock alone.
    """

    def one(k: int) -> WorldView:
        following = float(next_times_s[k]), next_cameras[k]
        return picture_of(world, world.at(float(times_s[k])), cameras[k], following, antialiased=antialiased)

    yield one(0)  # what is made on first use is made once
    with ThreadPoolExecutor(2) as pool:
        yield from pool.map(one, range(1, len(cameras)))


def _boxes(world: World, times_s: np.ndarray, world_from_map: np.ndarray) -> tuple[WorldBox, ...]:
    found: list[WorldBox] = []
    for mover in world.movers:
        size = np.array(mover.box.size_m)
        lifted = np.eye(4)
        lifted[2, 3] = size[2] / 2
        poses = np.stack([world_from_map @ mover.pose(float(t)) @ lifted for t in times_s])
        found.append(WorldBox(mover.instance, mover.box.id, mover.box.kind, mover.moving, size, poses))
    return tuple(found)
