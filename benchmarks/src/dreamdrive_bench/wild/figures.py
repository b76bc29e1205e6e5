"""What is measured of the scene of one place."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import UInt8

from dreamdrive.evaluate import evaluate_consistency
from dreamdrive.run import codec
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import render_scene
from dreamdrive.stored import load_scene
from dreamdrive.vision.pixels import psnr

Picture = UInt8[np.ndarray, "h w 3"]

ASIDE_M = 1.0
_HALF = 0.5
_SHOWN = (0.0, 0.5, 1.0)
"""Shares of the drive that the grid shows."""


def figures_of(out: Path) -> tuple[dict[str, Any], list[Picture]]:
    """Figures of a finished run, and pictures: the drive, and its middle from aside."""
    scene, clip = load_scene(out / "scene"), codec.read(out / "stages/prior", Clip)
    report = json.loads((out / "report.json").read_text())
    lead = scene.front.tolist()
    shown = {frame: _view(scene, scene.cameras[frame], float(scene.times_s[frame])) for frame in lead}
    likeness = [psnr(_floats(clip.frames[frame]), _floats(shown[frame][0])) for frame in lead]
    consistency = evaluate_consistency(
        np.stack([shown[frame][0] for frame in lead]),
        scene.times_s[lead],
        scene.cameras[0],
        scene.trajectory if clip.known.generated else None,
    )
    aside = [_aside(scene, lead[0], side * ASIDE_M) for side in (-1, 1)]
    motion = report["set_in_motion"]
    row = {
        "seconds": sum(stage["seconds"] for stage in report["stages"].values()),
        "prior": report["prior"],
        "frames": report["frames"]["count"],
        "gaussians": report["gaussians"],
        "actors": len(report["actors"]),
        "psnr": float(np.mean(likeness)),
        "uncovered_aside": float(np.mean([share for _, share in aside])),
        "moving_iou": None if motion is None else motion["iou"],
        "path_error": None if consistency.path is None else asdict(consistency.path),
        "inside_lines": [asdict(gap) for gap in consistency.gaps],
        "notes": report["notes"],
        "rough": report["rough"],
    }
    at = [lead[round(share * (len(lead) - 1))] for share in _SHOWN]
    return row, [*(shown[frame][0] for frame in at), aside[1][0]]


def _floats(picture: Picture) -> torch.Tensor:
    return torch.from_numpy(picture).float() / 255


def _view(scene: Scene, camera: Camera, t_s: float) -> tuple[Picture, float]:
    """The picture, and the share of it below the horizon's sky that no Gaussian covers by half."""
    view = render_scene(scene, camera, t_s)
    rays = camera.rays() @ camera.world_from_camera[:3, :3].T
    below = rays @ scene.up < 0
    return view.picture, float((below & (view.alpha.numpy() < _HALF)).mean())


def _aside(scene: Scene, frame: int, right_m: float) -> tuple[Picture, float]:
    return _view(scene, scene.cameras[frame].moved(right_m), float(scene.times_s[frame]))
