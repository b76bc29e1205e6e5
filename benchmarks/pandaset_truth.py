"""Truth of the PandaSet clip: masks of moving vehicles from its labelled boxes, and its camera path."""

import json
from pathlib import Path

import cv2
import numpy as np

MOVING_LABELS = ("Car", "Medium-sized Truck", "Motorcycle")
MAX_RANGE_M = 50.0
MIN_HEIGHT_PX = 12.0


def camera_path(clip_dir: Path, frames: list[int], camera: str = "front_camera") -> np.ndarray:
    """world_from_camera (F, 4, 4) of the recording, world z up."""
    cameras = json.loads((clip_dir / "cameras.json").read_text())["cameras"]
    return np.array([cameras[camera]["camera_to_world"][i] for i in frames], dtype=np.float64)


def pinhole(clip_dir: Path, size: tuple[int, int]) -> np.ndarray:
    """Intrinsic matrix (3, 3) of the front camera at ``size``, pixel centres at +0.5."""
    meta = json.loads((clip_dir / "meta.json").read_text())
    scale = size[0] / meta["width"]
    k = meta["intrinsics"]
    return np.array(
        [
            [k["fx"] * scale, 0, (k["cx"] + 0.5) * scale],
            [0, k["fy"] * scale, (k["cy"] + 0.5) * scale],
            [0, 0, 1],
        ]
    )


def moving_masks(clip_dir: Path, frames: list[int], size: tuple[int, int]) -> np.ndarray:
    """Hulls (F, H, W) of the boxes that move, less the hulls of all nearer boxes.

    Counted: cars, medium-sized trucks and motorcycles that are ``Moving``, within 50 m, at least 12 px high.
    """
    boxes = json.loads((clip_dir / "cuboids.json").read_text())["frames"]
    poses = camera_path(clip_dir, frames)
    matrix = pinhole(clip_dir, size)
    return np.stack([_mask(boxes[i], pose, matrix, size) for i, pose in zip(frames, poses, strict=True)])


def _mask(
    boxes: list[dict], world_from_camera: np.ndarray, matrix: np.ndarray, size: tuple[int, int]
) -> np.ndarray:
    camera_from_world = np.linalg.inv(world_from_camera)
    seen = []
    for box in boxes:
        centre = camera_from_world[:3, :3] @ np.array(box["position"]) + camera_from_world[:3, 3]
        hull = _hull(box, camera_from_world, matrix)
        if hull is not None:
            seen.append((float(np.linalg.norm(centre)), box, hull))
    seen.sort(key=lambda entry: entry[0])
    mask = np.zeros((size[1], size[0]), np.uint8)
    nearer = np.zeros_like(mask)
    for range_m, box, hull in seen:
        filled = cv2.fillConvexPoly(np.zeros_like(mask), np.round(hull - 0.5).astype(np.int32), 1)
        counts = box["label"] in MOVING_LABELS and box["motion"] == "Moving" and range_m <= MAX_RANGE_M
        if counts and np.ptp(hull[:, 1]) >= MIN_HEIGHT_PX:
            mask |= filled & (1 - nearer)
        nearer |= filled
    return mask > 0


def _hull(box: dict, camera_from_world: np.ndarray, matrix: np.ndarray) -> np.ndarray | None:
    width, length, height = box["size_wlh"]
    corners = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    corners = corners * (width, length, height)
    c, s = np.cos(box["yaw"]), np.sin(box["yaw"])
    world = corners @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T + box["position"]
    local = world @ camera_from_world[:3, :3].T + camera_from_world[:3, 3]
    if (local[:, 2] > 0.1).sum() < 8:
        near = local[:, 2] > 0.1
        if not near.any():
            return None
        local = np.concatenate([local[near], _edge_cuts(local, near)])
    pixels = local @ matrix.T
    return cv2.convexHull((pixels[:, :2] / pixels[:, 2:]).astype(np.float32))[:, 0]


def _edge_cuts(local: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Where the segments from corners in front to corners behind cross the plane z = 0.1 m."""
    cuts = []
    for a in local[near]:
        for b in local[~near]:
            cuts.append(a + (b - a) * (a[2] - 0.1) / (a[2] - b[2]))
    return np.array(cuts)


def path_error(estimated: np.ndarray, truth: np.ndarray) -> tuple[float, float]:
    """Position RMSE after similarity alignment, in the truth's metres, and the length of the true path."""
    a, b = estimated[:, :3, 3], truth[:, :3, 3]
    a0, b0 = a - a.mean(0), b - b.mean(0)
    u, s, vt = np.linalg.svd(b0.T @ a0)
    flip = np.diag([1, 1, np.sign(np.linalg.det(u @ vt))])
    rotation = u @ flip @ vt
    scale = (s * np.diag(flip)).sum() / (a0**2).sum()
    residual = b0 - scale * a0 @ rotation.T
    return float(np.sqrt((residual**2).sum(1).mean())), float(
        np.linalg.norm(np.diff(b, axis=0), axis=1).sum()
    )
