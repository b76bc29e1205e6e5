"""Whether a rendered drive is more consistent than the references it was made from."""

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import UInt8

from dreamdrive.evaluate import Consistency, evaluate_consistency
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive_bench.common.keep import kept
from dreamdrive_bench.street.case import Case, References, references_digest, references_of, world_of
from dreamdrive_bench.street.measure import frames_of
from dreamdrive_bench.street.views import true_cameras

Figures = dict[str, float | str | None]
MEASURES = {
    "ate_percent": "path: distance (ATE), %",
    "translation_percent": "path: translation (RPE), %",
    "rotation_deg_per_m": "path: rotation (RPE), deg/m",
    "epipolar_miss_1": "matches off their epipolar line, 1 apart, share",
    "epipolar_miss_4": "the same, 4 apart",
    "epipolar_miss_8": "the same, 8 apart",
    "warp_1": "warp error, 1 apart, grey levels",
    "warp_4": "the same, 4 apart",
    "warp_8": "the same, 8 apart",
}
PATH_MEASURES = tuple(name for name, text in MEASURES.items() if text.startswith("path"))
FOUND_BY = "found_by"
"""What found the path in a video; paths are compared where it is the same in all three."""
KINDS = ("truth", "references", "rendered")
SHARPNESS = "sharpness"
RESAMPLES = 2000


def consistency_of(scene: Scene, case: Case, runs: Path) -> dict[str, Figures]:
    """Errors of the scene along the recorded path, of the frames it was made from, and of the truth."""
    return {
        "truth": _of_frames(case.seed, "clean", runs),
        "references": _of_frames(case.seed, case.references, runs),
        # The focal length is the scene's own, as in all views of it.
        "rendered": errors_of(frames_of(scene, case.seed, "recorded"), case.seed, scene.cameras[0]),
    }


def errors_of(frames: UInt8[np.ndarray, "f h w 3"], seed: int, intrinsics: Camera) -> Figures:
    """Errors of a video that was asked to follow the recorded path; what moves counts in colours only."""
    made = world_of(seed)
    poses = np.stack([camera.world_from_camera for camera in true_cameras(seed, "recorded")])
    asked = Trajectory(poses, made.times_s)
    found = evaluate_consistency(frames, made.times_s, intrinsics, asked, moving=made.moving)
    return {**flat(found), SHARPNESS: sharpness(frames)}


def sharpness(frames: UInt8[np.ndarray, "f h w 3"]) -> float:
    """Mean change of grey from a pixel to the next, in grey levels: a blurred video scores well elsewhere."""
    grey = frames.mean(axis=3)
    return float(np.abs(np.diff(grey, axis=1)).mean() + np.abs(np.diff(grey, axis=2)).mean()) / 2


def flat(found: Consistency) -> Figures:
    """By name, all numbers lower where better; None where nothing was measured."""
    figures: Figures = {FOUND_BY: found.found_by}
    for name in PATH_MEASURES:
        figures[name] = None if found.path is None else getattr(found.path, name)
    for at in found.gaps:
        share = None if at.epipolar is None else at.epipolar.share
        figures[f"epipolar_miss_{at.gap}"] = None if share is None else 1 - share
        figures[f"warp_{at.gap}"] = None if at.warp is None else at.warp.grey_levels
    return figures


def _of_frames(seed: int, references: References, runs: Path) -> Figures:
    """Errors of the references of a world, kept."""
    path, key = runs / "truth" / f"consistency-{seed}-{references}.json", references_digest(seed, references)
    return kept(
        path, key, lambda: errors_of(references_of(seed, references), seed, world_of(seed).cameras[0])
    )


def consistency_tables(records: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """For each kind of poses a row a measure: means over worlds, and how they compare."""
    tables: list[dict[str, Any]] = []
    measured = [record for record in records if "consistency" in record]
    for geometry in dict.fromkeys(record["geometry"] for record in measured):
        found = [record["consistency"] for record in measured if record["geometry"] == geometry]
        rows = [row for name in MEASURES if (row := _row(name, found)) is not None]
        halved = [row["measure"] for row in rows if row["ratio"] <= 0.5]
        sharp = {kind: float(np.mean([world[kind][SHARPNESS] for world in found])) for kind in KINDS}
        methods = {kind: dict(Counter(str(world[kind][FOUND_BY]) for world in found)) for kind in KINDS}
        table = {"geometry": geometry, "rows": rows, "at_most_half": halved, SHARPNESS: sharp}
        tables.append({**table, FOUND_BY: methods})
    return tables


def _row(name: str, found: list[dict[str, Figures]]) -> dict[str, Any] | None:
    """One measure, over the worlds in which all three have it, of paths found in one way."""
    if name in PATH_MEASURES:
        found = [world for world in found if len({world[kind][FOUND_BY] for kind in KINDS}) == 1]
    known = [[world[kind][name] for kind in KINDS] for world in found]
    values = np.array([row for row in known if None not in row], dtype=np.float64)
    if not len(values):
        return None
    truth, references, rendered = values.mean(axis=0).tolist()
    rng = np.random.default_rng(0)
    drawn = values[rng.integers(0, len(values), (RESAMPLES, len(values)))].mean(axis=1)
    low, high = np.quantile(drawn[:, 2] / drawn[:, 1], [0.025, 0.975]).tolist()
    worse = references - truth
    return {
        "measure": name,
        "worlds": len(values),
        "truth": truth,
        "references": references,
        "rendered": rendered,
        "ratio": rendered / references,
        "low": low if len(values) > 1 else None,
        "high": high if len(values) > 1 else None,
        "excess_ratio": (rendered - truth) / worse if worse > 0 else None,
    }
