"""The figures of ``splat`` as text and as a section of Markdown."""

from collections.abc import Sequence

from dreamdrive_bench.common.machine import machine_line
from dreamdrive_bench.common.markdown import Layout, columns, laid_out, table
from dreamdrive_bench.splat import peer


def pair(values: Sequence[float] | None, digits: int = 1, unit: str = "") -> str:
    """Forward / forward + backward."""
    return "-" if values is None else " / ".join(f"{value:,.{digits}f}{unit}" for value in values)


def percent(value: float) -> str:
    """A share."""
    return f"{100 * value:.0f} %"


def error(value: float | None) -> str:
    """A difference from the float64 image."""
    return "-" if value is None else f"{value:.1e}"


def size(row: dict) -> str:
    """Width and height."""
    return f"{row['width']}x{row['height']}"


def shares(row: dict) -> str:
    """Of the roofline, where there is one."""
    return " / ".join(map(percent, row["roofline_share"])) if "roofline_share" in row else "-"


TIMES = {
    "scene": lambda row: row["name"],
    "size": size,
    "Gaussians": lambda row: f"{row['gaussians']:,}",
    "best, ms": lambda row: pair((row["best_forward_ms"], row["best_forward_backward_ms"])),
    "median, ms": lambda row: pair((row["forward_ms"], row["forward_backward_ms"])),
    "of the roofline": shares,
    "largest error": lambda row: error(row["max_abs_error"]),
    "mean": lambda row: error(row["mean_abs_error"]),
}
RATIOS = {
    "scene": lambda row: row["name"],
    "peer, ms": lambda row: pair(row["peer"]["peer_ms"], 0),
    "faster": lambda row: pair(row["peer"]["ratio"], unit="x"),
    "peer scaled, ms": lambda row: pair(row["peer"].get("scaled_peer_ms"), 0),
    "faster than scaled": lambda row: pair(row["peer"].get("scaled_ratio"), unit="x"),
    "goal": lambda row: pair(row["peer"]["goal"], 0, "x"),
}
OPENSPLAT = {
    "scene": lambda row: row["name"],
    "here, ms": lambda row: pair(row["opensplat"]["ms"], 0),
    "we are faster": lambda row: pair(row["opensplat"]["ratio"], unit="x"),
    "largest error": lambda row: error(row["opensplat"]["max_abs_error"]),
    "mean": lambda row: error(row["opensplat"]["mean_abs_error"]),
}
CARRIED = {
    "scene": lambda row: row["name"],
    "November there, ms": lambda row: pair(peer.OLDER_TIMES_MS[row["name"]], 0),
    "here slower by": lambda row: pair(row["opensplat"]["slowdown"], 2, "x"),
    "August by that, ms": lambda row: pair(row["opensplat"]["carried_peer_ms"], 0),
    "we are faster": lambda row: pair(row["opensplat"]["carried_ratio"], unit="x"),
    "goal": lambda row: pair(peer.GOAL, 0, "x"),
}
WORK = {
    "scene": lambda row: row["name"],
    "in view": lambda row: f"{row['work']['in_view']:,}",
    "tile entries": lambda row: f"{row['work']['entries']:,}",
    "reached": lambda row: f"{row['work']['reached']:,}",
    "rows of lanes": lambda row: f"{row['work']['rows']:,}",
    "in boxes": lambda row: f"{row['work']['boxed_rows']:,}",
    "pairs": lambda row: f"{row['work']['pairs']:,}",
    "lanes in use": lambda row: percent(row["work"]["pairs"] / (row["work"]["rows"] * row["work"]["lanes"])),
}


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
    there = peer.PEAKS
    return (
        f"Peaks here, {peaks['threads']} threads at once: {peaks['fma_gflops_per_core']:.0f} GFLOP/s FMA and "
        f"{peaks['exp_g_per_core']:.1f} G exp/s a core, {peaks['copy_gb_per_s']:.0f} GB/s copied by all. "
        f"The peer's: {there['fma_gflops_per_core']:.0f} and {there['exp_g_per_core']:.1f} a core; "
        f"scale {peer.slowdown(peaks):.2f}."
    )


def twin_line(report: dict) -> str:
    """The plain-torch twin."""
    twin = report["twin"]
    compared = f"{pair(twin['peer_ms'])} ms, native {pair(twin['native_ms'], 2)} ms"
    return f"Shown but never counted: {twin['peer']}: {compared}: {pair(twin['ratio'], 0, 'x')}."


def parts(report: dict, layout: Layout) -> list[tuple[str, str]]:
    """Titles and bodies; only what was measured."""
    scenes = report["scenes"]
    having = {name: [row for row in scenes if name in row] for name in ("peer", "work", "opensplat")}
    carried = [row for row in having["opensplat"] if "slowdown" in row["opensplat"]]
    tables = {
        "Times: forward / forward + backward": (TIMES, scenes),
        f"Against {peer.NAME}, measured on {peer.MACHINE}": (RATIOS, having["peer"]),
        "OpenSplat of November 2025 (one thread), measured here": (OPENSPLAT, having["opensplat"]),
        "OpenSplat of August 2026, carried over by that of November 2025": (CARRIED, carried),
        "Work": (WORK, having["work"]),
    }
    found = [(title, laid_out(cells, rows, layout)) for title, (cells, rows) in tables.items()]
    found.append(("Stages of forward + backward", stages(report, layout)))
    return [(title, body) for title, body in found if body]


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
