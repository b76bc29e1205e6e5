"""How well the Gaussians of a scene tell which cells of the plane are taken.

Drawn streets of edition 1, recorded by the front camera for 24 frames, and the scenes made of them at
quality draft with known poses. At three times, within 30 m of the camera: recall is the share of cells on
those sides of boxes that face the camera and are in sight at that time which are taken in the scene.
Precision is, of the cells that are taken in the scene within the field of view, the share in which a box or
another solid thing is that is 0.3 to 2 m high. Both are counted in the very cell, and in it or one of the
eight around it. Cautious are the options that planners use.
"""

from functools import cache, partial
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.drive import CAUTIOUS, CELL_M, OCCUPANCY, OccupancyOptions, obstacles_of
from dreamdrive.scene.level import level_from_world
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.truth import DriveTruth, WorldBox
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.made import scene_of
from dreamdrive_bench.common.markdown import table
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import publish
from dreamdrive_bench.common.worlds import DEVELOPMENT, set_of
from streetworld import make_street

_FRAMES, _RATE_HZ, _SIZE, _QUALITY = 24, 10.0, (320, 192), "draft"
_AT = (8, 16, 23)
_OPTIONS = {"default": OCCUPANCY, "cautious": CAUTIOUS}
_REACH_M, _NEAREST_M = 30.0, 2.0
_APART_M = 0.1
_LOOKED_AT = (0.4, 0.6)  # of the height of a box
_COUNTS = ("sides", "found", "found_near", "moving", "moving_near", "taken", "right", "right_near")

Cells = Int[np.ndarray, "n 2"]


def main() -> int:
    """Make the scenes, count, print the table."""
    parser = parser_of(__doc__, runs="runs/occupancy", markdown=True)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(DEVELOPMENT))
    args = parser.parse_args()
    rows: list[dict[str, Any]] = []
    for seed in args.seeds:
        drive = _street(seed)
        scene = scene_of(partial(_street, seed), _QUALITY, args.runs / f"street-{seed}")
        for name, options in _OPTIONS.items():
            rows.append({"seed": seed, "options": name} | _counted(drive, scene, options))
            print(seed, name, _shares(rows[-1]), flush=True)
    rows += [_all(rows, name) for name in _OPTIONS]
    report = {"machine": describe_machine(), "worlds": set_of(args.seeds), "rows": rows}
    names = list(_shares(rows[-1]))
    lines = [
        [str(row["seed"]), row["options"], *(f"{_shares(row)[name]:.3f}" for name in names)] for row in rows
    ]
    return publish(args, report, table(["street", "options", *names], lines) + "\n", ())


def _all(rows: list[dict[str, Any]], options: str) -> dict[str, Any]:
    of = [row for row in rows if row["options"] == options]
    return {"seed": "all", "options": options} | {name: sum(row[name] for row in of) for name in _COUNTS}


@cache
def _street(seed: int) -> DriveTruth:
    return make_street(seed, _FRAMES, _RATE_HZ, _SIZE)


def _shares(row: dict[str, Any]) -> dict[str, float]:
    return {
        "recall": row["found"] / row["sides"],
        "recall, near": row["found_near"] / row["sides"],
        "of moving ones, near": row["moving_near"] / max(row["moving"], 1),
        "precision": row["right"] / row["taken"],
        "precision, near": row["right_near"] / row["taken"],
    }


def _counted(drive: DriveTruth, scene: Scene, options: OccupancyOptions) -> dict[str, int]:
    level = level_from_world(scene)
    obstacles = obstacles_of(scene, [float(drive.times_s[frame]) for frame in _AT], options)
    solid = _solid(drive, level, options)
    counts: dict[str, int] = dict.fromkeys(_COUNTS, 0)
    for step, frame in enumerate(_AT):
        taken = _cells(obstacles.at(step))
        sides, moving = _facing(drive, frame, level)
        real = np.concatenate([solid, *(_footprint(box, frame, level) for box in drive.boxes)])
        seen = taken[_in_view(taken, drive, frame, level)]
        found = _touched(sides, taken)
        figures = (len(sides), _among(sides, taken), found, moving, found & moving, len(seen))
        figures += (_among(seen, real), _touched(seen, real))
        for name, value in zip(_COUNTS, figures, strict=True):
            counts[name] += int(np.sum(value))
    return counts


def _cells(places_m: Float[np.ndarray, "n 2"]) -> Cells:
    return np.floor(places_m / CELL_M).astype(np.int64)


def _among(cells: Cells, others: Cells) -> Bool[np.ndarray, " n"]:
    known = set(map(tuple, others.tolist()))
    return np.array([tuple(cell) in known for cell in cells.tolist()], dtype=bool)


def _touched(cells: Cells, others: Cells) -> Bool[np.ndarray, " n"]:
    """Which cells are among others, or beside one of them."""
    around = np.stack(np.meshgrid((-1, 0, 1), (-1, 0, 1)), axis=-1).reshape(-1, 2)
    return _among(cells, (others[:, None] + around).reshape(-1, 2))


