"""Tables of the street benchmark: means over worlds, paired differences, ratios of distances."""

import json
from collections import defaultdict
from typing import Any

import numpy as np
from _markdown import table as table_of
from _street_case import FRAMES, NOVEL, VIEWS, Case
from _street_consistency import FOUND_BY, KINDS, MEASURES
from _street_distances import COMPONENTS, SAMPLES_EACH, Basis, Worlds, bases_of, compared, distance_rows
from _street_keep import Features
from _street_recording import CLIP
from _street_renderer import ASKED
from _street_views import NEAR_M

CAPTION = """\
Frames whose true camera is inside a box, or nearer than {near} m to one, do not count; beside each table
stands how many do. `s` are seconds of the processor for decomposition and joint fit, without the static
fit that all share.

Fréchet distance in the first {most} principal components of the truth (kept: {counts}; at most one for
{each} samples): features centred and projected, not whitened, one basis for all rows; in all dimensions as
well, without intervals. Samples are frames of image networks and windows of 16 frames, each 2 after the
last and without a frame that does not count, of video networks, of shifted, raised and turned views of all
worlds together ({samples}). An excess is a distance of halves less the floor, which is that of two halves
of the truth. Intervals are drawn over worlds. Those of distances are moved so that their middle is the
value, as duplicates raise a distance; those of ratios are the quantiles as drawn, and a ratio whose
interval holds 1 is undecided.
"""
OURS = "hybrid"
RESAMPLES = 2000
LIMITS_S = {"equal_steps": 60.0, "five_times": 300.0}
"""Seconds that a fit was to take at most."""
SAME_TIME = 0.1
"""Share by which equal time may be missed before the table says so."""
WORLD_TABLES = (("clean", "true"), ("clean", "estimated"), ("corrupted", "true"), ("corrupted", "estimated"))
Key = tuple[str, str, str]  # geometry, references, budget
AllFeatures = dict[tuple[Case, str, str], Features]


