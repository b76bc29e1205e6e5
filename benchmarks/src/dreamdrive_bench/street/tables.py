"""The figures of the street benchmark as Markdown."""

from typing import Any

from dreamdrive_bench.common.markdown import NONE, grid, laid_out, number, span, table
from dreamdrive_bench.street.case import FRAMES, VIEWS
from dreamdrive_bench.street.consistency import FOUND_BY, KINDS, MEASURES
from dreamdrive_bench.street.distances import COMPONENTS, SAMPLES_EACH
from dreamdrive_bench.street.recording import CLIP
from dreamdrive_bench.street.renderer import ASKED
from dreamdrive_bench.street.summary import LIMITS_S, WORLD_TABLES, mean_of
from dreamdrive_bench.street.views import NEAR_M

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
SAME_TIME = 0.1
"""Share by which equal time may be missed before the table says so."""


def markdown(report: dict[str, Any]) -> str:
    """The tables as text."""
    parts = [part for found in report["tables"] for part in _table_lines(found)]
    parts += _captions(report)
    parts += [show(report[name]) for name, show in SECTIONS.items() if report.get(name)]
    return "\n".join(parts)


def _consistency_lines(tables: list[dict[str, Any]]) -> str:
    return "\n".join(_consistency_table(table) for table in tables)


def _consistency_table(table: dict[str, Any]) -> str:
    head = ["error", "worlds", "clean truth", "corrupted references", "rendered"]
    lines = [[*head, "rendered / references", "excess over the truth"]]
    for row in table["rows"]:
        values = [number(row[kind], ".3g") for kind in KINDS]
        ratios = [number(row["ratio"]) + span(row["low"], row["high"]), number(row["excess_ratio"])]
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
    head = ["representation", "steps", f"s on {cores} threads", "held out", "moving IoU", "inside hulls, dB"]
    lines = [head]
    for row in sorted(rows, key=lambda r: -r["psnr"]):
        cells = [f"{row['psnr']:.2f} / {row['ssim']:.3f}"]
        cells += [number(row["moving_iou"]), number(row["moving_psnr"])]
        lines.append([row["representation"], str(row["steps"]), f"{row['seconds']:.1f}", *cells])
    return f"## {CLIP}, {rows[0]['frames']} frames of {width}x{height}\n\n" + grid(lines)


def _world_lines(rows: list[dict[str, Any]]) -> str:
    names = ["-".join(about) for about in WORLD_TABLES]
    lines = [["world", *(f"{references}, {poses} poses" for references, poses in WORLD_TABLES)]]
    lines += [[str(row["seed"]), *(number(row.get(name)) for name in names)] for row in rows]
    measured = [name for name in names if any(name in row for row in rows)]
    whole = [row for row in rows if all(name in row for name in measured)]
    means = [mean_of([row.get(name) for row in whole]) for name in names]
    lines.append(["mean", *(number(mean) for mean in means)])
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


def _table_lines(found: dict[str, Any]) -> list[str]:
    worlds = ", ".join(map(str, found["worlds"]))
    parts = [
        f"## {found['geometry']} geometry, {found['references']} references, {found['budget']}\n",
        f"Means over these {found['set']} worlds: {worlds}.\n",
    ]
    cores = " or ".join(str(count) for count in found["threads"])
    timed = ["s over hybrid's beside it"] if found["budget"] == "equal_time" else []
    head = ["representation", "worlds", "steps", f"s on {cores} threads", *timed, *VIEWS]
    lines = [[*head, "mask IoU", "fake motion, m"]]
    for row in sorted(found["means"], key=lambda r: -r["held_out_psnr"]):
        cells = [f"{number(row[f'{view}_psnr'])} / {number(row[f'{view}_ssim'], '.3f')}" for view in VIEWS]
        cells += [number(row["mask_iou"]), number(row["fake_m"], ".3f")]
        counts = [str(row["worlds"]), f"{row['steps']:.0f}", f"{row['seconds']:.1f}"]
        counts += [_same_time(row)] if timed else []
        lines.append([row["representation"], *counts, *cells])
    parts.append(grid(lines))
    parts += [_frames_line(found["means"][0])] if found["means"] else []
    gains = [
        f"{view} {gain['db']:+.2f} dB{span(gain['low'], gain['high'], '+.2f')}, {gain['best_other']}"
        for view, gain in found["against_best_other"].items()
    ]
    if gains:
        parts.append("hybrid less the best other: " + "; ".join(gains) + ".\n")
    if found["distances"]:
        if found["distances_compared"]:
            parts.append(laid_out(COMPARED, found["distances_compared"], table) + "\n")
        parts.append(laid_out(DISTANCES, found["distances"], table) + "\n")
    return parts


def _same_time(row: dict[str, Any]) -> str:
    """Seconds over those of hybrid, timed beside it: mean and range over worlds."""
    if "of_hybrid" not in row:
        return NONE
    low, high = min(row["of_hybrid_by_world"]), max(row["of_hybrid_by_world"])
    text = number(row["of_hybrid"]) + span(low, high)
    missed = max(abs(low - 1), abs(high - 1)) > SAME_TIME
    return text + (f", off by more than {100 * SAME_TIME:.0f} %" if missed else "")


def _frames_line(row: dict[str, Any]) -> str:
    """Of how many frames the figures of each view are."""
    whole = row["worlds"] * FRAMES
    parts = [f"{view} {count}" for view, count in row["frames"].items()]
    return f"Frames that count, of {whole} a view but the held-out ones: {', '.join(parts)}.\n"


def _captions(report: dict[str, Any]) -> list[str]:
    counts = ", ".join(f"{count} of {name}" for name, count in report.get("components", {}).items())
    if not counts:
        return []
    samples = "; ".join(
        f"{name}: {', '.join(f'{view} {count}' for view, count in views.items())}"
        for name, views in report.get("samples", {}).items()
    )
    return [CAPTION.format(near=NEAR_M, most=COMPONENTS, each=SAMPLES_EACH, counts=counts, samples=samples)]


def _network(row: dict[str, Any]) -> str:
    return f"{row['network']}, {row['dimensions']} " + ("components" if row["projected"] else "dimensions")


def _ratio(row: dict[str, Any]) -> str:
    if row.get("ours_over_this") is None:
        return NONE
    text = number(row["ours_over_this"]) + span(row["ratio_low"], row["ratio_high"])
    return text + (", undecided" if row["undecided"] else "")


COMPARED = {
    "network": _network,
    "hybrid's excess over": lambda row: row["against"],
    "of": lambda row: row["representation"],
    "ratio": _ratio,
}
DISTANCES = {
    "network": _network,
    "representation": lambda row: row["representation"],
    "distance": lambda row: f"{row['distance']:.4g}",
    "95 %": lambda row: span(row["low"], row["high"], ".3g").strip(" ()") or NONE,
    "of halves": lambda row: f"{row['of_halves']:.4g}",
    "floor": lambda row: f"{row['floor']:.3g}",
    "N": lambda row: str(row["samples"]),
    "hybrid's excess over this one's": _ratio,
}
SECTIONS = {
    "mask_iou_by_world": _world_lines,
    "renderer": _renderer_line,
    "seconds": _seconds_lines,
    "consistency": _consistency_lines,
    "recording": _recording_lines,
    "claims": _claim_lines,
}
"""What follows the tables, by its name in the report."""
