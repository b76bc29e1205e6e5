"""Depth, classes and camera of drawn streets against their exact truth."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive_bench.knowledge.cameras import See, errors_deg
from dreamdrive_bench.knowledge.lidar import relative_errors
from dreamdrive_bench.recorded.lidar import FAR_M, NEAR_M
from dreamdrive_train.street_network import CLASS_OF
from streetworld import make_street

SIZE = 480, 270
FRAMES, FPS = 3, 1.0
_FOV_SHARE = 0.15


def judge_drawn(edition: int, seeds: Iterable[int], see: See) -> dict[str, Any]:
    """Means over streets: errors of depth and camera, and pooled intersections over unions of classes."""
    found: list[dict[str, float]] = []
    confusion = np.zeros((len(StreetClass), len(StreetClass)), int)
    for seed in seeds:
        made = make_street(seed, FRAMES, FPS, SIZE, edition=edition)
        look = see(made.frames)
        true = CLASS_OF[made.semantic]
        confusion += np.bincount(
            true.astype(int).ravel() * len(StreetClass) + look.classes.ravel(), minlength=confusion.size
        ).reshape(confusion.shape)
        camera = made.cameras[0]
        up = made.ground.normal_world
        pairs = zip(look.cameras, made.cameras, strict=True)
        off_deg = np.mean([errors_deg(said, each, up) for said, each in pairs], axis=0)
        hfov_rad = 2 * np.arctan(camera.width_px / 2 / camera.fx_px)
        found.append(
            {
                **depth_errors(look.depth, made),
                "hfov_within_15_percent": float(abs(look.camera.hfov_rad / hfov_rad - 1) <= _FOV_SHARE),
                "horizon_error_deg": float(off_deg[0]),
                "roll_error_deg": float(off_deg[1]),
            }
        )
    means = {name: float(np.mean([each[name] for each in found])) for name in found[0]}
    return {"edition": edition, "streets": len(found), **means, "class_iou": ious(confusion)}


def depth_errors(depth: Float[np.ndarray, "f h w"], made: DriveTruth) -> dict[str, float]:
    """Mean relative errors after a factor a picture, and in metres by the true height of the camera."""
    height_m = abs(float(made.ground.height_m(made.cameras[0].world_from_camera[:3, 3])))
    aligned, metric = [], []
    for said, true_m in zip(depth, made.depth_m, strict=True):
        near = (true_m >= NEAR_M) & (true_m <= FAR_M)
        aligned.append(relative_errors(said.ravel(), true_m.ravel(), near.ravel())[near.ravel()].mean())
        scaled = np.where(said > 0, said * height_m, FAR_M).clip(NEAR_M, FAR_M)
        metric.append((np.abs(scaled - true_m)[near] / true_m[near]).mean())
    return {"abs_rel": float(np.mean(aligned)), "abs_rel_in_metres": float(np.mean(metric))}


def ious(confusion: np.ndarray) -> dict[str, float]:
    """Intersection over union of the classes that there are."""
    same = confusion.diagonal()
    union = confusion.sum(axis=0) + confusion.sum(axis=1) - same
    return {each.name: float(same[each] / union[each]) for each in StreetClass if confusion[each].any()}
