"""A scene of one drive, and what it is worth."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch
from jaxtyping import Float, UInt8

from dreamdrive.build import build_scene
from dreamdrive.metrics.retrieval import retrieval
from dreamdrive.options import QUALITIES, Options
from dreamdrive.run import Likeness, score_baselines, score_scene
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene
from dreamdrive.show import write_png
from dreamdrive.splat import render_scene
from dreamdrive_bench.common.recorder import Recorder
from dreamdrive_bench.drives.drive import Drive
from dreamdrive_bench.drives.truth import lidar_figures, movers_of, path_figures

ASIDE_M = 2.0
STARTS = 3
"""Held-out frames, and those beside them, on a sheet."""


def options_of(drive: Drive, knowledge: str, quality: str) -> Options:
    """Those of a quality with what the list says of the drive."""
    whole = QUALITIES[quality]  # type: ignore[index]
    geometry = replace(whole.geometry, camera_height_m=drive.camera_height_m)
    return replace(whole, geometry=geometry, knowledge=knowledge)


def measure(drive: Drive, knowledge: str, quality: str, sheet: Path) -> dict[str, Any]:
    """Make the scene; its figures, and a picture of it at ``sheet``."""
    clip, run = drive.clip(), Recorder()
    built = build_scene(clip, options_of(drive, knowledge, quality), run=run)
    scene, geometry = built.scene, built.geometry
    shares = np.stack(
        [
            render_scene(scene, camera, float(t_s)).dynamic_share.numpy()
            for camera, t_s in zip(geometry.cameras, clip.times_s, strict=True)
        ]
    )
    movers = movers_of(drive, clip)
    judged = None if movers is None else ~movers.ignored
    write_png(sheet, sheet_of(clip, geometry, scene, shares))
    return {
        **_mean("", score_scene(clip, geometry, scene)),
        **{
            k: v for n, one in score_baselines(clip, geometry).items() for k, v in _mean(f"{n}_", one).items()
        },
        **path_figures(drive, clip, geometry),
        **lidar_figures(drive, clip, geometry),
        "iou": None if movers is None else retrieval(movers.counted[judged], shares[judged]).iou,
        "step_m": float(np.median(_steps_m(geometry))),
        "maps": geometry.fallback is None,
        "fallback": geometry.fallback,
        "drifts": scene.moves_per_frame,
        "focal_px": geometry.focal.px,
        "gaussians": len(scene.static) + len(scene.dynamic),
        "actors": len(scene.actors),
        "seconds": sum(run.seconds.values()),
        "stages": run.seconds,
        "details": {k: v for k, v in geometry.details.items() if isinstance(v, int | float | str)},
        "detected": list(geometry.detected),
    }


def _mean(prefix: str, scores: dict[int, Likeness]) -> dict[str, float]:
    return {
        f"{prefix}{name}": float(np.mean([getattr(one, name) for one in scores.values()]))
        for name in ("psnr", "ssim")
    }


def _steps_m(geometry: Geometry) -> Float[np.ndarray, " s"]:
    places = np.stack([camera.world_from_camera[:3, 3] for camera in geometry.cameras])
    return np.linalg.norm(np.diff(places, axis=0), axis=1)


def sheet_of(
    clip: Clip, geometry: Geometry, scene: Scene, shares: Float[np.ndarray, "f h w"]
) -> UInt8[np.ndarray, "h w 3"]:
    """Rows of frames: recorded, rendered, from 2 m to the right, what moves, depth.

    The frames are the held-out ones, and the frame before each, where depth was looked for.
    """
    held_out = np.flatnonzero(clip.held_out)[:STARTS].tolist()
    rows = []
    for frame in [i for held in held_out for i in (held - 1, held)]:
        camera, t_s = geometry.cameras[frame], float(clip.times_s[frame])
        moving = 255 * np.repeat(shares[frame][..., None] >= 0.5, 3, 2)
        mask = (0.5 * clip.frames[frame] + 0.5 * moving).astype(np.uint8)
        views = [_bytes(render_scene(scene, each, t_s).colour) for each in (camera, camera.moved(ASIDE_M))]
        rows.append(np.hstack([clip.frames[frame], *views, mask, _depth(geometry.depth_m[frame])]))
    return np.vstack(rows)


def _bytes(colour: torch.Tensor) -> UInt8[np.ndarray, "h w 3"]:
    return (colour.clamp(0, 1) * 255).round().to(torch.uint8).numpy()


def _depth(depth_m: Float[np.ndarray, "h w"]) -> UInt8[np.ndarray, "h w 3"]:
    """Near is red, far blue, on a scale of inverse depth; black where there is none."""
    shade = np.clip(255 * (2.0 / np.maximum(depth_m, 2.0)) ** 0.5, 0, 255).astype(np.uint8)
    coloured = np.asarray(cv2.applyColorMap(shade, cv2.COLORMAP_TURBO))[..., ::-1]
    return np.where(depth_m[..., None] > 0, coloured, 0).astype(np.uint8)
