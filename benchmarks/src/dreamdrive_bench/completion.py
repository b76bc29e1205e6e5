"""What completion is worth: scenes as they are fitted beside the same with what no frame saw put in space.

Drawn streets of edition 1, clean, true poses, ``draft``, the twin of the street network: PSNR of held-out
frames and of views 2 and 3 m aside, over all pixels and over those that stand, move and that no training
frame saw, perceptual distance (stlpips-vgg), seconds of completion. Of every recorded drive that is there a
sheet shows its first, middle and last view from 2 m to the left and right, in each state.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from jaxtyping import Int, UInt8

from dreamdrive.build import Built, build_scene
from dreamdrive.complete import CompletionOptions, completed
from dreamdrive.evaluate.networks import stlpips
from dreamdrive.options import Options
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene
from dreamdrive.show import grid as panels, write_png
from dreamdrive.splat import render_scene
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.markdown import grid, number
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import publish
from dreamdrive_bench.common.twin import TWIN
from dreamdrive_bench.common.worlds import TEST, set_of
from dreamdrive_bench.drives.drive import drives
from dreamdrive_bench.drives.measure import options_of
from dreamdrive_bench.oracle.views import Seen, seen
from dreamdrive_bench.street.case import Case, clip_of
from dreamdrive_bench.street.methods import QUALITY
from dreamdrive_bench.street.views import true_cameras

State = Callable[[Scene, Geometry], Scene]
Distance = Callable[[torch.Tensor, torch.Tensor], torch.Tensor]


def as_fitted(scene: Scene, _: Geometry) -> Scene:
    """Nothing is added."""
    return scene


def with_completion(scene: Scene, geometry: Geometry) -> Scene:
    """As a build completes it unless told."""
    return completed(scene, geometry, CompletionOptions())


STATES: dict[str, State] = {"bare": as_fitted, "completed": with_completion}
"""What is made of a fitted scene, by name; all are measured and shown in this order."""
VIEWS = ("held_out", "shift_2", "shift_3")
GROUPS = ("all", "standing", "moving", "unseen")
ASIDE_M = 2.0
_EVERY = 4  # frame aside; of held-out ones all are measured


def main() -> int:
    """Measure, draw sheets, print the table and write all as JSON."""
    parser = parser_of(__doc__, runs="runs/completion", markdown=True)
    parser.add_argument("--seeds", type=int, nargs="*", default=list(TEST[:8]))
    parser.add_argument("--drives", nargs="*", default=None, metavar="NAME", help="without it all there are")
    args = parser.parse_args()
    there = {name: drive for name, drive in drives().items() if drive.folder.exists()}
    shown: list[dict[str, Any]] = []
    for name in there if args.drives is None else args.drives:
        built = fitted(there[name].clip(), options_of(there[name], TWIN, "draft"))
        scenes, made = states_of(built)
        write_png(args.runs / f"{name}.png", sheet_of(scenes))
        shown.append({"name": name, "drifts": built.scene.moves_per_frame, "states": made})
        print(name, made, flush=True)
    distance = stlpips.load_stlpips("vgg") if args.seeds else None
    rows = [measured(seed, distance) for seed in args.seeds if distance is not None]
    worlds = {"set": set_of(args.seeds), "rows": rows}
    report = {"machine": describe_machine(), "worlds": worlds, "drives": shown}
    return publish(args, report, table(rows), ())


def fitted(clip: Clip, options: Options) -> Built:
    """A scene to which nothing was added."""
    return build_scene(clip, replace(options, completion=CompletionOptions(aside_m=0.0)))


def states_of(built: Built) -> tuple[dict[str, Scene], dict[str, dict[str, float]]]:
    """The scene in each state; and of each how many Gaussians that added, and in what seconds of one core."""
    scenes, made = dict[str, Scene](), dict[str, dict[str, float]]()
    for name, state in STATES.items():
        began_s = time.process_time()
        scenes[name] = state(built.scene, built.geometry)
        took_s = time.process_time() - began_s
        made[name] = {"seconds": took_s, "added": len(scenes[name].static) - len(built.scene.static)}
    return scenes, made


def measured(seed: int, distance: Distance) -> dict[str, Any]:
    """The figures of one street, by state and view."""
    clip = clip_of(Case(seed, "true", "clean"))
    scenes, made = states_of(fitted(clip, QUALITY))
    found: dict[str, dict[str, Any]] = {name: dict(made[name]) for name in scenes}
    for view in VIEWS:
        truth, cameras = seen(seed, view, clip), true_cameras(seed, view)
        frames = np.flatnonzero(truth.counts)[:: 1 if view == "held_out" else _EVERY]
        for name, scene in scenes.items():
            found[name][view] = figures(pictures(scene, cameras, frames), truth, frames, distance)
    print(seed, {name: found[name]["shift_2"] for name in found}, flush=True)
    return {"seed": seed, "states": found}


def pictures(
    scene: Scene, cameras: Sequence[Camera], frames: Int[np.ndarray, " k"]
) -> UInt8[np.ndarray, "k h w 3"]:
    """What a scene shows these cameras at the times of some of its frames."""
    shown = [render_scene(scene, cameras[k], float(scene.times_s[k])).picture for k in frames.tolist()]
    return np.stack(shown)


def figures(
    shown: UInt8[np.ndarray, "k h w 3"], truth: Seen, frames: Int[np.ndarray, " k"], distance: Distance
) -> dict[str, float | None]:
    """PSNR of the mean square over each group of pixels, None where it is empty; and the mean distance."""
    true = truth.frames[frames]
    wrong = np.square((shown.astype(np.float32) - true) / 255).mean(axis=-1)
    groups = {name: wrong[truth.groups[name][frames]] for name in GROUPS}
    planes = [torch.from_numpy(each).permute(0, 3, 1, 2).float() / 127.5 - 1 for each in (shown, true)]
    with torch.inference_mode():
        apart = [float(distance(a[None], b[None]).mean()) for a, b in zip(*planes, strict=True)]
    psnr = {name: float(-10 * np.log10(part.mean())) if part.size else None for name, part in groups.items()}
    return {**psnr, "stlpips": float(np.mean(apart))}


def sheet_of(scenes: dict[str, Scene]) -> UInt8[np.ndarray, "h w 3"]:
    """First, middle and last view from both sides, the states beside each other."""
    images: dict[str, np.ndarray] = {}
    views = next(iter(scenes.values())).front
    for view in views[[0, len(views) // 2, -1]].tolist():
        for right_m in (-ASIDE_M, ASIDE_M):
            for name, scene in scenes.items():
                camera, t_s = scene.cameras[view].moved(right_m), float(scene.times_s[view])
                images[f"{name}, view {view}, {right_m:+g} m"] = render_scene(scene, camera, t_s).picture
    return panels(images, columns=2 * len(scenes))


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Means over the streets, a state and view a line."""
    lines = [["view", "state", *(f"{group}, dB" for group in GROUPS), "stlpips-vgg", "s"]]
    for view in VIEWS if rows else ():
        for name in STATES:
            found = [row["states"][name] for row in rows]
            cells = [mean_of([one[view][key] for one in found]) for key in (*GROUPS, "stlpips")]
            seconds = mean_of([one["seconds"] for one in found])
            digits = [".2f"] * len(GROUPS) + [".4f"]
            told = [number(cell, each) for cell, each in zip(cells, digits, strict=True)]
            lines.append([view, name, *told, number(seconds, ".1f")])
    return grid(lines)


def mean_of(values: Sequence[float | None]) -> float | None:
    """Mean of what is there; None where nothing is."""
    there = [value for value in values if value is not None]
    return float(np.mean(there)) if there else None
