"""The same five fits on a recorded clip: withheld frames, and labelled boxes as the truth of what moves."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from _street_case import HOLD_OUT, Start, prepare
from _street_fit import Fitted, fit_case, save
from _workers import threads
from clips import DATA
from jaxtyping import Bool
from pandaset_truth import moving_masks

from dreamdrive.fit import Representation
from dreamdrive.held_out import score_scene
from dreamdrive.options import Quality
from dreamdrive.prior import choose_prior
from dreamdrive.scene.control import Control
from dreamdrive.splat.scene_view import render_scene

CLIP, CAMERA = "pandaset_002", "front_camera"
SIZE, FRAMES, RATE_HZ, CAMERA_HEIGHT_M = (320, 180), "20:68:2", 10.0, 2.2


@dataclass(frozen=True)
class Recorded:
    """One fit of the recording, and the folder of all fits."""

    representation: Representation
    runs: Path

    @property
    def name(self) -> str:
        """For files and messages."""
        return f"{CLIP}-{self.representation}"

    @property
    def block(self) -> str:
        """Its table."""
        return CLIP

    @property
    def owner(self) -> str:
        """The recording, which one process prepares."""
        return CLIP

    @property
    def result(self) -> Path:
        """Where its figures are kept."""
        return self.runs / "recorded" / f"{self.name}.json"


def recording() -> Path | None:
    """The folder of the clip, where it is there."""
    folder = DATA / "clips" / CLIP
    return folder if folder.exists() else None


def run_recorded(job: Recorded, quality: Quality) -> None:
    """Fit, measure and keep."""
    folder = recording()
    if folder is None:
        raise FileNotFoundError(f"{DATA}/clips/{CLIP} is not there; set DREAMDRIVE_DATA")
    control = Control(folder / CAMERA, frames=FRAMES, fps=RATE_HZ, size=SIZE, hold_out=HOLD_OUT)
    about: list[object] = [CLIP, CAMERA, FRAMES, RATE_HZ, SIZE, HOLD_OUT]
    case = job.runs / "cases" / CLIP
    begin = prepare(lambda: choose_prior("replay")(control), about, quality, case, CAMERA_HEIGHT_M)
    fitted = fit_case(begin, job.representation, quality, lambda *_: None)
    truth = moving_masks(folder, begin.clip.source_index.tolist(), SIZE)
    record = {
        "representation": job.representation,
        "size": SIZE,
        "frames": len(begin.clip),
        "static_steps": quality.static.steps,
        "steps": fitted.steps,
        "seconds": fitted.seconds,
        "threads": threads(),
        "gaussians": {"static": len(fitted.scene.static), "dynamic": len(fitted.scene.dynamic)},
        **measure_recorded(fitted, begin, truth),
    }
    save(job.result, record, {})


def measure_recorded(fitted: Fitted, begin: Start, truth: Bool[np.ndarray, "f h w"]) -> dict[str, Any]:
    """Likeness of withheld frames, overall and inside the hulls of moving boxes, and IoU over all frames."""
    found = list(score_scene(begin.clip, begin.geometry, fitted.scene).values())
    both = either = squared = count = 0
    scene = fitted.scene
    for k, (camera, t_s) in enumerate(zip(scene.cameras, scene.times_s.tolist(), strict=True)):
        view = render_scene(scene, camera, t_s)
        mask = view.dynamic.numpy()
        both, either = both + int((mask & truth[k]).sum()), either + int((mask | truth[k]).sum())
        if scene.held_out[k]:
            shown = np.rint(view.colour.numpy() * 255) / 255
            difference = (shown - begin.clip.frames[k] / 255)[truth[k]]
            squared, count = squared + float(np.square(difference).sum()), count + difference.size
    return {
        "psnr": float(np.mean([likeness.psnr for likeness in found])),
        "ssim": float(np.mean([likeness.ssim for likeness in found])),
        "moving_iou": both / either if either else None,
        "moving_psnr": float(-10 * np.log10(squared / count)) if count else None,
    }
