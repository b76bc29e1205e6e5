"""Scenes of drawn streets, with their depth against the truth."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool

from dreamdrive.build import build_scene
from dreamdrive.evaluate import Truth, evaluate_decomposition
from dreamdrive.options import QUALITIES
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.street.truth import DriveTruth, Semantic
from dreamdrive_bench.common.recorder import Recorder
from dreamdrive_bench.street.case import Case, clip_of, world_of
from dreamdrive_bench.street.measure import frames_of, likeness_of
from dreamdrive_bench.street.views import counted, true_frames

OFF = 0.1
FAR_M = 80.0
_VEHICLES = (Semantic.CAR, Semantic.VAN, Semantic.TRUCK, Semantic.BUS)
_TWO_WHEELERS = (Semantic.BICYCLE, Semantic.MOTORCYCLE)
_VIEWS = ("held_out", "shift_2")


def judge_world(case: Case, knowledge: str, folder: Path) -> dict[str, Any]:
    """The figures of one street; ``knowledge`` as of ``--knowledge``."""
    stages, made = Recorder(), world_of(case.seed)
    options = replace(QUALITIES["draft"], knowledge=knowledge)
    built = build_scene(clip_of(case), options, run=stages)
    scene = built.scene
    views: dict[str, Any] = {}
    for view in _VIEWS:
        shown, truth = frames_of(scene, case.seed, view), true_frames(case.seed, view, folder)
        counts = scene.held_out if view == "held_out" else counted(case.seed, view)
        views[view] = likeness_of(shown, truth, counts)["psnr"]
    labels = evaluate_decomposition(scene, Truth.of(made))
    geometry = built.geometry
    return {
        **views,
        "mask_iou": labels.mask.iou,
        "fake_motion_mm": None if labels.fake is None else 1000 * labels.fake.mean_m,
        "box_off_m": None if labels.boxes is None else labels.boxes.position_median_m,
        **depth_shares(geometry, made, ~scene.held_out),
        "fallback": geometry.fallback,
        "look_s": stages.seconds["look"],
        "geometry_s": stages.seconds["geometry"],
        "all_s": sum(stages.seconds.values()),
    }


def depth_shares(
    geometry: Geometry, made: DriveTruth, used: Bool[np.ndarray, " f"]
) -> dict[str, float | None]:
    """Shares of pixels whose depth is off, by what they show, and of the intervals that hold the truth."""
    true, depth = made.depth_m[used].astype(np.float64), geometry.depth_m[used].astype(np.float64)
    counts, moving = (true > 0) & (true < FAR_M), made.moving[used]
    vehicle, wheels = (np.isin(made.semantic[used], kinds) for kinds in (_VEHICLES, _TWO_WHEELERS))
    still = counts & (depth > 0) & ~moving & (made.instance[used] == 0)
    scale = np.median(true[still] / depth[still])
    off = np.where(depth > 0, np.abs(depth * scale - true) / np.maximum(true, 1e-3), np.inf)
    groups = {
        "standing": vehicle & ~moving,
        "moving": vehicle & moving,
        "two_wheelers": wheels & moving,
        "people": moving & (made.semantic[used] == Semantic.PEDESTRIAN),
        "static": ~moving,
    }
    found = {f"{name}_off": _share(off[counts & inside] > OFF) for name, inside in groups.items()}
    told, spread = counts & (depth > 0), geometry.spread
    held = {"": np.ones_like(told), **{f"{name}_": groups[name] for name in ("standing", "moving")}}
    for name, inside in held.items():
        there = told & inside
        found[f"{name}held_by_68"] = None if spread is None else _share(off[there] < spread[used][there])
    return found


def _share(of: Bool[np.ndarray, " n"]) -> float | None:
    return float(of.mean()) if len(of) else None
