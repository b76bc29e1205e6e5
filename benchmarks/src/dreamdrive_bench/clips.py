"""Real clips through ``dreamdrive generate``: held-out quality, what moves, camera path, seconds, memory.

Each run is a folder below ``--runs``; with ``--resume`` those that are finished count, whatever code made
them, so that an interrupted benchmark goes on. A run that fails is named at the end. Rows of KITTI 04 tell
which of its oncoming cars approach, see ``recorded.kitti04_oncoming``. The clips are found through
``DREAMDRIVE_DATA`` (default ``../shared/data``). Truth is used to measure only.
"""

import json
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from dreamdrive.metrics.paths import compare_paths
from dreamdrive.splat import render_scene
from dreamdrive.stored import load_scene
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.places import DATA, DREAMDRIVE
from dreamdrive_bench.common.report import as_json, exit_code, write
from dreamdrive_bench.common.twin import TWIN
from dreamdrive_bench.recorded import kitti04_oncoming
from dreamdrive_bench.recorded.kitti import camera_path as kitti_path
from dreamdrive_bench.recorded.pandaset import camera_path, moving_masks

HELD_OUT = ["--hold-out", "8"]


@dataclass(frozen=True)
class Run:
    """One command: a clip below ``clips/`` and the options of ``generate``."""

    clip: str
    source: str
    options: list[str] = field(default_factory=list)
    truth: str | None = None


# The other clips show what the geometry and the split make of them; a draft is enough for that.
DRAFT = ["--quality", "draft"]
SHORT = [*HELD_OUT, *DRAFT]
PANDASET = ["--fps", "10", "--size", "480x270", "--camera-height", "2.2"]
CAMERAS = ["--geometry-files", str(DATA / "clips/pandaset_002/cameras.json")]
KITTI = ["--fps", "10", "--frames", "0:48:2", "--size", "480x144", "--camera-height", "1.65", *SHORT]
UDACITY = ["--frames", "0:48:2", "--size", "480x270", *SHORT]


def drive(*options: str) -> Run:
    """The moving part of the PandaSet clip."""
    usual = [*PANDASET, "--frames", "20:68:2", *HELD_OUT]
    return Run("pandaset_002", "front_camera", [*usual, *options], "pandaset")


def with_lens(clip: str) -> list[str]:
    """The option that hands the clip's calibration over."""
    return ["--intrinsics", str(DATA / "clips" / clip / "meta.json")]


RUNS = {
    "pandaset": drive(),
    "pandaset-draft": drive(*DRAFT),
    "pandaset-files-draft": drive(*DRAFT, *CAMERAS),
    "pandaset-files-refined-draft": drive(*DRAFT, "--refine-poses", *CAMERAS),
    "pandaset-static": drive("--representation", "static"),
    "pandaset-deformable": drive("--representation", "deformable"),
    "pandaset-standing": Run("pandaset_002", "front_camera", [*PANDASET, "--frames", "0:20:1", *SHORT]),
    "udacity": Run("udacity_highway_two_cars", "video.mp4", UDACITY),
    "udacity-lens": Run(
        "udacity_highway_two_cars", "video.mp4", [*UDACITY, *with_lens("udacity_highway_two_cars")]
    ),
}
for _name in ("kitti_odom04_follow_van", "kitti_odom06_avenue", "kitti_odom07_left_turn"):
    _short = "kitti" + _name[len("kitti_odom") : len("kitti_odom04")]
    RUNS[_short] = Run(_name, "frames", KITTI, "kitti")
    RUNS[_short + "-intrinsics"] = Run(_name, "frames", [*KITTI, *with_lens(_name)], "kitti")


