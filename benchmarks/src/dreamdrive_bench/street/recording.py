"""The same five fits on a recorded clip: held-out frames, and labelled boxes as the truth of what moves."""

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from dreamdrive.options import Options
from dreamdrive.prior import choose_prior
from dreamdrive.run import codec, score_scene
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import render_scene
from dreamdrive_bench.common.keep import save
from dreamdrive_bench.common.places import DATA
from dreamdrive_bench.recorded.pandaset import Movers, moving_masks
from dreamdrive_bench.street.case import HOLD_OUT
from dreamdrive_bench.street.fit import FitTask, Start, fit_case, kept_fit, key_of
from dreamdrive_bench.street.methods import options_of

CLIP, CAMERA = "pandaset_002", "front_camera"
SIZE, FRAMES, RATE_HZ, CAMERA_HEIGHT_M = (320, 180), "20:68:2", 10.0, 2.2
ABOUT: list[object] = [CLIP, CAMERA, FRAMES, RATE_HZ, SIZE, HOLD_OUT]


@dataclass(frozen=True)
class Recorded(FitTask):
    """One fit of the recording, and the folder of all fits."""

    method: str
    runs: Path

    @property
    def name(self) -> str:
        """For files and messages."""
        return f"{CLIP}-{self.method}"

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
    def options(self) -> Options:
        """Of the fit; the height of the camera gives the scale."""
        options = options_of(self.method)
        return replace(options, geometry=replace(options.geometry, camera_height_m=CAMERA_HEIGHT_M))

    @property
    def key(self) -> str:
        """Of everything its figures follow from."""
        return key_of(ABOUT, self.options)


def recording() -> Path | None:
    """The folder of the clip, where it is there."""
    folder = DATA / "clips" / CLIP
    return folder if folder.exists() else None


def run_recorded(job: Recorded) -> None:
    """Fit, measure and keep."""
    folder = recording()
    if folder is None:
        raise FileNotFoundError(f"{DATA}/clips/{CLIP} is not there; set DREAMDRIVE_DATA")
    control = Control(folder / CAMERA, frames=FRAMES, fps=RATE_HZ, size=SIZE, hold_out=HOLD_OUT)
    begin = Start(job.runs / "cases" / CLIP, ABOUT, lambda: choose_prior("replay")(control))
    fitted = kept_fit(job.scene, job.key, lambda: fit_case(begin, job.options))
    scene, kept = fitted.scene, begin.stages(job.options).folder
    clip, geometry = codec.read(kept / "prior", Clip), codec.read(kept / "geometry", Geometry)
    truth = moving_masks(folder, clip.source_index.tolist(), SIZE)
    record = {
        "representation": job.method,
        "size": SIZE,
        "frames": len(clip),
        "static_steps": job.options.static.steps,
        **asdict(fitted.cost),
        "gaussians": {"static": len(scene.static), "dynamic": len(scene.dynamic)},
        **measure_recorded(scene, clip, geometry, truth),
    }
    save(job.result, job.key, record)


def measure_recorded(scene: Scene, clip: Clip, geometry: Geometry, truth: Movers) -> dict[str, Any]:
    """Likeness of held-out frames, overall and inside the hulls of moving boxes, and IoU over all frames.

    A pixel counts as moving as it does in the drawn worlds, see ``evaluate.decomposition``.
    """
    found = list(score_scene(clip, geometry, scene).values())
    shares: list[np.ndarray] = []
    errors: dict[int, np.ndarray] = {}
    for k, (camera, t_s) in enumerate(zip(scene.cameras, scene.times_s.tolist(), strict=True)):
        view = render_scene(scene, camera, t_s)
        shares.append(view.dynamic_share.numpy())
        if scene.held_out[k]:
            shown = np.rint(view.colour.numpy() * 255) / 255
            errors[k] = shown - clip.frames[k] / 255
    return {
        "psnr": float(np.mean([likeness.psnr for likeness in found])),
        "ssim": float(np.mean([likeness.ssim for likeness in found])),
        "ignored_share": float(truth.ignored.mean()),
        **truth.figures(shares, errors),
    }
