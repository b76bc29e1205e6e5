"""The figures of splat.py as text and as a section of Markdown."""

from collections.abc import Callable, Sequence

import _peer
from _machine import machine_line
from _markdown import columns, table

Layout = Callable[[Sequence[str], Sequence[Sequence[str]]], str]

NOT_COUNTED = "Shown but never counted"


def pair(values: Sequence[float] | None, digits: int = 1, unit: str = "") -> str:
    """Forward / forward + backward."""
    return "-" if values is None else " / ".join(f"{value:,.{digits}f}{unit}" for value in values)


def percent(value: float) -> str:
    """A share."""
    return f"{100 * value:.0f} %"


def error(value: float | None) -> str:
    """A difference from the float64 image."""
    return "-" if value is None else f"{value:.1e}"


def best(row: dict) -> tuple[float, float]:
    """Our best times."""
    return row["best_forward_ms"], row["best_forward_backward_ms"]


def times(report: dict, layout: Layout) -> str:
    """Our times, how near to the bounds and to the reference."""
    head = [
        "scene",
        "size",
        "Gaussians",
        "best, ms",
        "median, ms",
        "of the roofline",
        "largest error",
        "mean",
    ]
    rows = []
    for row in report["scenes"]:
        shares = row.get("roofline_share")
        rows.append(
            [
                row["name"],
                f"{row['width']}x{row['height']}",
                f"{row['gaussians']:,}",
                pair(best(row)),
                pair((row["forward_ms"], row["forward_backward_ms"])),
                "-" if shares is None else " / ".join(map(percent, shares)),
                error(row["max_abs_error"]),
                error(row["mean_abs_error"]),
            ]
        )
    return layout(head, rows)


def ratios(report: dict, layout: Layout) -> str:
    """How many times faster than the peer."""
    head = ["scene", "peer, ms", "faster", "peer scaled, ms", "faster than scaled", "goal"]
    rows = [
        [
            row["name"],
            pair(row["peer"]["peer_ms"], 0),
            pair(row["peer"]["ratio"], unit="x"),
            pair(row["peer"].get("scaled_peer_ms"), 0),
            pair(row["peer"].get("scaled_ratio"), unit="x"),
            pair(row["peer"]["goal"], 0, "x"),
        ]
        for row in report["scenes"]
        if "peer" in row
    ]
    return layout(head, rows) if rows else ""


def opensplat(report: dict, layout: Layout) -> str:
    """The peer's older version, measured here."""
    rows = [row for row in report["scenes"] if "opensplat" in row]
    head = ["scene", "here, ms", "we are faster", "largest error", "mean"]
    body = [
        [
            row["name"],
            pair(row["opensplat"]["ms"], 0),
            pair(row["opensplat"]["ratio"], unit="x"),
            error(row["opensplat"]["max_abs_error"]),
            error(row["opensplat"]["mean_abs_error"]),
        ]
        for row in rows
    ]
    return layout(head, body) if body else ""


def carried(report: dict, layout: Layout) -> str:
    """The newer version's figures brought here by what the older one takes in both places."""
    rows = [row for row in report["scenes"] if "slowdown" in row.get("opensplat", {})]
    head = [
        "scene",
        "November there, ms",
        "here slower by",
        "August by that, ms",
        "we are faster",
        "goal",
    ]
    body = [
        [
            row["name"],
            pair(_peer.OLDER_TIMES_MS[row["name"]], 0),
            pair(row["opensplat"]["slowdown"], 2, "x"),
            pair(row["opensplat"]["carried_peer_ms"], 0),
            pair(row["opensplat"]["carried_ratio"], unit="x"),
            pair(_peer.GOAL, 0, "x"),
        ]
        for row in rows
    ]
    return layout(head, body) if body else ""


def work(report: dict, layout: Layout) -> str:
    """What there is to do."""
    head = [
        "scene",
        "in view",
        "tile entries",
        "reached",
        "rows of lanes",
        "in boxes",
        "pairs",
        "lanes in use",
    ]
    rows = [
        [
            row["name"],
            *(f"{count[key]:,}" for key in ("in_view", "entries", "reached", "rows", "boxed_rows", "pairs")),
            percent(count["pairs"] / (count["rows"] * count["lanes"])),
        ]
        for row in report["scenes"]
        if (count := row.get("work"))
    ]
    return layout(head, rows) if rows else ""


def stages(report: dict, layout: Layout) -> str:
    """Measured and least time of each stage, and what a run takes beside them."""
    head = ["scene", "stage", "ms", "least, ms", "bound by", "share"]
    body = []
    for row in report["scenes"]:
        for part in row.get("stages", []):
            figures = f"{part['ms']:.2f}", f"{part['floor_ms']:.2f}", part["bound"], percent(part["share"])
            body.append([row["name"], part["stage"], *figures])
        if "stages" in row:
            outside = row["best_forward_backward_ms"] - sum(part["ms"] for part in row["stages"])
            body.append([row["name"], "outside the stages", f"{outside:.2f}", "-", "-", "-"])
    return layout(head, body) if body else ""


def peaks_line(report: dict) -> str:
    """What the roofline stands on."""
    peaks = report["peaks"]
    if peaks is None:
        return "No C++ compiler: peaks, roofline and scaled figures are left out."
    there = _peer.PEAKS
    return (
        f"Peaks here, {peaks['threads']} threads at once: {peaks['fma_gflops_per_core']:.0f} GFLOP/s FMA and "
        f"{peaks['exp_g_per_core']:.1f} G exp/s a core, {peaks['copy_gb_per_s']:.0f} GB/s copied by all. "
        f"The peer's: {there['fma_gflops_per_core']:.0f} and {there['exp_g_per_core']:.1f} a core; "
        f"scale {_peer.slowdown(peaks):.2f}."
    )


def twin_line(report: dict) -> str:
    """The plain-torch twin."""
    twin = report["twin"]
    return (
        f"{NOT_COUNTED}: {twin['peer']}: {pair(twin['peer_ms'])} ms, native {pair(twin['native_ms'], 2)} ms: "
        f"{pair(twin['ratio'], 0, 'x')}."
    )


def parts(report: dict, layout: Layout) -> list[tuple[str, str]]:
    """Titles and bodies; only what was measured."""
    older = "OpenSplat of November 2025 (one thread), measured here"
    all_parts = [
        ("Times: forward / forward + backward", times(report, layout)),
        (f"Against {_peer.NAME}, measured on {_peer.MACHINE}", ratios(report, layout)),
        (older, opensplat(report, layout)),
        ("OpenSplat of August 2026, carried over by that of November 2025", carried(report, layout)),
        ("Work", work(report, layout)),
        ("Stages of forward + backward", stages(report, layout)),
    ]
    return [(title, body) for title, body in all_parts if body]


def text(report: dict) -> str:
    """For a terminal."""
    lines = [machine_line(report["machine"]), peaks_line(report)]
    lines += [f"scene {row['name']}: {row['source']}" for row in report["scenes"]]
    for title, body in parts(report, columns):
        lines += ["", title, body]
    return "\n".join([*lines, "", twin_line(report)])


def markdown(report: dict) -> str:
    """For the documentation."""
    repeat = report["statistic"].removeprefix("median of ")
    lines = [f"{machine_line(report['machine'])}; each figure of {repeat} runs. {peaks_line(report)}"]
    for title, body in parts(report, table):
        lines += ["", f"### {title}", "", body]
    return "\n".join([*lines, "", twin_line(report)])