def main() -> int:
    """Run, measure, print each row and write all as JSON; 1 if a run failed."""
    parser = parser_of(__doc__, runs="runs/clips", resume=True)
    parser.add_argument("names", nargs="*", help=f"which of {', '.join(RUNS)}; all unless given")
    args = parser.parse_args()
    unknown = set(args.names) - set(RUNS)
    if unknown:
        parser.error(f"unknown: {', '.join(sorted(unknown))}; known: {', '.join(RUNS)}")
    rows, failed = [], []
    for name in args.names or RUNS:
        if not args.resume and (args.runs / name).exists():
            shutil.rmtree(args.runs / name)
        try:
            rows.append(measure(name, RUNS[name], args.runs / name))
        except (subprocess.CalledProcessError, OSError, ValueError) as error:
            failed.append(name)
            print(f"{name}: {error}", file=sys.stderr, flush=True)
            continue
        print(json.dumps(rows[-1]), flush=True)
        write(args.json, as_json({"rows": rows}))
    return exit_code(failed)


def measure(name: str, run: Run, out: Path) -> dict:
    """Generate a scene, unless it is there already, and compare it with what is known of the clip."""
    source = DATA / "clips" / run.clip / run.source
    command = [*DREAMDRIVE, "generate", str(source), *run.options, "--knowledge", TWIN, "-o", str(out)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    report = json.loads((out / "report.json").read_text())
    row = {
        "name": name,
        "seconds": round(sum(s["seconds"] for s in report["stages"].values()), 1),
        "stages": {stage: round(s["seconds"], 1) for stage, s in report["stages"].items()},
        "peak_rss_mb": max(s["peak_rss_mb"] for s in report["stages"].values()),
        "gaussians": report["gaussians"],
        "actors": len(report["actors"]),
        "held_out": report["held_out_mean"],
        "baselines": {key: value["mean"] for key, value in report["baselines"].items()},
        "focal": report["focal"],
        "scale": report["scale"],
        "fallback": report["fallback"],
        "detected": report["detected"],
    }
    scene = load_scene(out / "scene")
    if run.truth == "pandaset":
        row |= compare_with_boxes(scene, DATA / "clips" / run.clip, report, out)
    elif run.truth == "kitti":
        row |= path_figures(scene, kitti_path(DATA / "clips" / run.clip, report["frames"]["source_index"]))
    if run.clip == kitti04_oncoming.CLIP:
        row |= kitti04_oncoming.figures(scene, report["frames"]["source_index"])
    return row


def path_figures(scene, truth: np.ndarray) -> dict:
    """Position RMSE over the length of the true path, after similarity alignment."""
    estimated = np.stack([camera.world_from_camera for camera in scene.cameras])
    error = compare_paths(estimated, truth)
    length_m = float(np.linalg.norm(np.diff(truth[:, :3, 3], axis=0), axis=1).sum())
    return {"path_rmse_m": error.ate_m, "path_m": length_m, "path_error": error.ate_percent / 100}


def compare_with_boxes(scene, clip_dir: Path, report: dict, out: Path) -> dict:
    """IoU of the dynamic pixels over all frames, and PSNR inside the true masks on held-out frames."""
    frames = report["frames"]["source_index"]
    size = tuple(report["frames"]["size"])
    truth = moving_masks(clip_dir, frames, size)
    shares, errors = [], {}
    for i, (camera, t_s) in enumerate(zip(scene.cameras, scene.times_s.tolist(), strict=True)):
        view = render_scene(scene, camera, t_s)
        shares.append(view.dynamic_share.numpy())
        if scene.held_out[i]:
            name = clip_dir / "front_camera" / f"{frames[i]:02d}.jpg"
            frame = cv2.resize(cv2.imread(str(name)), size, interpolation=cv2.INTER_AREA)[..., ::-1]
            rendered = cv2.imread(str(out / "held_out" / f"{frames[i]:04d}.png"))[..., ::-1]
            errors[i] = (rendered.astype(float) - frame) / 255
    paths = path_figures(scene, camera_path(clip_dir, frames))
    return {**truth.figures(shares, errors), **paths}
