"""How good a fitted scene is: its views against the truth, their features, what it takes for moving."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import Bool, UInt8

from dreamdrive.evaluate import Extractor, Toolbox, Truth, evaluate_decomposition
from dreamdrive.files.digest import digest
from dreamdrive.run import likeness
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.similarity import Similarity, fit_similarity
from dreamdrive.splat import render_scene
from dreamdrive_bench.common.keep import Features, is_current, load_features, save
from dreamdrive_bench.street.case import NOVEL, VIEWS, Case, world_of
from dreamdrive_bench.street.views import counted, novel_digest, true_cameras, true_frames

WINDOW, STRIDE = 16, 2


def to_scene(camera: Camera, similarity: Similarity) -> Camera:
    """A camera of the true world in that of a scene; what it sees is the same."""
    pose = np.eye(4)
    pose[:3, :3] = similarity.rotation.T @ camera.world_from_camera[:3, :3]
    away = camera.world_from_camera[:3, 3] - similarity.translation
    pose[:3, 3] = similarity.rotation.T @ away / similarity.scale
    return camera.at(pose)


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
    scene: Scene, case: Case, extractors: list[Extractor], folder: Path
) -> tuple[dict[str, Any], Features, UInt8[np.ndarray, "h w 3"]]:
    """Figures of each view against the clean truth, the features of the novel ones, and a picture."""
    views: dict[str, Any] = {}
    features: Features = {}
    middle = np.zeros((1, 1, 3), dtype=np.uint8)
    for view in VIEWS:
        truth, shown = true_frames(case.seed, view, folder), frames_of(scene, case.seed, view)
        counts = scene.held_out if view == "held_out" else counted(case.seed, view)
        views[view] = likeness_of(shown, truth, counts)
        if view != "held_out":
            found = features_of(shown, counts, extractors)
            features |= {f"{name}/{view}": rows for name, rows in found.items()}
        if view == "shift_2":
            middle = shown[len(shown) // 2]
    return views, features, middle


def likeness_of(
    shown: UInt8[np.ndarray, "f h w 3"], truth: UInt8[np.ndarray, "f h w 3"], counts: Bool[np.ndarray, " f"]
) -> dict[str, Any]:
    """Means over the frames that count, and their number; without any there is no mean."""
    whole = np.ones(truth.shape[1:3], dtype=bool)
    chosen = np.flatnonzero(counts).tolist()
    found = [likeness(shown[k].astype(np.float32) / 255, truth[k], whole) for k in chosen]
    if not found:
        return {"psnr": None, "ssim": None, "frames": 0}
    psnr, ssim = (float(np.mean([getattr(f, name) for f in found])) for name in ("psnr", "ssim"))
    return {"psnr": psnr, "ssim": ssim, "frames": len(found)}


def features_of(
    frames: UInt8[np.ndarray, "f h w 3"], counts: Bool[np.ndarray, " f"], extractors: list[Extractor]
) -> Features:
    """By the name of the Fréchet distance: a row a frame that counts, or a row a window of such frames.

    A network without any has no entry.
    """
    found: Features = {}
    starts = range(0, len(frames) - WINDOW + 1, STRIDE)
    parts = [frames[at : at + WINDOW] for at in starts if counts[at : at + WINDOW].all()]
    for extractor in extractors:
        if extractor.window:
            rows = [extractor.features(torch.from_numpy(part)) for part in parts]
            found |= {extractor.frechet: np.concatenate(rows)} if rows else {}
        elif counts.any():
            found[extractor.frechet] = extractor.features(torch.from_numpy(frames[counts]))
    return found


def truth_features(seed: int, runs: Path, toolbox: Toolbox) -> Features:
    """Features of the true novel views of a world, kept."""
    path, key = runs / "truth" / f"features-{seed}.json", digest([novel_digest(seed), networks_key(toolbox)])
    if is_current(path, key):
        return load_features(path)
    found: Features = {}
    for view in NOVEL:
        frames = true_frames(seed, view, runs / "truth")
        rows = features_of(frames, counted(seed, view), toolbox.extractors)
        found |= {f"{name}/{view}": values for name, values in rows.items()}
    save(path, key, {}, found)
    return found


def networks_key(toolbox: Toolbox) -> list[object]:
    """What features depend on."""
    names = sorted(extractor.frechet for extractor in toolbox.extractors)
    return [[name, toolbox.weights[name]["sha256"]] for name in names] + [WINDOW, STRIDE]


def told_apart(scene: Scene, seed: int) -> dict[str, Any]:
    """How well static and moving are told apart, how much the static street moves, and the actors' boxes."""
    found = evaluate_decomposition(scene, Truth.of(world_of(seed)))
    boxes = found.boxes
    return {
        "mask_iou": found.mask.iou,
        "mask_precision": found.mask.precision,
        "label_iou": found.labels.iou,
        "fake_m": None if found.fake is None else found.fake.mean_m,
        "boxes": None if boxes is None else asdict(boxes),
        "path_rms_m": found.path_rms_m,
        "scale": found.scale,
    }
