"""Exports of surfaces, read back with OpenCV and trimesh, against drawn streets: depth, flow, mesh.

Scenes are made at draft quality from the frames alone, brought to the true cameras by a similarity.
"""

import sys
import tempfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import trimesh
from jaxtyping import Bool, Float
from scipy.spatial import cKDTree

from dreamdrive.export import export
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.similarity import Similarity, fit_similarity
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive_bench.common.drafts import draft_of
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.markdown import grid, number
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import publish
from dreamdrive_bench.common.twin import TWIN
from dreamdrive_bench.common.worlds import set_of
from dreamdrive_bench.street.case import Case, clip_of, world_of

NEAR_M = 30.0
"""Corners of a mesh nearer than this to a true camera count."""
OUTLIER_PX, OUTLIER = 3.0, 0.05
"""Flow that is off by more than both, the second a share of it, counts as wrong, as KITTI has it."""
_SPLIT_M = 0.2
_ONE = 0.1
"""Neighbouring pixels farther apart than this share of their depth are of two surfaces."""


def main() -> int:
    """Measure, print the table and write all as JSON."""
    parser = parser_of(__doc__, runs="runs/surfaces", markdown=True)
    parser.add_argument("--seeds", type=int, nargs="*", default=[0, 1, 2, 3])
    parser.add_argument("--knowledge", default=TWIN)
    args = parser.parse_args()
    rows = [of_world(seed, args.knowledge, args.runs) for seed in args.seeds]
    names = list(rows[0])
    table = [["", *names]]
    table += [
        [str(seed), *(number(row[n], ".3f") for n in names)]
        for seed, row in zip(args.seeds, rows, strict=True)
    ]
    report = {"machine": describe_machine(), "set": set_of(args.seeds), "seeds": args.seeds, "rows": rows}
    return publish(args, report, grid(table), ())


def of_world(seed: int, knowledge: str, runs: Path) -> dict[str, Any]:
    """All figures of one street."""
    made = world_of(seed)
    scene = draft_of(clip_of(Case(seed, "estimated", "clean")), knowledge, runs / f"scene-{seed}")
    to_world = fit_similarity(scene.cameras, made.cameras)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        return {
            **_depth(scene, made, to_world, place / "depth"),
            **_flow(scene, made, place / "flow"),
            **_mesh(scene, made, to_world, place / "mesh.ply"),
        }


def _depth(scene: Scene, made: DriveTruth, to_world: Similarity, place: Path) -> dict[str, float]:
    """Median of what depth is off, as a share of the true one, where there are both."""
    export(scene, "depth", place)
    files = sorted((place / "depth").glob("*.png"))
    found_m = np.stack([cv2.imread(str(file), cv2.IMREAD_UNCHANGED) for file in files]) / 256 * to_world.scale
    both = (found_m > 0) & (made.depth_m > 0)
    return {"depth, %": 100 * float(np.median(np.abs(found_m[both] / made.depth_m[both] - 1)))}


def _flow(scene: Scene, made: DriveTruth, place: Path) -> dict[str, float]:
    """Median error and share of outliers, where things stand and where they move."""
    export(scene, "flow", place)
    files = sorted((place / "training/flow_occ").glob("*.png"))
    # OpenCV has blue first: known, rows, columns.
    raw = np.stack([cv2.imread(str(file), cv2.IMREAD_UNCHANGED) for file in files])[..., ::-1]
    found_px, known = (raw[..., :2].astype(float) - 32768) / 64, raw[..., 2] > 0
    true_px = made.flow_px[: len(files)]
    off_px = np.linalg.norm(found_px - true_px, axis=-1)
    wrong = (off_px > OUTLIER_PX) & (off_px > OUTLIER * np.linalg.norm(true_px, axis=-1))
    seen = known & ~made.sky[: len(files)]
    moving = made.moving[: len(files)]
    return _flow_of("stands", off_px, wrong, seen & ~moving) | _flow_of("moves", off_px, wrong, seen & moving)


def _flow_of(
    name: str,
    off_px: Float[np.ndarray, "f h w"],
    wrong: Bool[np.ndarray, "f h w"],
    where: Bool[np.ndarray, "f h w"],
) -> dict[str, float]:
    if not where.any():
        return {f"flow {name}, px": float("nan"), f"outliers {name}, %": float("nan")}
    return {
        f"flow {name}, px": float(np.median(off_px[where])),
        f"outliers {name}, %": 100 * float(wrong[where].mean()),
    }


def _mesh(scene: Scene, made: DriveTruth, to_world: Similarity, place: Path) -> dict[str, float]:
    """Distance of corners from the nearest patch of the true surface that some frame shows."""
    export(scene, "mesh", place)
    corners_m = to_world(np.asarray(trimesh.load(place, process=False).vertices))
    cameras_m = np.stack([camera.world_from_camera[:3, 3] for camera in made.cameras])
    corners_m = corners_m[cKDTree(cameras_m).query(corners_m)[0] < NEAR_M]
    middles_m, normals, reach_m = _true_patches(made)
    away_m, nearest = cKDTree(middles_m).query(corners_m)
    along_m = np.abs(((corners_m - middles_m[nearest]) * normals[nearest]).sum(axis=1))
    off_m = np.maximum(along_m, away_m - reach_m[nearest])
    return {"mesh, m": float(np.median(off_m)), "within 0.2 m, %": 100 * float((off_m < _SPLIT_M).mean())}


def _true_patches(
    made: DriveTruth,
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
    """What the frames truly show of what stands: middle, normal and radius of the patch of each pixel."""
    patches: list[tuple[np.ndarray, ...]] = []
    for camera, depth_m, moving in zip(made.cameras, made.depth_m, made.moving, strict=True):
        places_m = depth_m[..., None] * camera.rays() @ camera.world_from_camera[:3, :3].T
        here_m = places_m[:-1, :-1]
        right_m, down_m = places_m[:-1, 1:] - here_m, places_m[1:, :-1] - here_m
        reach_m = np.maximum(np.linalg.norm(right_m, axis=2), np.linalg.norm(down_m, axis=2))
        normal = np.cross(right_m, down_m)
        size_m2 = np.linalg.norm(normal, axis=2)
        z_m = depth_m[:-1, :-1]
        # At an outline the neighbour is of another surface: the patch would span both.
        counts = (z_m > 0) & (z_m < 2 * NEAR_M) & ~moving[:-1, :-1] & (size_m2 > 0) & (reach_m < _ONE * z_m)
        middles_m = here_m + camera.world_from_camera[:3, 3]
        normal /= np.maximum(size_m2, 1e-12)[..., None]
        patches.append((middles_m[counts], normal[counts], reach_m[counts]))
    middles_m, normals, reach_m = (np.concatenate(part) for part in zip(*patches, strict=True))
    return middles_m, normals, reach_m


if __name__ == "__main__":
    sys.exit(main())
