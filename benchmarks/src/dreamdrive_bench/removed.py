"""What stands behind what was taken away: scenes without their actors, against streets drawn without them.

Drawn streets of edition 1, true poses, ``draft``, the twin of the street network. All actors of the scene are
taken away. The truth is the same street less the boxes that move. PSNR along the recorded path of what they
hid, of their shadows, and of the rest; and by how much pictures change at most where nothing of an actor was.
"""

from typing import Any, get_args

import msgspec
import numpy as np

from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive.splat import render_scene
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.markdown import grid, number
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import publish
from dreamdrive_bench.common.worlds import DEVELOPMENT, set_of
from dreamdrive_bench.oracle.arms import scene_of
from dreamdrive_bench.street.case import FRAMES, RATE_HZ, SIZE, Case, References, world_of
from dreamdrive_bench.street.methods import QUALITY
from streetworld import drive

SHADOW = 8  # of 255, by which the road is darker in one of the two streets
PARTS = ("hidden", "shadow", "rest")
COVERED = 1e-6  # share of a pixel from which on something of an actor was there


def main() -> int:
    """Measure, print the table and write all as JSON."""
    parser = parser_of(__doc__, markdown=True)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(DEVELOPMENT[:4]))
    parser.add_argument("--references", nargs="+", choices=get_args(References), default=["clean"])
    args = parser.parse_args()
    rows = [measured(Case(seed, "true", r)) for r in args.references for seed in args.seeds]
    report = {"machine": describe_machine(), "worlds": set_of(args.seeds), "rows": rows}
    return publish(args, report, table(rows), ())


def measured(case: Case) -> dict[str, Any]:
    """The figures of one street."""
    scene, made = scene_of(case, QUALITY, ()), world_of(case.seed)
    empty = scene
    for actor in scene.actors:
        empty = empty.without(actor.id)
    return {
        "seed": case.seed,
        "references": case.references,
        "actors": len(scene.actors),
        **behind(empty, made),
        "largest_change": largest_change(scene, empty),
    }


def emptied(made: DriveTruth) -> DriveTruth:
    """The same drive through the street without what moves."""
    moving = {box.id for box in made.boxes if box.moving}
    boxes = [box for box in made.layout.boxes if box.id not in moving]
    return drive(msgspec.structs.replace(made.layout, boxes=boxes), FRAMES, RATE_HZ, SIZE)


def behind(empty: Scene, made: DriveTruth) -> dict[str, float | None]:
    """PSNR of each part of the pictures, of the mean square over all frames."""
    truth = emptied(made).frames.astype(np.float32)
    darker = np.abs(truth - made.frames).max(axis=-1) > SHADOW
    parts = {"hidden": made.moving, "shadow": darker & ~made.moving, "rest": ~darker & ~made.moving}
    shown = [
        render_scene(empty, camera, float(t_s)).colour.numpy() * 255
        for camera, t_s in zip(empty.cameras, empty.times_s, strict=True)
    ]
    wrong = np.square(np.stack(shown) - truth).mean(axis=-1) / 255**2
    return {name: _psnr(wrong[mask]) for name, mask in parts.items()}


def _psnr(wrong: np.ndarray) -> float | None:
    return float(-10 * np.log10(wrong.mean())) if wrong.size else None


def largest_change(scene: Scene, empty: Scene) -> float:
    """By how much any channel changes where no dynamic Gaussian was, in parts of 255."""
    largest = 0.0
    for camera, t_s in zip(scene.cameras, scene.times_s.tolist(), strict=True):
        before, after = render_scene(scene, camera, t_s), render_scene(empty, camera, t_s)
        change = (before.colour - after.colour).abs().amax(dim=-1)[before.dynamic_share < COVERED]
        largest = max(largest, 255 * float(change.max()) if len(change) else 0.0)
    return largest


def table(rows: list[dict[str, Any]]) -> str:
    """A street a line."""
    head = [
        "street",
        "references",
        "actors",
        *(f"{part}, dB" for part in PARTS),
        "largest change elsewhere, /255",
    ]
    lines = [
        [
            str(row["seed"]),
            row["references"],
            str(row["actors"]),
            *(number(row[part]) for part in PARTS),
            number(row["largest_change"]),
        ]
        for row in rows
    ]
    return grid([head, *lines])