def summary(records: list[dict[str, Any]], features: AllFeatures, truth: Worlds) -> dict[str, Any]:
    """Everything the tables show, as plain values."""
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
        distances = _distances((geometry, references, budget), found, features, truth, bases)
        tables.append(
            {
                "geometry": geometry,
                "references": references,
                "budget": budget,
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
                row[f"{view}_{figure}"] = _mean([r["views"][view][figure] for r in worlds.values()])
        row["frames"] = {view: sum(r["views"][view]["frames"] for r in worlds.values()) for view in VIEWS}
        for figure in ("mask_iou", "fake_m"):
            row[figure] = _mean([r[figure] for r in worlds.values()])
        timed = [r["seconds"] / r["hybrid_s"] for r in worlds.values() if "hybrid_s" in r]
        row |= {"of_hybrid": _mean(timed), "of_hybrid_by_world": timed} if timed else {}
        rows.append(row)
    return rows


def _mean(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def _paired(found: list[dict[str, Any]]) -> dict[str, Any]:
    """PSNR of ours less that of the best other, world by world, with a bootstrap interval over worlds.

    The best other of a view is the one with the highest mean over worlds. ``novel`` is the mean over all
    views but the withheld frames. A world without a frame that counts in a view is left out of it.
    """
    by, result = _seeds(found), {}
    rng = np.random.default_rng(0)
    for view in (*VIEWS, "novel"):
        shown = NOVEL if view == "novel" else (view,)
        common = set.intersection(*(set(w) for w in by.values())) if OURS in by and len(by) > 1 else set()
        worlds = sorted(
            seed for seed in common if all(by[OURS][seed]["views"][v]["psnr"] is not None for v in shown)
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


def markdown(report: dict[str, Any]) -> str:
    """The tables as text."""
    parts = [part for table in report["tables"] for part in _table_lines(table)]
    parts += _captions(report)
    if report.get("mask_iou_by_world"):
        parts.append(_world_lines(report["mask_iou_by_world"]))
    if report.get("renderer"):
        parts.append(_renderer_line(report["renderer"]))
    if report.get("seconds"):
        parts.append(_seconds_lines(report["seconds"]))
    parts += [_consistency_lines(table) for table in report.get("consistency", [])]
    if report.get("recording"):
        parts.append(_recording_lines(report["recording"]))
    if report.get("claims"):
        parts.append(_claim_lines(report["claims"]))
    return "\n".join(parts)


def _consistency_lines(table: dict[str, Any]) -> str:
    head = ["error", "worlds", "clean truth", "corrupted references", "rendered"]
    lines = [[*head, "rendered / references", "excess over the truth"]]
    for row in table["rows"]:
        span = "" if row["low"] is None else f" ({row['low']:.2f} to {row['high']:.2f})"
        values = [number(row[kind], ".3g") for kind in KINDS]
        ratios = [f"{row['ratio']:.2f}{span}", number(row["excess_ratio"], ".2f")]
        lines.append([MEASURES[row["measure"]], str(row["worlds"]), *values, *ratios])
    halved = len(table["at_most_half"])
    sharp = ", ".join(f"{name} {value:.2f}" for name, value in table["sharpness"].items())
    count = (
        f"{halved} of {len(table['rows'])} errors are at most half of the references'. A blurred video "
        f"changes less along its motion; mean change of grey from a pixel to the next: {sharp}.\n"
    )
    ways = "; ".join(
        f"{kind}: {', '.join(f'{way} in {count}' for way, count in table[FOUND_BY][kind].items())}"
        for kind in KINDS
    )
    count += f"Worlds by what found the path, which is compared where it is the same in all three: {ways}.\n"
    title = f"## Consistency of hybrid's drive along the recorded path, {table['geometry']} geometry\n"
    return "\n".join([title, grid(lines), count])


def _claim_lines(rows: list[dict[str, Any]]) -> str:
    verdicts = {True: "yes", False: "no", None: "undecided"}
    lines = [["claim", "asked", "measured", "holds"]]
    lines += [[row["about"], row["asked"], row["measured"], verdicts[row["holds"]]] for row in rows]
    return "## What was asked of hybrid\n\n" + grid(lines)


def _recording_lines(rows: list[dict[str, Any]]) -> str:
    width, height = rows[0]["size"]
    cores = " or ".join(sorted({str(row["threads"]) for row in rows}))
    head = ["representation", "steps", f"s on {cores} threads", "withheld", "moving IoU", "inside hulls, dB"]
    lines = [head]
    for row in sorted(rows, key=lambda r: -r["psnr"]):
        cells = [f"{row['psnr']:.2f} / {row['ssim']:.3f}"]
        cells += [number(row["moving_iou"], ".2f"), number(row["moving_psnr"], ".2f")]
        lines.append([row["representation"], str(row["steps"]), f"{row['seconds']:.1f}", *cells])
    return f"## {CLIP}, {rows[0]['frames']} frames of {width}x{height}\n\n" + grid(lines)


def _world_lines(rows: list[dict[str, Any]]) -> str:
    names = ["-".join(about) for about in WORLD_TABLES]
    lines = [["world", *(f"{references}, {poses} poses" for references, poses in WORLD_TABLES)]]
    lines += [[str(row["seed"]), *(number(row.get(name), ".2f") for name in names)] for row in rows]
    means = [_mean([row.get(name) for row in rows]) for name in names]
    lines.append(["mean", *(number(mean, ".2f") for mean in means)])
    return "## IoU of hybrid's moving mask, world by world\n\n" + grid(lines)


def _renderer_line(found: dict[str, Any]) -> str:
    width, height = found["size"]
    rates = ", ".join(
        f"{name} {found[name]:.1f} (asked: {asked:.0f} on two cores)" for name, asked in ASKED.items()
    )
    return f"Frames a second of the world's renderer at {width}x{height}, all truth included: {rates}.\n"


def _seconds_lines(rows: list[dict[str, Any]]) -> str:
    lines = [["representation", "budget", "mean s", "most s", "limit s", "within"]]
    for row in sorted(rows, key=lambda r: (list(LIMITS_S).index(r["budget"]), r["mean"])):
        limit = LIMITS_S[row["budget"]]
        cells = [f"{row['mean']:.1f}", f"{row['most']:.1f}", f"{limit:.0f}"]
        lines.append([row["representation"], row["budget"], *cells, "yes" if row["most"] <= limit else "no"])
    return "## Seconds of a fit beside what it was to take\n\n" + grid(lines)


def _table_lines(table: dict[str, Any]) -> list[str]:
    parts = [f"## {table['geometry']} geometry, {table['references']} references, {table['budget']}\n"]
    cores = " or ".join(str(count) for count in table["threads"])
    timed = ["s over hybrid's beside it"] if table["budget"] == "equal_time" else []
    head = ["representation", "worlds", "steps", f"s on {cores} threads", *timed, *VIEWS]
    lines = [[*head, "mask IoU", "fake motion, m"]]
    for row in sorted(table["means"], key=lambda r: -r["held_out_psnr"]):
        cells = [
            f"{number(row[f'{view}_psnr'], '.2f')} / {number(row[f'{view}_ssim'], '.3f')}" for view in VIEWS
        ]
        cells += [number(row["mask_iou"], ".2f"), number(row["fake_m"], ".3f")]
        counts = [str(row["worlds"]), f"{row['steps']:.0f}", f"{row['seconds']:.1f}"]
        counts += [_same_time(row)] if timed else []
        lines.append([row["representation"], *counts, *cells])
    parts.append(grid(lines))
    parts += [_frames_line(table["means"][0])] if table["means"] else []
    gains = [
        f"{view} {gain['db']:+.2f} dB ({gain['low']:+.2f} to {gain['high']:+.2f}), {gain['best_other']}"
        for view, gain in table["against_best_other"].items()
    ]
    if gains:
        parts.append("hybrid less the best other: " + "; ".join(gains) + ".\n")
    if table["distances"]:
        if table["distances_compared"]:
            parts.append(_compared_lines(table["distances_compared"]))
        parts.append(_distance_lines(table["distances"]))
    return parts


def _same_time(row: dict[str, Any]) -> str:
    """Seconds over those of hybrid, timed beside it: mean and range over worlds."""
    if "of_hybrid" not in row:
        return "-"
    low, high = min(row["of_hybrid_by_world"]), max(row["of_hybrid_by_world"])
    text = f"{row['of_hybrid']:.2f} ({low:.2f} to {high:.2f})"
    missed = max(abs(low - 1), abs(high - 1)) > SAME_TIME
    return text + (f", off by more than {100 * SAME_TIME:.0f} %" if missed else "")


def _frames_line(row: dict[str, Any]) -> str:
    """Of how many frames the figures of each view are."""
    whole = row["worlds"] * FRAMES
    parts = [f"{view} {count}" for view, count in row["frames"].items()]
    return f"Frames that count, of {whole} a view but the withheld ones: {', '.join(parts)}.\n"


def _captions(report: dict[str, Any]) -> list[str]:
    counts = ", ".join(f"{count} of {name}" for name, count in report.get("components", {}).items())
    if not counts:
        return []
    samples = "; ".join(
        f"{name}: {', '.join(f'{view} {count}' for view, count in views.items())}"
        for name, views in report.get("samples", {}).items()
    )
    return [CAPTION.format(near=NEAR_M, most=COMPONENTS, each=SAMPLES_EACH, counts=counts, samples=samples)]


def _compared_lines(rows: list[dict[str, Any]]) -> str:
    lines = [["network", "hybrid's excess over", "of", "ratio"]]
    lines += [[_network(row), row["against"], row["representation"], _ratio(row)] for row in rows]
    return grid(lines)


def _distance_lines(rows: list[dict[str, Any]]) -> str:
    lines = [
        [
            "network",
            "representation",
            "distance",
            "95 %",
            "of halves",
            "floor",
            "N",
            "hybrid's excess over this one's",
        ]
    ]
    for row in rows:
        span = "-" if row["low"] is None else f"{row['low']:.3g} to {row['high']:.3g}"
        cells = [_network(row), row["representation"], f"{row['distance']:.4g}", span]
        cells += [f"{row['of_halves']:.4g}", f"{row['floor']:.3g}", str(row["samples"]), _ratio(row)]
        lines.append(cells)
    return grid(lines)


def _network(row: dict[str, Any]) -> str:
    return f"{row['network']}, {row['dimensions']} " + ("components" if row["projected"] else "dimensions")


def _ratio(row: dict[str, Any]) -> str:
    if row.get("ours_over_this") is None:
        return "-"
    text = f"{row['ours_over_this']:.2f}"
    if row["ratio_low"] is not None:
        text += f" ({row['ratio_low']:.2f} to {row['ratio_high']:.2f})"
    return text + (", undecided" if row["undecided"] else "")


def number(value: float | None, form: str) -> str:
    """A dash for what was not measured."""
    return "-" if value is None else format(value, form)


def grid(lines: list[list[str]]) -> str:
    """Rows of a table, the first its head."""
    return table_of(lines[0], lines[1:]) + "\n"


def as_text(report: dict[str, Any]) -> str:
    """JSON of a report with six figures a number, small enough to be kept with the code."""
    return json.dumps(_rounded(report), indent=1) + "\n"


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(item) for item in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value
