"""Figures of the experiment: IoU of all arms, and paired differences with intervals."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from dreamdrive_bench.common.markdown import table
from dreamdrive_bench.perception.protocol import Protocol

CLASSES = ("vehicle", "road")
_PAIRS = (("real", "generated"), ("real", "warped"), ("warped", "generated"), ("oracle", "only"))
_RESAMPLES = 2000
Counts = np.ndarray
"""Hits, false alarms and misses (seeds, streets, 3)."""


def counts_of(rows: Sequence[Mapping[str, Any]], arm: str, tested: str, what: str) -> Counts:
    """Counts of an arm by seed and street."""
    own = sorted((row for row in rows if row["arm"] == arm and tested in row), key=lambda row: row["seed"])
    streets = sorted(own[0][tested]) if own else []
    return np.array(
        [[_at_one_half(row[tested][s][what]) for s in streets] for row in own],
        dtype=np.float64,
    )


def _at_one_half(counts: Mapping[str, Sequence[float]] | Sequence[float]) -> list[float]:
    """Counts at a probability of one half, at which published figures are; these stay as they are."""
    if not isinstance(counts, Mapping):
        return list(counts)
    at = counts["thresholds"].index(0.5)
    return [counts[name][at] for name in ("hits", "false_alarms", "misses")]


def published(row: Mapping[str, Any]) -> dict[str, Any]:
    """Of a row what its figures follow from: hits, false alarms and misses of each street."""
    kept: dict[str, Any] = {}
    for name, value in row.items():
        if isinstance(value, Mapping):
            kept[name] = {s: {what: _at_one_half(of[what]) for what in CLASSES} for s, of in value.items()}
        elif name != "key":
            kept[name] = value
    return kept


def iou(counts: Counts) -> float:
    """Mean over seeds of intersection over union of all streets together, in percent."""
    pooled = counts.sum(axis=1)
    return float(100 * (pooled[:, 0] / (pooled.sum(axis=1) + 1e-7)).mean())


def difference(one: Counts, other: Counts, seed: int = 0) -> tuple[float, float, float]:
    """How much better ``other`` is in points, and its 95 % interval over resampled seeds and streets."""
    rng = np.random.default_rng(seed)
    seeds, streets = one.shape[:2]
    drawn = []
    for _ in range(_RESAMPLES):
        rows, columns = rng.integers(0, seeds, seeds), rng.integers(0, streets, streets)
        drawn.append(iou(other[rows][:, columns]) - iou(one[rows][:, columns]))
    low, high = np.percentile(drawn, [2.5, 97.5])
    return iou(other) - iou(one), float(low), float(high)


def tables(rows: Sequence[Mapping[str, Any]], protocol: Protocol) -> str:
    """All arms, and how they differ."""
    lines: list[list[str]] = []
    for arm in protocol.arms:
        counts = {what: counts_of(rows, arm, "validation", what) for what in CLASSES}
        samples = next((str(row["samples"]) for row in rows if row["arm"] == arm), "-")
        lines.append([arm, samples, *(f"{iou(c):.2f}" if c.size else "-" for c in counts.values())])
    text = table(["arm", "samples", "vehicle IoU", "road IoU"], lines)
    changed: list[list[str]] = []
    for one, other in _PAIRS:
        if not {one, other} <= protocol.arms.keys():
            continue
        row = [f"{other} over {one}"]
        for what in CLASSES:
            first, second = (counts_of(rows, arm, "validation", what) for arm in (one, other))
            if first.size and first.shape == second.shape:
                mean, low, high = difference(first, second)
                row.append(f"{mean:+.2f} ({low:+.2f} to {high:+.2f})")
            else:
                row.append("-")
        changed.append(row)
    text += "\n\n" + table(["points, with the 95 % interval over seeds and streets", *CLASSES], changed)
    return text + "\n\n" + _realism(rows, protocol) if protocol.realism.trained in protocol.arms else text


def _realism(rows: Sequence[Mapping[str, Any]], protocol: Protocol) -> str:
    """A network of recorded samples, on recorded and on generated ones."""
    lines: list[list[str]] = []
    for tested in ("validation", protocol.realism.tested):
        counts = [counts_of(rows, protocol.realism.trained, tested, what) for what in CLASSES]
        lines.append([tested, *(f"{iou(c):.2f}" if c.size else "-" for c in counts)])
    return table([f"trained on {protocol.realism.trained}, tested on", *CLASSES], lines)
