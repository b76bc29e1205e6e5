"""Tables of the street benchmark: means over worlds, paired differences, ratios of distances."""

from collections import defaultdict
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from _street_case import NOVEL, VIEWS, Case, true_frames
from _street_fit import Features

from dreamdrive.evaluate.bootstrap import frechet_ratio, frechet_with_interval

OURS = "hybrid"
RESAMPLES = 2000
Key = tuple[str, str, str]  # geometry, references, budget
AllFeatures = dict[tuple[Case, str, str], Features]


def summary(
    records: list[dict[str, Any]], features: AllFeatures, truth: dict[int, Features]
) -> dict[str, Any]:
    """Everything the tables show, as plain values."""
    groups: dict[Key, list[dict[str, Any]]] = defaultdict(list)
    for record in records:
        groups[record["geometry"], record["references"], record["budget"]].append(record)
    tables: list[dict[str, Any]] = []
    for (geometry, references, budget), found in groups.items():
        # What ours reached with its own steps stands in every table.
        ours = [
            r for r in groups.get((geometry, references, "equal_steps"), []) if r["representation"] == OURS
        ]
        found = found if budget == "equal_steps" else ours + found
        tables.append(
            {
                "geometry": geometry,
                "references": references,
                "budget": budget,
                "means": _means(found),
                "against_best_other": _paired(found),
                "distances": _distances(geometry, references, budget, found, features, truth),
            }
        )
    return {"tables": tables}


def _seeds(found: list[dict[str, Any]]) -> dict[str, dict[int, dict[str, Any]]]:
    by: dict[str, dict[int, dict[str, Any]]] = defaultdict(dict)
    for record in found:
        by[record["representation"]][record["seed"]] = record
    return by


def _means(found: list[dict[str, Any]]) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []
    for name, worlds in _seeds(found).items():
        row: dict[str, Any] = {"representation": name, "worlds": len(worlds)}
        for key in ("steps", "seconds"):
            row[key] = float(np.mean([record[key] for record in worlds.values()]))
        for view in VIEWS:
            for figure in ("psnr", "ssim"):
                row[f"{view}_{figure}"] = float(np.mean([r["views"][view][figure] for r in worlds.values()]))
        for figure in ("mask_iou", "fake_m"):
            known = [r[figure] for r in worlds.values() if r[figure] is not None]
            row[figure] = float(np.mean(known)) if known else None
        rows.append(row)
    return rows


def _paired(found: list[dict[str, Any]]) -> dict[str, Any]:
    """PSNR of ours less that of the best other, world by world, with a bootstrap interval over worlds.

    The best other of a view is the one with the highest mean over worlds. ``novel`` is the mean over all
    views but the withheld frames.
    """
    by, result = _seeds(found), {}
    rng = np.random.default_rng(0)
    for view in (*VIEWS, "novel"):
        shown = NOVEL if view == "novel" else (view,)
        worlds = (
            sorted(set.intersection(*(set(w) for w in by.values()))) if OURS in by and len(by) > 1 else []
        )
        if not worlds:
            continue
        values = {
            name: np.array([np.mean([w[seed]["views"][v]["psnr"] for v in shown]) for seed in worlds])
            for name, w in by.items()
        }
        best = max((name for name in values if name != OURS), key=lambda name: values[name].mean())
        difference = values[OURS] - values[best]
        drawn = difference[rng.integers(0, len(worlds), (RESAMPLES, len(worlds)))].mean(axis=1)
        low, high = np.quantile(drawn, [0.025, 0.975])
        result[view] = {
            "best_other": best,
            "db": float(difference.mean()),
            "low": float(low),
            "high": float(high),
            "worlds": len(worlds),
        }
    return result


