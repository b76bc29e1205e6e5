"""One fit of the street benchmark: a representation on a case, its views, and how good they are."""

import json
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch
from _street_case import VIEWS, Case, Start, to_scene, true_cameras, true_frames, world_of
from jaxtyping import Float, UInt8

from dreamdrive.decompose import cast, error_maps, group, score
from dreamdrive.evaluate.decomposition import evaluate_decomposition
from dreamdrive.evaluate.extractors import Extractor
from dreamdrive.evaluate.truth import Truth
from dreamdrive.evaluate.video import windows
from dreamdrive.fit import Parts, Representation, fit
from dreamdrive.held_out import likeness
from dreamdrive.options import Quality
from dreamdrive.scene.atomic import new_file
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.similarity import fit_similarity
from dreamdrive.splat.scene_view import render_scene
from dreamdrive.stages import Progress, stage_seed

WINDOW, STRIDE = 16, 2
Features = dict[str, Float[np.ndarray, "n d"]]
"""Of each network and view, by ``NETWORK/VIEW``."""


@dataclass(frozen=True)
class Fitted:
    """A scene and what it cost beyond the static fit.

    Attributes:
        scene: The result.
        steps: Steps of the joint fit.
        seconds: Of decomposition and joint fit. They are the processor's, summed over threads: what else runs
            on the machine does not count, and with a core for each worker they are those of a clock.
        step_s: Of the joint fit, a step.
    """

    scene: Scene
    steps: int
    seconds: float
    step_s: float


def fit_case(begin: Start, representation: Representation, quality: Quality, tell: Progress) -> Fitted:
    """Decompose, if the representation does, and fit."""
    at = time.process_time()
    parts = _parts(begin, representation, quality)
    from_here = time.process_time()
    scene = fit(
        begin.clip,
        begin.geometry,
        parts,
        begin.static,
        quality.fit,
        quality.motion(representation),
        quality.densify,
        stage_seed(0, "fit"),
        tell,
    )
    end = time.process_time()
    return Fitted(scene, quality.fit.steps, end - at, (end - from_here) / quality.fit.steps)


def _parts(begin: Start, representation: Representation, quality: Quality) -> Parts:
    fitted, nothing = begin.static.gaussians, torch.zeros(0, dtype=torch.int64)
    if representation == "static":
        return Parts(fitted, fitted.select(nothing), None, ())
    if representation != "hybrid":
        return Parts(begin.seeds.select(nothing), fitted, None, ())
    clip, geometry, seeds = begin.clip, begin.geometry, begin.seeds
    sky, exposure = begin.static.sky, begin.static.exposure
    errors = error_maps(clip, geometry, fitted, sky, exposure, quality.score.error)
    scores = score(clip, geometry, seeds, errors, quality.score, stage_seed(0, "score"), lambda *_: None)
    grouping = group(clip, geometry, seeds, scores, quality.group)
    moving = cast(clip, geometry, seeds, grouping, quality.cast)
    return Parts(fitted.select(grouping.static), moving.gaussians, moving.tracks, moving.actors)


def frames_of(scene: Scene, seed: int, view: str) -> UInt8[np.ndarray, "f h w 3"]:
    """What a scene shows where a view's true cameras are; of held-out frames from its own cameras."""
    similarity = fit_similarity(scene.cameras, world_of(seed).cameras)
    pictures: list[np.ndarray] = []
    for own, camera, t_s in zip(scene.cameras, true_cameras(seed, view), scene.times_s, strict=True):
        # The focal length is the scene's own: with another one the same pixels would show other things.
        wanted = own if view == "held_out" else own.at(to_scene(camera, similarity).world_from_camera)
        colour = render_scene(scene, wanted, float(t_s)).colour
        pictures.append((colour.clamp(0, 1) * 255).round().to(torch.uint8).numpy())
    return np.stack(pictures)


def measure(
    fitted: Fitted, case: Case, extractors: list[Extractor], folder: Path
) -> tuple[dict[str, Any], Features, UInt8[np.ndarray, "h w 3"]]:
    """Figures of each view against the clean truth, the features of the novel ones, and a picture."""
    views: dict[str, Any] = {}
    features: Features = {}
    middle = np.zeros((1, 1, 3), dtype=np.uint8)
    whole = np.ones(world_of(case.seed).depth_m.shape[1:], dtype=bool)
    for view in VIEWS:
        truth, shown = true_frames(case.seed, view, folder), frames_of(fitted.scene, case.seed, view)
        chosen = np.flatnonzero(fitted.scene.held_out) if view == "held_out" else np.arange(len(truth))
        found = [likeness(shown[k].astype(np.float32) / 255, truth[k], whole) for k in chosen]
        views[view] = {
            "psnr": float(np.mean([f.psnr for f in found])),
            "ssim": float(np.mean([f.ssim for f in found])),
        }
        if view != "held_out":
            features |= {f"{name}/{view}": rows for name, rows in features_of(shown, extractors).items()}
        if view == "shift_2":
            middle = shown[len(shown) // 2]
    return views, features, middle


def features_of(frames: UInt8[np.ndarray, "f h w 3"], extractors: list[Extractor]) -> Features:
    """By the name of the Fréchet distance: a row a frame, or a row a window."""
    found: Features = {}
    for extractor in extractors:
        if extractor.window:
            rows = [extractor.features(part) for part in windows(torch.from_numpy(frames), WINDOW, STRIDE)]
            found[extractor.frechet] = np.concatenate(rows)
        else:
            found[extractor.frechet] = extractor.features(torch.from_numpy(frames))
    return found


def with_steps(quality: Quality, steps: int, static_steps: int | None = None) -> Quality:
    """The same with other numbers of steps."""
    static = quality.static if static_steps is None else replace(quality.static, steps=static_steps)
    return replace(quality, fit=replace(quality.fit, steps=steps), static=static)


def told_apart(fitted: Fitted, case: Case) -> dict[str, Any]:
    """How well static and moving are told apart, and how much the static street moves."""
    found = evaluate_decomposition(fitted.scene, Truth.of(world_of(case.seed)))
    return {
        "mask_iou": found.mask.iou,
        "label_iou": found.labels.iou,
        "fake_m": None if found.fake is None else found.fake.mean_m,
        "path_rms_m": found.path_rms_m,
        "scale": found.scale,
    }


def keep_picture(path: Path, image: UInt8[np.ndarray, "h w 3"]) -> None:
    """For the grid."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(cv2.imencode(".png", image[..., ::-1])[1].tobytes())


def save(path: Path, record: dict[str, Any], features: Features) -> None:
    """The record as JSON and the features beside it; the JSON last, as it says that all is there."""
    with new_file(path.with_suffix(".npz")) as partial:
        np.savez_compressed(partial, **features)
    with new_file(path) as partial:
        partial.write_text(json.dumps(record, indent=1) + "\n")


def load(path: Path) -> dict[str, Any] | None:
    """The record, if the fit is finished."""
    return json.loads(path.read_text()) if path.exists() else None


def load_features(path: Path) -> Features:
    """The features of a finished fit."""
    with np.load(path.with_suffix(".npz")) as kept:
        return {name: kept[name] for name in kept.files}
