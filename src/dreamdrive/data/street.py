"""A procedural street: a small drive with exact frames, depth, poses and labels."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from dreamdrive.data import street_layout as layout
from dreamdrive.data.street_raycast import Solid, cast, shade
from dreamdrive.data.street_textures import sky_panorama
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.geometry import Ground
from dreamdrive.scene.trajectory import Trajectory


@dataclass(frozen=True)
class StreetBox:
    """The hull of a parked or moving thing.

    Attributes:
        instance: Label of its pixels, from 1.
        kind: ``"car"``, ``"van"`` or ``"cyclist"``.
        moving: Whether it moves.
        size_m: Width, height and length (3,), along its x (right), y (down) and z (ahead).
        world_from_box: Pose of its centre (F, 4, 4) at each frame.
    """

    instance: int
    kind: str
    moving: bool
    size_m: Float[np.ndarray, "3"]
    world_from_box: Float[np.ndarray, "f 4 4"]


@dataclass(frozen=True)
class StreetView:
    """What a camera sees: exact colour, depth and labels.

    Attributes:
        frame: RGB (H, W, 3), the mean of four rays a pixel.
        depth_m: Depth along z (H, W) at the pixel centres; 0 in the sky.
        instance: Label at the pixel centres (H, W), 0 for the backdrop and the sky.
        sky: Sky mask (H, W).
    """

    frame: UInt8[np.ndarray, "h w 3"]
    depth_m: Float[np.ndarray, "h w"]
    instance: Int[np.ndarray, "h w"]
    sky: Bool[np.ndarray, "h w"]


@dataclass(frozen=True)
class StreetWorld:
    """The street itself, to be looked at from any camera at any time.

    Attributes:
        things: Backdrop first, then parked, then moving things.
        sky: Panorama of the sky (180, 720, 3).
        world_from_street: Pose (4, 4) of the street frame in the world, the camera of the first frame.
    """

    things: tuple[layout.Thing, ...]
    sky: Float[np.ndarray, "h w 3"]
    world_from_street: Float[np.ndarray, "4 4"]

    def view(self, camera: Camera, t_s: float) -> StreetView:
        """Look at the street from a camera in the world; exact for every pose and time."""
        camera = camera.at(np.linalg.inv(self.world_from_street) @ camera.world_from_camera)
        solids = [solid for thing in self.things for solid in thing.solids(t_s)]
        fine = camera.resized(2 * camera.width_px, 2 * camera.height_px)
        colour = shade(fine, solids, cast(fine, solids, np.float32), self.sky)
        colour = cv2.resize(colour, (camera.width_px, camera.height_px), interpolation=cv2.INTER_AREA)
        depth, label = _exact(camera, solids)
        return StreetView(np.clip(np.rint(colour), 0, 255).astype(np.uint8), depth, label, depth == 0)


@dataclass(frozen=True)
class Street:
    """A drive through the procedural street; world = the camera of the first frame, metres.

    Attributes:
        frames: RGB (F, H, W, 3).
        times_s: Times (F,), from 0.
        cameras: Posed pinholes (F,).
        depth_m: Exact depth along z (F, H, W); 0 in the sky.
        instance: Labels (F, H, W): 0 backdrop and sky, otherwise :attr:`StreetBox.instance`.
        sky: Sky masks (F, H, W).
        boxes: Hulls of all parked and moving things.
        ground: The road plane.
        world: The street, for views from elsewhere.
    """

    frames: UInt8[np.ndarray, "f h w 3"]
    times_s: Float[np.ndarray, " f"]
    cameras: tuple[Camera, ...]
    depth_m: Float[np.ndarray, "f h w"]
    instance: Int[np.ndarray, "f h w"]
    sky: Bool[np.ndarray, "f h w"]
    boxes: tuple[StreetBox, ...]
    ground: Ground
    world: StreetWorld

    @cached_property
    def moving(self) -> Bool[np.ndarray, "f h w"]:
        """Pixels of moving things (F, H, W)."""
        return np.isin(self.instance, [box.instance for box in self.boxes if box.moving])

    @property
    def trajectory(self) -> Trajectory:
        """The drive."""
        return Trajectory(np.stack([c.world_from_camera for c in self.cameras]), self.times_s)


def make_street(
    seed: int = 0,
    frames: int = 24,
    fps: float = 10.0,
    size: tuple[int, int] = (320, 192),
    movers: int = 2,
    parked: int = 6,
    speed_m_s: float = 8.0,
    camera_height_m: float = 1.5,
) -> Street:
    """Build a street and drive through it.

    Args:
        seed: Decides every texture, house and vehicle.
        frames: Number of frames.
        fps: Frames a second.
        size: Width and height in pixels; the horizontal field of view is 64 degrees.
        movers: Moving things: a car ahead, an oncoming one, a cyclist, an oncoming van, and so on.
        parked: Vehicles at the kerbs.
        speed_m_s: Speed of the recording car; 0 stands still.
        camera_height_m: Height of the camera above the road.
    """
    if frames < 1 or fps <= 0 or min(size) < 2 or movers < 0 or parked < 0 or speed_m_s < 0:
        raise ValueError(
            f"street: cannot make {frames} frames of {size} at {fps}/s with {movers}+{parked} things"
        )
    rng = np.random.default_rng(seed)
    times_s = np.arange(frames) / fps
    phases = rng.uniform(0, 2 * np.pi, 4)
    street_from_camera = [layout.ego_pose(float(t), speed_m_s, camera_height_m, phases) for t in times_s]
    static = layout.parked_vehicles(rng, parked, 1)
    dynamic = layout.moving_things(rng, movers, speed_m_s, 1 + parked)
    things = (layout.backdrop(rng, speed_m_s * float(times_s[-1])), *static, *dynamic)
    world = StreetWorld(things, sky_panorama(rng), np.linalg.inv(street_from_camera[0]))
    focal_px = size[0] / 1.25
    pinhole = Camera(focal_px, focal_px, size[0] / 2, size[1] / 2, *size)
    # The product of the first pose with its inverse is the identity only up to rounding; say it exactly.
    poses = [np.eye(4)] + [world.world_from_street @ pose for pose in street_from_camera[1:]]
    cameras = tuple(pinhole.at(pose) for pose in poses)
    views = [world.view(camera, float(t)) for camera, t in zip(cameras, times_s, strict=True)]
    return Street(
        frames=np.stack([v.frame for v in views]),
        times_s=times_s,
        cameras=cameras,
        depth_m=np.stack([v.depth_m for v in views]),
        instance=np.stack([v.instance for v in views]),
        sky=np.stack([v.sky for v in views]),
        boxes=tuple(_box(thing, times_s, world.world_from_street, thing in dynamic) for thing in things[1:]),
        ground=_ground(world.world_from_street),
        world=world,
    )


def _exact(camera: Camera, solids: list[Solid]) -> tuple[np.ndarray, np.ndarray]:
    """Depth (0 for none) and instance label at the pixel centres."""
    hits = cast(camera, solids)
    labels = np.array([solid.instance for solid in solids] + [0], dtype=np.int32)
    depth = np.where(np.isfinite(hits.depth_m), hits.depth_m, 0).astype(np.float32)
    return depth, labels[hits.solid]


def _box(thing: layout.Thing, times_s: np.ndarray, world_from_street: np.ndarray, moving: bool) -> StreetBox:
    centre_from_ground = np.eye(4)
    centre_from_ground[1, 3] = -thing.size_m[1] / 2
    poses = [world_from_street @ thing.motion.pose(float(t)) @ centre_from_ground for t in times_s]
    return StreetBox(thing.instance, thing.kind, moving, np.array(thing.size_m), np.stack(poses))


def _ground(world_from_street: np.ndarray) -> Ground:
    up = world_from_street[:3, :3] @ np.array([0.0, -1.0, 0.0])
    return Ground(up, float(-up @ world_from_street[:3, 3]))
