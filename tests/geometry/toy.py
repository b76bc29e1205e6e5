"""A small rendered street: textured road, two walls, a far wall, sky and boxes, with exact depth."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from dreamdrive.geometry.cameras.posing import Posed
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.geometry import Focal, Ground, Scale

HEIGHT_M = 1.5
WIDTH, HEIGHT = 256, 144
FOCAL_PX = 225.0
WALL_M, WALL_TOP_M, END_M = 6.0, 2.5, 60.0
SKY_RGB = (150, 180, 230)


@dataclass(frozen=True)
class Box:
    """An upright box seen from behind: its back face at ``distance_m``, moving at ``speed_m`` a frame."""

    distance_m: float
    left_m: float
    speed_m: float
    width_m: float = 1.8
    tall_m: float = 1.4


def texture(seed: int) -> np.ndarray:
    """Smooth noise (512, 512) in grey levels, periodic."""
    noise = np.random.default_rng(seed).uniform(0, 255, (512, 512)).astype(np.float32)
    noise = cv2.GaussianBlur(np.tile(noise, (2, 2)), (0, 0), 1.5)[256:768, 256:768]
    return np.clip((noise - noise.mean()) * 4 + 120, 0, 255)


TEXTURES = [texture(seed) for seed in range(5)]


def paint(index: int, u_m: np.ndarray, v_m: np.ndarray, per_m: float) -> np.ndarray:
    u = np.mod(u_m * per_m, 511).astype(np.float32)
    v = np.mod(v_m * per_m, 511).astype(np.float32)
    return cv2.remap(TEXTURES[index], u, v, cv2.INTER_LINEAR)


def render(camera: Camera, boxes: list[Box], frame: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """RGB frame, depth along z (0 in the sky) and mask of the boxes; rotation-free cameras only."""
    x0, y0, z0 = camera.world_from_camera[:3, 3]
    rays = camera.rays()
    depth = np.full(rays.shape[:2], np.inf)
    grey = np.zeros(rays.shape[:2], np.float32)
    on_box = np.zeros(rays.shape[:2], bool)

    def put(
        t: np.ndarray, good: np.ndarray, index: int, u: np.ndarray, v: np.ndarray, per_m: float
    ) -> np.ndarray:
        nearer = good & (t > 0.1) & (t < depth)
        depth[nearer] = t[nearer]
        grey[nearer] = paint(index, u, v, per_m)[nearer]
        return nearer

    with np.errstate(divide="ignore", invalid="ignore"):
        t = (HEIGHT_M - y0) / rays[..., 1]
        put(t, np.isfinite(t), 0, x0 + t * rays[..., 0], z0 + t, 6)
        for index, wall in ((1, -WALL_M), (2, WALL_M)):
            t = (wall - x0) / rays[..., 0]
            y = y0 + t * rays[..., 1]
            put(t, np.isfinite(t) & (y > -WALL_TOP_M) & (z0 + t < END_M), index, z0 + t, y, 5)
        t = np.full(depth.shape, END_M - z0)
        y = y0 + t * rays[..., 1]
        put(t, y > -1.5, 3, x0 + t * rays[..., 0], y, 2)
        for box in boxes:
            t = np.full(depth.shape, box.distance_m + box.speed_m * frame - z0)
            x, y = x0 + t * rays[..., 0], y0 + t * rays[..., 1]
            inside = (x > box.left_m) & (x < box.left_m + box.width_m) & (y > HEIGHT_M - box.tall_m)
            on_box |= put(t, inside & (y < HEIGHT_M), 4, x - box.left_m, y, 20)
    sky = ~np.isfinite(depth)
    rgb = np.repeat(grey[..., None], 3, axis=-1)
    rgb[sky] = SKY_RGB
    depth[sky] = 0
    return np.clip(rgb, 0, 255).astype(np.uint8), depth, on_box & (depth > 0)


@dataclass(frozen=True)
class Toy:
    clip: Clip
    posed: Posed
    depth_m: np.ndarray
    box: np.ndarray


def drive(
    boxes: list[Box],
    count: int = 7,
    step_m: float = 0.8,
    held_out: tuple[int, ...] = (),
    fixed_rows: int = 0,
) -> Toy:
    """A straight drive along the toy street with its true poses."""
    pinhole = Camera(FOCAL_PX, FOCAL_PX, WIDTH / 2, HEIGHT / 2, WIDTH, HEIGHT)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, 2, 3] = step_m * np.arange(count)
    cameras = tuple(pinhole.at(pose) for pose in poses)
    seen = [render(camera, boxes, frame) for frame, camera in enumerate(cameras)]
    held = np.zeros(count, bool)
    held[list(held_out)] = True
    clip = Clip(
        frames=np.stack([rgb for rgb, _, _ in seen]),
        times_s=0.1 * np.arange(count),
        camera=np.zeros(count, int),
        rig=(pinhole,),
        valid=np.ones((count, HEIGHT, WIDTH), bool),
        held_out=held,
        source_index=np.arange(count),
        known=Known(world_from_camera=poses, intrinsics=True),
    )
    fixed = np.zeros((HEIGHT, WIDTH), int)
    if fixed_rows:
        fixed[-fixed_rows:] = 1
    posed = Posed(
        cameras=cameras,
        fixed_regions=fixed,
        region_names=("bonnet",) if fixed_rows else (),
        ground=Ground(np.array([0.0, -1.0, 0.0]), HEIGHT_M),
        scale=Scale("poses", 0.0),
        focal=Focal(FOCAL_PX, True),
        standing=step_m == 0,
        fallback="stands" if step_m == 0 else None,
        detected=(),
    )
    return Toy(clip, posed, np.stack([d for _, d, _ in seen]), np.stack([b for _, _, b in seen]))


__all__ = ["Box", "Toy", "drive", "render", "replace"]
