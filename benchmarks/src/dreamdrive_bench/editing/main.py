"""Edited scenes, against streets that are drawn with the same edit.

Drawn streets of edition 1, recorded by the front camera for 24 frames, and the scenes made of them at quality
draft with known poses. Actors are matched with the boxes that move; of each street the ones that fill most
pixels are removed, moved, turned, delayed, and set into the next street of the list. The layout is changed
alike and drawn again. PSNR where the two drawings differ, beside what the scene as it was has there; of the
hole, the new place and the shadows apart; and by how much pictures change at most elsewhere.
"""

import argparse
from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from dreamdrive.edit import Delay, Edit, Move, Remove, Turn, edited
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.layout import Layout
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive_bench.common.keep import kept
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.made import scene_of
from dreamdrive_bench.common.markdown import grid, number
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import publish
from dreamdrive_bench.common.worlds import DEVELOPMENT, set_of
from dreamdrive_bench.editing.measure import Shown, Truths, figures, shown
from dreamdrive_bench.editing.truth import Pair, delayed, inserted, moved, pairs_of, removed, turned
from streetworld import drive, make_street

_FRAMES, _RATE_HZ, _SIZE, _QUALITY = 24, 10.0, (320, 192), "draft"
_METRES, _DEGREES, _SECONDS = 2.0, 20.0, 0.5
_PLACES_M = ((14.0, 0.0), (14.0, 3.5), (20.0, 0.0))
"""Ahead and left, where another street's actor is set, the first that is free."""
KINDS = ("remove", "ahead", "aside", "turn", "delay", "insert")


def main() -> int:
    """Measure, print the table and write all as JSON."""
    parser = parser_of(__doc__, runs="runs/editing", resume=True, markdown=True)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(DEVELOPMENT))
    parser.add_argument("--actors", type=int, default=1, help="of each street")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS)
    args = parser.parse_args()
    rows: list[dict[str, Any]] = []
    for seed in args.seeds:
        for row in _of_street(seed, args):
            rows.append(row)
            print({k: round(v, 2) if isinstance(v, float) else v for k, v in row.items()}, flush=True)
    report = {"machine": describe_machine(), "worlds": set_of(args.seeds), "rows": rows}
    return publish(args, report, _table(rows), ())


@cache
def _street(seed: int) -> DriveTruth:
    return make_street(seed, _FRAMES, _RATE_HZ, _SIZE)


def _scene(seed: int, runs: Path) -> Scene:
    return scene_of(partial(_street, seed), _QUALITY, runs / f"street-{seed}")


def _of_street(seed: int, args: argparse.Namespace) -> Iterator[dict[str, Any]]:
    scene, made = _scene(seed, args.runs), _street(seed)
    before = shown(scene)
    for pair in pairs_of(scene, made)[: args.actors]:
        for kind in args.kinds:
            file = args.runs / f"{seed}-{pair.actor.id}-{kind}.json"
            if not args.resume:
                file.unlink(missing_ok=True)
            about = {"seed": seed, "kind": kind, "actor": pair.actor.id, "apart_m": pair.apart_m}
            measure = partial(_measured, kind, scene, made, pair, before)
            yield about | kept(file, kind, measure)


def _measured(kind: str, scene: Scene, made: DriveTruth, pair: Pair, before: Shown) -> dict[str, Any]:
    actor, box = pair.actor, pair.box.id
    middle_s = float(actor.track.times_s[len(actor.track.times_s) // 2])
    ways: dict[str, tuple[Edit, Callable[[Layout], Layout]]] = {
        "remove": (Remove(actor.id), lambda layout: removed(layout, box)),
        "ahead": (Move(actor.id, _METRES, 0.0), lambda layout: moved(layout, box, middle_s, _METRES, 0.0)),
        "aside": (Move(actor.id, 0.0, _METRES), lambda layout: moved(layout, box, middle_s, 0.0, _METRES)),
        "turn": (Turn(actor.id, _DEGREES), lambda layout: turned(layout, box, _DEGREES)),
        "delay": (Delay(actor.id, _SECONDS), lambda layout: delayed(layout, box, _SECONDS)),
    }
    edit, drawn = ways[kind]
    after = drive(drawn(made.layout), _FRAMES, _RATE_HZ, _SIZE)
    truths = Truths.of(made, after, box, None if kind == "remove" else box)
    return figures(truths, before, shown(edited(scene, [edit])))


def _table(rows: list[dict[str, Any]]) -> str:
    columns = ("after", "before", "hole", "there", "shadow", "elsewhere")
    head = ["edit", "n", *columns]
    lines = []
    for kind in KINDS:
        own = [row for row in rows if row["kind"] == kind]
        if own:
            lines.append([kind, str(len(own)), *(number(_mean(own, name)) for name in columns)])
    return grid([head, *lines])


def _mean(rows: list[dict[str, Any]], name: str) -> float | None:
    values = [row[name] for row in rows if row[name] is not None]
    return float(np.mean(values)) if values else None
