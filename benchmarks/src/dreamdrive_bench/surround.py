"""Held-out frames of one scene from several cameras, and cameras that no fit has seen at all.

A drive of a data set becomes a scene by its first camera alone, by all cameras, and by all but each of those
that are to be left out. Of the first two every 4th frame of each camera is withheld and compared, beside the
best guess of ``generate`` that needs no scene. A camera that is left out is seen from its own recorded
places: what no other camera saw is empty there. Its likeness is that of the pixels of which Gaussians cover
more than half, whose share stands beside it, and that of all pixels. It is a figure, and no goal: cameras of
a car hardly overlap, and the exposure of one that was never seen is not known.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from dreamdrive.data.input import log_of, read_dataset
from dreamdrive.generate import generate
from dreamdrive.run import likeness
from dreamdrive.scene.control import Control
from dreamdrive.splat import render_scene
from dreamdrive.stored import load_scene
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.markdown import table
from dreamdrive_bench.common.options import parser_of, size_of
from dreamdrive_bench.common.places import DATA
from dreamdrive_bench.common.report import publish

_HELD_OUT = 4


def main() -> int:
    """Make the scenes, compare, print the tables."""
    parser = parser_of(__doc__, runs="runs/surround", markdown=True)
    parser.add_argument("--set", type=Path, default=DATA / "nuscenes_format/pandaset_002", metavar="FOLDER")
    parser.add_argument("--scene", default="0")
    parser.add_argument("--size", default="480x270", metavar="WxH")
    parser.add_argument("--quality", default="standard")
    parser.add_argument("--leave-out", nargs="*", metavar="NAME", help="default: all but the first")
    args = parser.parse_args()
    asked = Control(path=args.set, scene=args.scene, size=size_of(args.size), hold_out=_HELD_OUT)
    log = log_of(asked)
    assert log is not None
    names = [camera.name for camera in log.cameras]
    wanted = names[1:] if args.leave_out is None else args.leave_out
    made = {"first camera alone": names[:1], "all cameras": names}
    rows = [row for what, of in made.items() for row in _held_out(what, of, asked, args)]
    unseen = [_left_out(name, [each for each in names if each != name], asked, args) for name in wanted]
    report = {"machine": describe_machine(), "drive": log.name, "quality": args.quality, "size": args.size}
    return publish(args, report | {"held_out": rows, "left_out": unseen}, _tables(rows, unseen), ())


def _run(cameras: list[str], asked: Control, args: Any) -> Path:
    """The folder of the scene of some cameras, made once."""
    out = args.runs / "-".join([args.quality, args.size, *(name.removeprefix("CAM_") for name in cameras)])
    control = replace(asked, cameras=",".join(cameras))
    generate(control, out, options=args.quality)
    print(out.name, flush=True)
    return out


def _held_out(what: str, cameras: list[str], asked: Control, args: Any) -> list[dict[str, Any]]:
    """PSNR and SSIM of withheld frames, camera by camera, beside the best guess without a scene."""
    report = json.loads((_run(cameras, asked, args) / "report.json").read_text())
    rows: list[dict[str, Any]] = []
    for index, name in enumerate(cameras):
        ending = f"_camera{index}" if index else ""
        mine = [key for key in report["held_out"] if _camera_of(key) == ending]
        scene = [report["held_out"][key] for key in mine]
        guesses = {
            guess: float(np.mean([each["frames"][key]["psnr"] for key in mine]))
            for guess, each in report["baselines"].items()
        }
        best = max(guesses, key=lambda guess: guesses[guess])
        mean = {of: float(np.mean([each[of] for each in scene])) for of in ("psnr", "ssim")}
        rows.append({"made of": what, "camera": name, "frames": len(mine), **mean, "best": best})
        rows[-1]["best_psnr"] = guesses[best]
    return rows


def _camera_of(key: str) -> str:
    return key[key.index("_") :] if "_" in key else ""


def _left_out(name: str, others: list[str], asked: Control, args: Any) -> dict[str, Any]:
    """How like its pictures the scene of the other cameras is, seen from where it was."""
    scene = load_scene(_run(others, asked, args) / "scene")
    clip = read_dataset(replace(asked, cameras=name, hold_out=None))
    of, mine = scene.provenance.log, clip.log
    assert of is not None
    assert mine is not None
    assert clip.known.world_from_camera is not None
    scene_from_clip = np.linalg.inv(np.array(of.log_from_world)) @ np.array(mine.log_from_world)
    times_s = clip.times_s + mine.start_s - of.start_s
    found: list[tuple[float, float, float]] = []
    for frame in np.flatnonzero((times_s >= 0) & (times_s <= scene.times_s.max())).tolist():
        camera = clip.rig[0].at(scene_from_clip @ clip.known.world_from_camera[frame])
        view = render_scene(scene, camera, float(times_s[frame]))
        colour, covered = view.colour.numpy(), view.alpha.numpy() > 0.5
        here = clip.valid[frame]
        seen, all_of_it = (
            likeness(colour, clip.frames[frame], mask).psnr if mask.any() else np.nan
            for mask in (here & covered, here)
        )
        found.append((seen, float(covered[here].mean()), all_of_it))
    psnr, share, whole = np.nanmean(found, axis=0).tolist()  # at times nothing is covered
    return {"camera": name, "frames": len(found), "psnr": psnr, "covered": share, "psnr_all": whole}


def _tables(rows: list[dict[str, Any]], unseen: list[dict[str, Any]]) -> str:
    head = ["made of", "camera", "frames", "PSNR", "SSIM", "best guess without a scene", "its PSNR"]
    lines = [
        [
            *(row["made of"], row["camera"], str(row["frames"])),
            *(f"{row['psnr']:.2f}", f"{row['ssim']:.3f}", row["best"], f"{row['best_psnr']:.2f}"),
        ]
        for row in rows
    ]
    beside = [
        [
            *(row["camera"], str(row["frames"])),
            *(f"{row['psnr']:.2f}", f"{row['covered']:.0%}", f"{row['psnr_all']:.2f}"),
        ]
        for row in unseen
    ]
    text = table(head, lines) + "\n"
    if beside:
        text += "\n" + table(["left out", "frames", "PSNR where covered", "covered", "PSNR"], beside) + "\n"
    return text
