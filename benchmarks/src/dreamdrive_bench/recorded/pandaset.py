"""Truth of the PandaSet clip: masks of moving vehicles from its labelled boxes, and its camera path."""

import json
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from dreamdrive.metrics.retrieval import retrieval

MOVING_LABELS = ("Car", "Medium-sized Truck", "Motorcycle")
UNKNOWN_LABEL = "Pedestrian"
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


@dataclass(frozen=True)
class Movers:
    """What moves in the frames, by hulls of boxes, each less the hulls of all nearer boxes.

    Attributes:
        counted: Of cars, medium-sized trucks and motorcycles that are ``Moving``, within 50 m, at least 12 px
            high (F, H, W).
        ignored: Of what else may move, and is neither right nor wrong to be found (F, H, W): movers that are
            farther, smaller or of another kind, and pedestrians, whose motion is not labelled.
    """

    counted: np.ndarray
    ignored: np.ndarray

    def figures(
        self, dynamic_share: list[np.ndarray], errors: dict[int, np.ndarray]
    ) -> dict[str, float | None]:
        """How well motion is found and shown.

        Args:
            dynamic_share: Share of each pixel that dynamic Gaussians fill (H, W), of each frame.
            errors: Rendered less recorded colour (H, W, 3) in units of 1, by the index of held-out frames.

        Returns:
            IoU over all frames, and PSNR inside the hulls.
        """
        judged = ~self.ignored
        inside = [errors[k][self.counted[k]].ravel() for k in errors]
        squared = np.square(np.concatenate(inside)) if inside else np.zeros(0)
        return {
            "moving_iou": retrieval(self.counted[judged], np.stack(dynamic_share)[judged]).iou,
            "moving_psnr": float(-10 * np.log10(squared.mean())) if squared.size else None,
        }


def moving_masks(clip_dir: Path, frames: list[int], size: tuple[int, int]) -> Movers:
    """The truth of what moves in some frames."""
    boxes = json.loads((clip_dir / "cuboids.json").read_text())["frames"]
    poses = camera_path(clip_dir, frames)
    matrix = pinhole(clip_dir, size)
    masks = [_masks(boxes[i], pose, matrix, size) for i, pose in zip(frames, poses, strict=True)]
    return Movers(*(np.stack(found) for found in zip(*masks, strict=True)))


def _masks(
    boxes: list[dict], world_from_camera: np.ndarray, matrix: np.ndarray, size: tuple[int, int]
) -> tuple[np.ndarray, np.ndarray]:
    camera_from_world = np.linalg.inv(world_from_camera)
    seen = []
    for box in boxes:
        centre = camera_from_world[:3, :3] @ np.array(box["position"]) + camera_from_world[:3, 3]
        hull = _hull(box, camera_from_world, matrix)
        if hull is not None:
            seen.append((float(np.linalg.norm(centre)), box, hull))
    seen.sort(key=lambda entry: entry[0])
    counted, ignored, nearer = (np.zeros((size[1], size[0]), np.uint8) for _ in range(3))
    for range_m, box, hull in seen:
        filled = cv2.fillConvexPoly(np.zeros_like(nearer), np.round(hull - 0.5).astype(np.int32), 1)
        moves = box["motion"] == "Moving"
        near = range_m <= MAX_RANGE_M and np.ptp(hull[:, 1]) >= MIN_HEIGHT_PX
        if moves and near and box["label"] in MOVING_LABELS:
            counted |= filled & (1 - nearer)
        elif moves or box["label"].startswith(UNKNOWN_LABEL):
            ignored |= filled & (1 - nearer)
        nearer |= filled
    return counted > 0, ignored > 0


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
