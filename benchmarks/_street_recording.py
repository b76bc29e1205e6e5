"""The same five fits on a recorded clip: withheld frames, and labelled boxes as the truth of what moves."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from _street_case import HOLD_OUT, Start, prepare
from _street_fit import fit_case, forget_fit, kept_fit, options_of
from _street_keep import save
from clips import DATA
from pandaset_truth import Movers, moving_masks

from dreamdrive.evaluate.retrieval import retrieval
from dreamdrive.held_out import score_scene
from dreamdrive.options import Quality
from dreamdrive.prior import choose_prior
from dreamdrive.scene.control import Control
from dreamdrive.scene.scene import Scene
from dreamdrive.splat.scene_view import render_scene
from dreamdrive.stages import digest

CLIP, CAMERA = "pandaset_002", "front_camera"
SIZE, FRAMES, RATE_HZ, CAMERA_HEIGHT_M = (320, 180), "20:68:2", 10.0, 2.2
ABOUT: list[object] = [CLIP, CAMERA, FRAMES, RATE_HZ, SIZE, HOLD_OUT]


@dataclass(frozen=True)
class Recorded:
    """One fit of the recording, and the folder of all fits."""

    representation: str
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

    @property
    def scene(self) -> Path:
        """Where its scene is kept."""
        return self.runs / "scenes" / self.name

    def key(self, quality: Quality) -> str:
        """Of everything its figures follow from."""
        return digest([ABOUT, CAMERA_HEIGHT_M, self.representation, options_of(quality, self.representation)])

    def forget(self) -> None:
        """Remove all that is kept of it."""
        self.result.unlink(missing_ok=True)
        forget_fit(self.scene)


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
    case = job.runs / "cases" / CLIP
    begin = prepare(lambda: choose_prior("replay")(control), ABOUT, quality, case, CAMERA_HEIGHT_M)
    key = job.key(quality)
    fitted = kept_fit(job.scene, key, lambda: fit_case(begin, job.representation, quality))
    scene = fitted.scene
    truth = moving_masks(folder, begin.clip.source_index.tolist(), SIZE)
    record = {
        "representation": job.representation,
        "size": SIZE,
        "frames": len(begin.clip),
        "static_steps": quality.static.steps,
        **asdict(fitted.cost),
        "gaussians": {"static": len(scene.static), "dynamic": len(scene.dynamic)},
        **measure_recorded(scene, begin, truth),
    }
    save(job.result, key, record)


def measure_recorded(scene: Scene, begin: Start, truth: Movers) -> dict[str, Any]:
    """Likeness of withheld frames, overall and inside the hulls of moving boxes, and IoU over all frames.

    A pixel counts as moving as it does in the drawn worlds, see ``evaluate.decomposition``.
    """
    found = list(score_scene(begin.clip, begin.geometry, scene).values())
    shares: list[np.ndarray] = []
    squared = count = 0
    for k, (camera, t_s) in enumerate(zip(scene.cameras, scene.times_s.tolist(), strict=True)):
        view = render_scene(scene, camera, t_s)
        shares.append(view.dynamic_share.numpy())
        if scene.held_out[k]:
            shown = np.rint(view.colour.numpy() * 255) / 255
            difference = (shown - begin.clip.frames[k] / 255)[truth.counted[k]]
            squared, count = squared + float(np.square(difference).sum()), count + difference.size
    judged = ~truth.ignored
    return {
        "psnr": float(np.mean([likeness.psnr for likeness in found])),
        "ssim": float(np.mean([likeness.ssim for likeness in found])),
        "moving_iou": retrieval(truth.counted[judged], np.stack(shares)[judged]).iou,
        "ignored_share": float(truth.ignored.mean()),
        "moving_psnr": float(-10 * np.log10(squared / count)) if count else None,
    }