def _distances(
    geometry: str,
    references: str,
    budget: str,
    found: list[dict[str, Any]],
    features: AllFeatures,
    truth: dict[int, Features],
) -> list[dict[str, Any]]:
    """Fréchet distances of novel views pooled over worlds and views, and ratios to ours above the floor."""
    by = _seeds(found)
    networks = sorted({name.split("/")[0] for rows in truth.values() for name in rows})
    if OURS not in by:
        return []
    worlds = sorted(set.intersection(*(set(w) for w in by.values())))
    rows: list[dict[str, Any]] = []
    for network in networks:

        def pooled(of: Features, network: str = network) -> np.ndarray:
            return np.concatenate([of[f"{network}/{view}"] for view in NOVEL])

        real = [pooled(truth[seed]) for seed in worlds]
        fake = {
            name: [pooled(_features(features, Case(s, geometry, references), name, budget)) for s in worlds]  # pyright: ignore[reportArgumentType]
            for name in by
        }
        for name, clips in fake.items():
            figure = frechet_with_interval(real, clips, paired=True, resamples=200)
            row = {
                "network": network,
                "representation": name,
                "distance": figure.value,
                "low": figure.low,
                "high": figure.high,
                "floor": figure.floor,
                "samples": figure.real_samples,
            }
            if name != OURS:
                ratio = frechet_ratio(real, fake[OURS], clips, resamples=200)
                row |= {"ours_over_this": ratio.value, "ratio_low": ratio.low, "ratio_high": ratio.high}
            rows.append(row)
    return rows


def _features(features: AllFeatures, case: Case, name: str, budget: str) -> Features:
    return features[case, name, "equal_steps" if name == OURS else budget]


def markdown(report: dict[str, Any]) -> str:
    """The tables as text."""
    parts: list[str] = []
    for table in report["tables"]:
        parts.append(
            f"## {table['geometry']} geometry, {table['references']} references, {table['budget']}\n"
        )
        head = ["representation", "worlds", "steps", "s", *VIEWS, "mask IoU", "fake motion, m"]
        lines = [head, ["---"] * len(head)]
        for row in sorted(table["means"], key=lambda r: -r["held_out_psnr"]):
            cells = [f"{row[f'{view}_psnr']:.2f} / {row[f'{view}_ssim']:.3f}" for view in VIEWS]
            for figure, form in (("mask_iou", ".2f"), ("fake_m", ".3f")):
                cells.append("-" if row[figure] is None else format(row[figure], form))
            counts = [str(row["worlds"]), f"{row['steps']:.0f}", f"{row['seconds']:.1f}"]
            lines.append([row["representation"], *counts, *cells])
        parts.append("\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n")
        gains = [
            f"{view} {gain['db']:+.2f} dB ({gain['low']:+.2f} to {gain['high']:+.2f}), {gain['best_other']}"
            for view, gain in table["against_best_other"].items()
        ]
        if gains:
            parts.append("hybrid less the best other: " + "; ".join(gains) + ".\n")
        if table["distances"]:
            parts.append(_distance_lines(table["distances"]))
    return "\n".join(parts)


def _distance_lines(rows: list[dict[str, Any]]) -> str:
    head = ["network", "representation", "distance", "95 %", "floor", "N", "hybrid's excess over this one's"]
    lines = [head, ["---"] * len(head)]
    for row in rows:
        span = "-" if row["low"] is None else f"{row['low']:.3g} to {row['high']:.3g}"
        ratio = "-"
        if row.get("ours_over_this") is not None:
            low, high = row["ratio_low"], row["ratio_high"]
            ratio = f"{row['ours_over_this']:.2f}"
            if low is not None:
                ratio += f" ({low:.2f} to {high:.2f})" + (", undecided" if low <= 1 <= high else "")
        cells = [
            row["network"],
            row["representation"],
            f"{row['distance']:.4g}",
            span,
            f"{row['floor']:.3g}",
            str(row["samples"]),
            ratio,
        ]
        lines.append(cells)
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def picture(path: Path, seeds: list[int], runs: Path) -> None:
    """A grid: a row a world, the truth of a shifted view beside what was kept of each representation."""
    rows: list[np.ndarray] = []
    for seed in seeds:
        shown = [true_frames(seed, "shift_2", runs / "truth")[12]]
        for name in (OURS, "vibration", "hexplane", "deformable", "static"):
            kept = runs / "shown" / f"{seed}-true-corrupted-{name}-equal_steps.png"
            if kept.exists():
                shown.append(cv2.imread(str(kept))[..., ::-1])
        rows.append(np.hstack(shown))
    width = min(row.shape[1] for row in rows)
    cv2.imwrite(str(path), np.vstack([row[:, :width] for row in rows])[..., ::-1])
