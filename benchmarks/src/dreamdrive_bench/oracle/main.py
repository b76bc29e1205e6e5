"""What truth in place of each part is worth: labels, tracks, depth of what moves, depth of what stands.

The same fit each time (drawn streets of edition 1, 320x192, ``draft``, the twin of the street network), with
the truth of the drawing in place of what stages found. ``as it is`` has none, ``none`` not even the street
network. ``standard`` has none either, and the steps of that quality; ``longer`` takes five times as many, to
see whether steps undo what was right. ``ceiling`` has no scene: it reads each pixel that a training frame has
seen from the one that saw it at the most similar distance, with true depth and tracks.
PSNR of all pixels, of seen ones that stand and that move, and of unseen ones; then how well what moves is
told apart, and where the boxes of actors are. What was measured with the same program is kept.
"""

import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from typing import Any, get_args

import numpy as np

from dreamdrive.files.digest import digest
from dreamdrive.options import QUALITIES, Options
from dreamdrive.run import program_digest
from dreamdrive.street_network import NO_KNOWLEDGE
from dreamdrive_bench.common.keep import kept
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.markdown import grid, number
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import publish
from dreamdrive_bench.common.worlds import DEVELOPMENT, set_of
from dreamdrive_bench.oracle.arms import ARMS, ceiling, judged
from dreamdrive_bench.oracle.views import Seen, seen
from dreamdrive_bench.street.case import VIEWS, Case, References, case_digest, clip_of
from dreamdrive_bench.street.methods import QUALITY
from dreamdrive_bench.street.views import views_digest

Row = dict[str, Any]
AS_IT_IS, WITHOUT, CEILING = "as it is", "none", "ceiling"
NAMES = {WITHOUT: None, **{"+".join(arm) or AS_IT_IS: arm for arm in ARMS}, CEILING: None}
STEPS = {"standard": 1, "longer": 5}
"""Arms that take the steps of ``standard`` in place of those of ``draft``, or a multiple of them."""
GROUPS = ("all", "standing", "moving", "unseen")


def main() -> int:
    """Measure, print the tables and write all as JSON."""
    parser = parser_of(__doc__, runs="runs/oracle", markdown=True)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(DEVELOPMENT[:4]))
    parser.add_argument("--references", nargs="+", choices=get_args(References), default=["clean"])
    parser.add_argument("--poses", nargs="+", choices=("true", "estimated"), default=["true"])
    parser.add_argument("--views", nargs="+", choices=VIEWS, default=["held_out", "shift_2"])
    parser.add_argument("--arms", nargs="+", choices=[*NAMES, *STEPS], default=list(NAMES))
    args = parser.parse_args()
    rows: list[Row] = []
    for case in [Case(s, p, r) for r in args.references for p in args.poses for s in args.seeds]:
        views = cache(partial(_views, case, tuple(args.views)))
        for name in args.arms:
            path = args.runs / f"{case.name}-{name.replace(' ', '-')}.json"
            key = digest(
                [
                    program_digest(),
                    _options(name),
                    name,
                    case_digest(case),
                    views_digest(case.seed),
                    args.views,
                ]
            )
            found = kept(path, key, partial(_measured, case, name, views))
            rows.append(
                {
                    "arm": name,
                    "poses": case.geometry,
                    "references": case.references,
                    "seed": case.seed,
                    **found,
                }
            )
            print(_line(rows[-1]), file=sys.stderr, flush=True)
    report = {"machine": describe_machine(), "worlds": set_of(args.seeds), "rows": rows}
    return publish(args, report, tables(rows), ())


def _options(name: str) -> Options:
    if name in STEPS:
        longer, times = QUALITIES["standard"], STEPS[name]
        return replace(
            longer,
            knowledge=QUALITY.knowledge,
            static=replace(longer.static, steps=times * longer.static.steps),
            fit=replace(longer.fit, steps=times * longer.fit.steps),
        )
    return replace(QUALITY, knowledge=NO_KNOWLEDGE) if name == WITHOUT else QUALITY


def _views(case: Case, names: tuple[str, ...]) -> dict[str, Seen]:
    return {name: seen(case.seed, name, clip_of(case)) for name in names}


def _measured(case: Case, name: str, views: Callable[[], dict[str, Seen]]) -> Row:
    if name == CEILING:
        return ceiling(views())
    return judged(case, _options(name), NAMES.get(name) or (), views())


def _line(row: Row) -> str:
    cells = [f"{view} {number(row[view]['all'])} / {number(row[view]['moving'])}" for view in _shown(row)]
    return f"{row['seed']} {row['poses']} {row['references']} {row['arm']}: " + ", ".join(cells)


def _shown(row: Row) -> list[str]:
    return [view for view in VIEWS if view in row]


def tables(rows: list[Row]) -> str:
    """For each kind of case and each view the means over the worlds, an arm a line."""
    texts: list[str] = []
    for poses, references in dict.fromkeys((row["poses"], row["references"]) for row in rows):
        same = [row for row in rows if (row["poses"], row["references"]) == (poses, references)]
        for view in _shown(same[0]):
            texts.append(
                f"{view}, {poses} poses, {references} references, {len({r['seed'] for r in same})} worlds\n"
            )
            texts.append(_table(same, view))
        told = [row for row in same if "apart" in row]
        texts += [f"what moves, {poses} poses, {references} references\n", _apart(told)] if told else []
    return "\n".join(texts)


def _table(rows: list[Row], view: str) -> str:
    arms = dict.fromkeys(row["arm"] for row in rows)
    mean = {arm: {g: _mean([r[view][g] for r in rows if r["arm"] == arm]) for g in GROUPS} for arm in arms}
    nothing = dict.fromkeys(GROUPS)
    low, high = mean.get(WITHOUT, nothing), mean.get("+".join(ARMS[-1]), nothing)
    lines = [["truth in place of", *(f"{g}, dB" for g in GROUPS), "share of what all truth brings, %"]]
    for arm, values in mean.items():
        gains = [_share(values[g], low[g], high[g]) for g in ("all", "moving")]
        told = "" if arm in (WITHOUT, CEILING) else " / ".join(number(gain, ".0f") for gain in gains)
        lines.append([arm, *(number(values[g]) for g in GROUPS), told])
    return grid(lines)


def _apart(rows: list[Row]) -> str:
    """What moves and its boxes: means over the worlds, of places and headings medians over them."""
    lines = [
        [
            "truth in place of",
            "mask IoU",
            "fake motion, mm",
            "box off, m",
            "heading off, degrees",
            "number right, %",
        ]
    ]
    for arm in dict.fromkeys(row["arm"] for row in rows):
        told = [row["apart"] for row in rows if row["arm"] == arm]
        boxes = [each["boxes"] for each in told if each["boxes"] and each["boxes"]["pairs"]]
        middle = [
            _median([box[name] for box in boxes]) for name in ("position_median_m", "heading_median_deg")
        ]
        fake_m, right = _mean([t["fake_m"] for t in told]), _mean([box["count_right"] for box in boxes])
        lines.append(
            [
                arm,
                number(_mean([t["mask_iou"] for t in told]), ".3f"),
                number(fake_m and 1000 * fake_m, ".0f"),
                number(middle[0]),
                number(middle[1], ".1f"),
                number(right and 100 * right, ".0f"),
            ]
        )
    return grid(lines)


def _median(values: list[float]) -> float | None:
    return float(np.median(values)) if values else None


def _mean(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def _share(value: float | None, low: float | None, high: float | None) -> float | None:
    if value is None or low is None or high is None or high <= low:
        return None
    return 100 * (value - low) / (high - low)
