"""What a generated 4D scene is worth to a planner (the paper's Table III).

Scenarios, seeds and sizes stand in protocol.json. In each a drawn street is recorded up to one
instant, a 4D scene is made of these frames, and planners that react to nothing that is not in their lane
plan three seconds. Their plans are then moved away from what the scene shows, whose actors go on as they
did; no frame after the instant is used. Collisions are those of the car's rectangle with the true boxes of
all road users, as they go on, at six waypoints. Beside it: the same with true boxes in place of the scene,
which go on at their velocity; with true boxes as they really go on, which nobody knows; and UniAD's
optimisation with the values of Agent-Driver. Intervals are of 10,000 draws of scenarios.
"""

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.markdown import table
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import publish
from dreamdrive_bench.planning.protocol import KINDS, Protocol, read_protocol
from dreamdrive_bench.planning.scenarios import draw_scenario
from dreamdrive_bench.planning.trial import PLANNERS, SOURCES, Trial, try_scenario

_DRAWS = 10_000
_NAMES = {
    "scene": "generated scene",
    "boxes": "true boxes, going on",
    "boxes later": "true boxes, as they will be (oracle)",
}


def main() -> int:
    """Make what is missing, judge, print the tables."""
    parser = parser_of(__doc__, runs="runs/planning", markdown=True)
    parser.add_argument("--set", choices=("development", "test"), default="development")
    args = parser.parse_args()
    protocol = read_protocol()
    groups = protocol.development if args.set == "development" else protocol.test
    trials: list[Trial] = []
    wanted = [(group.kind, seed) for group in groups for seed in group.seeds]
    for number, (kind, seed) in enumerate(wanted):
        trials.append(_trial(kind, seed, protocol, args.runs))
        print(f"{trials[-1].name}: {number + 1} of {len(wanted)}", flush=True)
    rows = [row for planner in PLANNERS for row in _rows(planner, trials)]
    report = {"machine": describe_machine(), "set": args.set, "scenarios": len(trials), "rows": rows}
    report["trials"] = [_brief(each) for each in trials]
    return publish(args, report, _tables(rows, trials), ())


def _brief(trial: Trial) -> dict[str, Any]:
    """Which plans collide, and how far each is from the true drive in the mean."""
    hits = [name for name, at in trial.collides.items() if any(at)]
    error_m = {name: round(float(np.mean(at)), 3) for name, at in trial.error_m.items()}
    return {"name": trial.name, "collide": hits, "error_m": error_m}


def _trial(kind: Any, seed: int, protocol: Protocol, runs: Path) -> Trial:
    scenario = draw_scenario(kind, seed, protocol)
    return try_scenario(scenario, protocol, "draft", runs / "scenes")


def _rows(planner: str, trials: list[Trial]) -> list[dict[str, Any]]:
    """The planner alone, and each way to move its plans."""
    before, error = _of(planner, trials)
    rows: list[dict[str, Any]] = [_row(planner, "alone", "", before, before, error, error)]
    for way in ("ours", "uniad"):
        for source in SOURCES:
            after, moved = _of(f"{planner} | {way} | {source}", trials)
            rows.append(_row(planner, way, _NAMES[source], before, after, error, moved))
    return rows


def _of(name: str, trials: list[Trial]) -> tuple[Bool[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """In which scenarios plans of a name collide at any waypoint, and their mean distance from the truth."""
    hits = np.array([any(trial.collides[name]) for trial in trials])
    return hits, np.array([float(np.mean(trial.error_m[name])) for trial in trials])


def _row(
    planner: str,
    way: str,
    source: str,
    before: Bool[np.ndarray, " n"],
    after: Bool[np.ndarray, " n"],
    error_m: Float[np.ndarray, " n"],
    moved_m: Float[np.ndarray, " n"],
) -> dict[str, Any]:
    drawn = np.random.default_rng(0).integers(len(before), size=(_DRAWS, len(before)))
    falls = 1 - after[drawn].sum(axis=1) / np.maximum(before[drawn].sum(axis=1), 1)
    worse = moved_m[drawn].mean(axis=1) / error_m[drawn].mean(axis=1) - 1
    return {
        "planner": planner,
        "way": way,
        "source": source,
        "collisions": int(after.sum()),
        "fall": float(1 - after.sum() / max(before.sum(), 1)),
        "fall_interval": np.quantile(falls, [0.025, 0.975]).tolist(),
        "new": int((after & ~before).sum()),
        "l2_m": float(moved_m.mean()),
        "l2_worse": float(moved_m.mean() / error_m.mean() - 1),
        "l2_worse_interval": np.quantile(worse, [0.025, 0.975]).tolist(),
    }


def _tables(rows: list[dict[str, Any]], trials: list[Trial]) -> str:
    head = [
        "planner",
        "moved by",
        "what it sees",
        "collisions",
        "fall",
        "95 %",
        "new",
        "L2 m",
        "L2 worse",
        "95 %",
    ]
    lines = [
        [
            row["planner"],
            row["way"],
            row["source"],
            f"{row['collisions']} of {len(trials)}",
            *(("", "", "") if row["way"] == "alone" else _fall(row)),
            f"{row['l2_m']:.3f}",
            *(("", "") if row["way"] == "alone" else _worse(row)),
        ]
        for row in rows
    ]
    kinds = [[kind, *(str(_hits(kind, name, trials)) for name in _columns())] for kind in KINDS]
    columns = [name.replace(" | ", ", ") for name in _columns()]
    return table(head, lines) + "\n\n" + table(["kind", *columns], kinds) + "\n"


def _fall(row: dict[str, Any]) -> tuple[str, str, str]:
    low, high = row["fall_interval"]
    return f"{row['fall']:.0%}", f"{low:.0%} to {high:.0%}", str(row["new"])


def _worse(row: dict[str, Any]) -> tuple[str, str]:
    low, high = row["l2_worse_interval"]
    return f"{row['l2_worse']:+.1%}", f"{low:+.1%} to {high:+.1%}"


def _columns() -> list[str]:
    return [name for planner in PLANNERS[:2] for name in (planner, f"{planner} | ours | scene")]


def _hits(kind: str, name: str, trials: list[Trial]) -> int:
    return sum(any(trial.collides[name]) for trial in trials if trial.kind == kind)
