"""Real clips through ``dreamdrive generate``: held-out quality, moving masks, camera path, seconds, memory.

    python benchmarks/clips.py [NAME ...] [--resume] [--runs runs/clips] [--json FILE]

Each run is a folder below ``--runs``; with ``--resume`` those that are finished count, whatever code made
them, so that an interrupted benchmark goes on. A run that fails is named at the end. The clips are found
through ``DREAMDRIVE_DATA`` (default ``../shared/data``). Truth is used to measure only.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from _report_file import write
from pandaset_truth import camera_path, moving_masks

from dreamdrive.evaluate.paths import compare_paths
from dreamdrive.evaluate.retrieval import retrieval
from dreamdrive.scene.folder import load_scene
from dreamdrive.splat.scene_view import render_scene

ROOT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("DREAMDRIVE_DATA", ROOT / "../shared/data")).resolve()
HELD_OUT = ["--hold-out", "8"]


@dataclass(frozen=True)
class Run:
    """One command: a clip below ``clips/`` and the options of ``generate``."""

    clip: str
    source: str
    options: list[str] = field(default_factory=list)
    truth: str | None = None


PANDASET = ["--fps", "10", "--size", "480x270", "--camera-height", "2.2"]
# The other clips show what the geometry and the split make of them; a draft is enough for that.
SHORT = [*HELD_OUT, "--quality", "draft"]
KITTI = ["--fps", "10", "--frames", "0:48:2", "--size", "480x144", "--camera-height", "1.65", *SHORT]
DRIVE = [*PANDASET, "--frames", "20:68:2", *HELD_OUT]
UDACITY = ["--frames", "0:48:2", "--size", "480x270", *SHORT]


def with_lens(clip: str) -> list[str]:
    """The option that hands the clip's calibration over."""
    return ["--intrinsics", str(DATA / "clips" / clip / "meta.json")]


RUNS = {
    "pandaset": Run("pandaset_002", "front_camera", DRIVE, "pandaset"),
    "pandaset-draft": Run("pandaset_002", "front_camera", [*DRIVE, "--quality", "draft"], "pandaset"),
    "pandaset-files-draft": Run(
        "pandaset_002",
        "front_camera",
        [*DRIVE, "--quality", "draft", "--geometry-files", str(DATA / "clips/pandaset_002/cameras.json")],
        "pandaset",
    ),
    "pandaset-files-refined-draft": Run(
        "pandaset_002",
        "front_camera",
        [
            *DRIVE,
            "--quality",
            "draft",
            "--refine-poses",
            "--geometry-files",
            str(DATA / "clips/pandaset_002/cameras.json"),
        ],
        "pandaset",
    ),
    "pandaset-static": Run(
        "pandaset_002", "front_camera", [*DRIVE, "--representation", "static"], "pandaset"
    ),
    "pandaset-deformable": Run(
        "pandaset_002", "front_camera", [*DRIVE, "--representation", "deformable"], "pandaset"
    ),
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
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", help=f"which of {', '.join(RUNS)}; all unless given")
    parser.add_argument("--resume", action="store_true", help="keep runs that are finished")
    parser.add_argument("--runs", type=Path, default=ROOT / "runs" / "clips")
    parser.add_argument("--json", type=Path)
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
        write(args.json, json.dumps({"rows": rows}, indent=1) + "\n")
    for name in failed:
        print(f"failed: {name}", file=sys.stderr)
    return 1 if failed else 0


def measure(name: str, run: Run, out: Path) -> dict:
    """Generate a scene, unless it is there already, and compare it with what is known of the clip."""
    program = [str(Path(sys.executable).parent / "dreamdrive"), "generate"]
    command = [*program, str(DATA / "clips" / run.clip / run.source), *run.options, "-o", str(out)]
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
        rows = np.loadtxt(DATA / "clips" / run.clip / "poses.txt").reshape(-1, 3, 4)
        poses = np.concatenate([rows, np.broadcast_to([0.0, 0, 0, 1], (len(rows), 1, 4))], axis=1)
        row |= path_figures(scene, poses[report["frames"]["source_index"]])
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
    shares, squared, count = [], 0, 0
    for i, (camera, t_s) in enumerate(zip(scene.cameras, scene.times_s.tolist(), strict=True)):
        view = render_scene(scene, camera, t_s)
        shares.append(view.dynamic_share.numpy())
        if scene.held_out[i]:
            name = clip_dir / "front_camera" / f"{frames[i]:02d}.jpg"
            frame = cv2.resize(cv2.imread(str(name)), size, interpolation=cv2.INTER_AREA)[..., ::-1]
            rendered = cv2.imread(str(out / "held_out" / f"{frames[i]:04d}.png"))[..., ::-1]
            difference = (rendered.astype(float) - frame)[truth.counted[i]] / 255
            squared += (difference**2).sum()
            count += difference.size
    paths = path_figures(scene, camera_path(clip_dir, frames))
    judged = ~truth.ignored
    iou = retrieval(truth.counted[judged], np.stack(shares)[judged]).iou
    hull_psnr = float(-10 * np.log10(squared / count))
    return {"moving_iou": iou, "moving_psnr": hull_psnr, **paths}


if __name__ == "__main__":
    sys.exit(main())