def _solid(drive: DriveTruth, level: Float[np.ndarray, "4 4"], options: OccupancyOptions) -> Cells:
    """Cells in which any frame sees something else than road users, at the height of a car."""
    found: list[Cells] = []
    for frame, camera in enumerate(drive.cameras):
        depth_m = drive.depth_m[frame]
        rows = (depth_m > 0) & (drive.instance[frame] == 0)
        points = (camera.rays()[rows] * depth_m[rows][:, None]) @ camera.world_from_camera[:3, :3].T
        points = (points + camera.world_from_camera[:3, 3]) @ level[:3, :3].T + level[:3, 3]
        high = (points[:, 2] >= options.lowest_m) & (points[:, 2] <= options.highest_m)
        found.append(np.unique(_cells(points[high, :2]), axis=0))
    return np.unique(np.concatenate(found), axis=0)


def _footprint(box: WorldBox, frame: int, level: Float[np.ndarray, "4 4"]) -> Cells:
    pose, half = level @ box.world_from_box[frame], box.size_m / 2
    spans = [np.linspace(-end, end, max(2, int(2 * end / _APART_M))) for end in half[:2]]
    flat = np.stack(np.meshgrid(*spans), axis=-1).reshape(-1, 2)
    return np.unique(_cells(flat @ pose[:2, :2].T + pose[:2, 3]), axis=0)


def _facing(
    drive: DriveTruth, frame: int, level: Float[np.ndarray, "4 4"]
) -> tuple[Cells, Bool[np.ndarray, " n"]]:
    """Cells on sides of boxes that face the camera and are in sight, and which are of moving boxes."""
    eye = (level @ drive.cameras[frame].world_from_camera)[:3, 3]
    cells: list[Cells] = []
    moving: list[bool] = []
    for box in drive.boxes:
        pose, (x, y, z) = level @ box.world_from_box[frame], box.size_m / 2
        for normal, out_m, half_m in ((0, x, y), (0, -x, y), (1, y, x), (1, -y, x)):
            way, along = np.sign(out_m) * pose[:3, normal], pose[:3, 1 - normal]
            middle = pose[:3, 3] + abs(out_m) * way
            if (eye - middle) @ way <= 0:
                continue
            ends = half_m - _APART_M / 2
            places = middle + np.linspace(-ends, ends, max(2, int(2 * half_m / _APART_M)))[:, None] * along
            for share in _LOOKED_AT:
                points = places + (2 * share - 1) * z * pose[:3, 2]
                seen = _in_sight(points, box, drive, frame, level)
                seen &= np.linalg.norm(points[:, :2] - eye[:2], axis=1) <= _REACH_M
                cells.append(_cells(points[seen, :2]))
                moving += [box.moving] * int(seen.sum())
    if not cells:
        return np.zeros((0, 2), np.int64), np.zeros(0, bool)
    found, first = np.unique(np.concatenate(cells), axis=0, return_index=True)
    return found, np.array(moving, dtype=bool)[first]


def _in_sight(
    points: Float[np.ndarray, "n 3"],
    box: WorldBox,
    drive: DriveTruth,
    frame: int,
    level: Float[np.ndarray, "4 4"],
) -> Bool[np.ndarray, " n"]:
    camera = drive.cameras[frame]
    local = points @ np.linalg.inv(level @ camera.world_from_camera)[:3, :3].T
    local = local + np.linalg.inv(level @ camera.world_from_camera)[:3, 3]
    ahead = np.maximum(local[:, 2], 1e-3)
    u = np.floor(camera.fx_px * local[:, 0] / ahead + camera.cx_px).astype(int)
    v = np.floor(camera.fy_px * local[:, 1] / ahead + camera.cy_px).astype(int)
    seen = (local[:, 2] > 1) & (u >= 0) & (u < camera.width_px) & (v >= 0) & (v < camera.height_px)
    seen[seen] = drive.instance[frame][v[seen], u[seen]] == box.instance
    return seen


def _in_view(
    cells: Cells, drive: DriveTruth, frame: int, level: Float[np.ndarray, "4 4"]
) -> Bool[np.ndarray, " n"]:
    """Cells before the camera, between the sides of its picture and within reach."""
    camera = drive.cameras[frame]
    pose = level @ camera.world_from_camera
    away = (cells + 0.5) * CELL_M - pose[:2, 3]
    ahead = pose[:2, 2] / np.linalg.norm(pose[:2, 2])
    along, aside = away @ ahead, np.abs(away @ np.array([-ahead[1], ahead[0]]))
    near = (along > _NEAREST_M) & (np.linalg.norm(away, axis=1) <= _REACH_M)
    return near & (aside < along * camera.width_px / 2 / camera.fx_px)
