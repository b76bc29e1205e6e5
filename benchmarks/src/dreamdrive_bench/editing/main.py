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

from dreamdrive.edit import Delay, Edit, Insert, Move, Remove, Turn, edited
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
from dreamdrive_bench.editing.truth import Pair, delayed, inserted, moved, pairs_of, removed, room_m, turned
from streetworld import drive, make_street

_FRAMES, _RATE_HZ, _SIZE, _QUALITY = 24, 10.0, (320, 192), "draft"
_METRES, _DEGREES, _SECONDS = 2.0, 20.0, 0.5
_PLACES_M = tuple((ahead_m, left_m) for ahead_m in (10.0, 15.0, 20.0, 28.0) for left_m in (0.0, 3.5, -3.5))
"""Ahead and left: where another street's actor may be set."""
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
    return scene_of(partial(_street, seed), _QUALITY, _folder(seed, runs))


def _folder(seed: int, runs: Path) -> Path:
    return runs / f"street-{seed}"


def _of_street(seed: int, args: argparse.Namespace) -> Iterator[dict[str, Any]]:
    scene, made = _scene(seed, args.runs), _street(seed)
    before = shown(scene)
    other = args.seeds[(args.seeds.index(seed) + 1) % len(args.seeds)]
    for pair in pairs_of(scene, made)[: args.actors]:
        for kind in [kind for kind in args.kinds if kind != "insert"]:
            about = {"kind": kind, "actor": pair.actor.id, "apart_m": pair.apart_m}
            yield _kept(seed, about, args, partial(_measured, kind, scene, made, pair, before))
    if "insert" in args.kinds and other != seed:
        about = {"kind": "insert", "actor": other}
        yield _kept(seed, about, args, partial(_set_in, seed, other, before, args.runs))


def _kept(
    seed: int, about: dict[str, Any], args: argparse.Namespace, measure: Callable[[], dict[str, Any]]
) -> dict[str, Any]:
    """A row, measured now, or before with ``--resume``."""
    file = args.runs / f"{seed}-{about['actor']}-{about['kind']}.json"
    if not args.resume:
        file.unlink(missing_ok=True)
    return {"seed": seed, **about, **kept(file, str(about), measure)}


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


def _set_in(seed: int, other: int, before: Shown, runs: Path) -> dict[str, Any]:
    """An actor of another street in this one, where it comes nearest to nothing."""
    scene, made = _scene(seed, runs), _street(seed)
    guest, layout = _scene(other, runs), _street(other).layout
    pair = pairs_of(guest, _street(other))[0]
    from_s = pair.actor.track.first_s
    trials = [inserted(made.layout, layout, pair.box.id, from_s, np.array(place)) for place in _PLACES_M]
    best = int(np.argmax([room_m(trial, made.times_s) for trial in trials]))
    ahead_m, left_m = _PLACES_M[best]
    after = drive(trials[best], _FRAMES, _RATE_HZ, _SIZE)
    edit = Insert.from_folder(_folder(other, runs), pair.actor.id, ahead_m, left_m)
    truths = Truths.of(made, after, None, "inserted")
    return {"other": other, **figures(truths, before, shown(edited(scene, [edit])))}


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
