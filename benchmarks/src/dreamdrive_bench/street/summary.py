"""Figures of the street benchmark over worlds: means, paired differences, ratios of distances."""

from collections import defaultdict
from typing import Any

import numpy as np

from dreamdrive_bench.common.keep import Features
from dreamdrive_bench.common.worlds import common_worlds, set_of
from dreamdrive_bench.street.case import NOVEL, VIEWS, Case
from dreamdrive_bench.street.distances import Basis, Worlds, bases_of, compared, distance_rows
from dreamdrive_bench.street.methods import OURS

RESAMPLES = 2000
LIMITS_S = {"equal_steps": 60.0, "five_times": 300.0}
"""Seconds that a fit was to take at most."""
WORLD_TABLES = (("clean", "true"), ("clean", "estimated"), ("corrupted", "true"), ("corrupted", "estimated"))
Key = tuple[str, str, str]  # geometry, references, budget
AllFeatures = dict[tuple[Case, str, str], Features]


def summary(records: list[dict[str, Any]], features: AllFeatures, truth: Worlds) -> dict[str, Any]:
    """Everything the tables show, as plain values; each table is over the worlds that all its rows have.

    Raises:
        ValueError: The worlds are of several sets.
    """
    name_of_set = set_of(record["seed"] for record in records)
    bases = bases_of(truth)
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
        worlds = common_worlds(found, "representation")
        found = [record for record in found if record["seed"] in worlds]
        distances = _distances((geometry, references, budget), found, features, truth, bases)
        tables.append(
            {
                "geometry": geometry,
                "references": references,
                "budget": budget,
                "set": name_of_set,
                "worlds": worlds,
                "threads": sorted({record["threads"] for record in found}),
                "means": _means(found),
                "against_best_other": _paired(found),
                "distances": distances,
                "distances_compared": compared(distances),
            }
        )
    return {
        "components": {name: basis.axes.shape[1] for name, basis in bases.items()},
        "samples": samples_of(truth),
        "tables": tables,
        "mask_iou_by_world": mask_iou_by_world(records),
        "seconds": seconds_of(records),
    }


def samples_of(truth: Worlds) -> dict[str, dict[str, int]]:
    """By network and novel view the number of true samples; 0 where no frame or window counts."""
    names = sorted({key.split("/")[0] for found in truth.values() for key in found})
    return {
        name: {view: sum(len(found.get(f"{name}/{view}", ())) for found in truth.values()) for view in NOVEL}
        for name in names
    }


def mask_iou_by_world(records: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """A row a world, of ours at equal steps: a world in which nothing is found pulls the mean."""
    rows: dict[int, dict[str, Any]] = {}
    for record in records:
        about = record["references"], record["geometry"]
        if record["representation"] == OURS and record["budget"] == "equal_steps" and about in WORLD_TABLES:
            rows.setdefault(record["seed"], {"seed": record["seed"]})["-".join(about)] = record["mask_iou"]
    return [rows[seed] for seed in sorted(rows)]


def seconds_of(records: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Mean and most seconds of the fits of each representation, by budget."""
    groups: dict[tuple[str, str], list[float]] = defaultdict(list)
    for record in records:
        if record["budget"] in LIMITS_S:
            groups[record["representation"], record["budget"]].append(record["seconds"])
    return [
        {"representation": name, "budget": budget, "mean": float(np.mean(found)), "most": max(found)}
        for (name, budget), found in groups.items()
    ]


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
                row[f"{view}_{figure}"] = mean_of([r["views"][view][figure] for r in worlds.values()])
        row["frames"] = {view: sum(r["views"][view]["frames"] for r in worlds.values()) for view in VIEWS}
        for figure in ("mask_iou", "fake_m"):
            row[figure] = mean_of([r[figure] for r in worlds.values()])
        timed = [r["seconds"] / r["hybrid_s"] for r in worlds.values() if "hybrid_s" in r]
        row |= {"of_hybrid": mean_of(timed), "of_hybrid_by_world": timed} if timed else {}
        rows.append(row)
    return rows


def mean_of(values: list[float | None]) -> float | None:
    """Of those that are known."""
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def _paired(found: list[dict[str, Any]]) -> dict[str, Any]:
    """PSNR of ours less that of the best other, world by world, with a bootstrap interval over worlds.

    The best other of a view is the one with the highest mean over worlds. ``novel`` is the mean over all
    views but the held-out frames. A world without a frame that counts in a view is left out of it.
    """
    by, result = _seeds(found), {}
    if OURS not in by or len(by) == 1:
        return {}
    rng = np.random.default_rng(0)
    for view in (*VIEWS, "novel"):
        shown = NOVEL if view == "novel" else (view,)
        ours = {seed: record["views"] for seed, record in by[OURS].items()}
        worlds = [seed for seed in ours if all(ours[seed][v]["psnr"] is not None for v in shown)]
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
    key: Key, found: list[dict[str, Any]], features: AllFeatures, truth: Worlds, bases: dict[str, Basis]
) -> list[dict[str, Any]]:
    """Rows of the table of distances, where features were kept for it."""
    geometry, references, budget = key
    if not truth or budget != "equal_steps" or geometry == "unknown_focal":
        return []
    fits: dict[str, Worlds] = {}
    for name, worlds in _seeds(found).items():
        cases = {seed: Case(seed, geometry, references) for seed in worlds}  # pyright: ignore[reportArgumentType]
        fits[name] = {seed: features[case, name, budget] for seed, case in cases.items()}
    return distance_rows(OURS, fits, truth, bases)
