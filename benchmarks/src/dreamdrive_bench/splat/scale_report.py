"""The figures of ``scale`` as text, as a section of Markdown and as a picture."""

from pathlib import Path

import numpy as np

from dreamdrive.files.output import new_file
from dreamdrive_bench.common.machine import machine_line
from dreamdrive_bench.common.markdown import Layout, columns, laid_out, table

TITLES = {"gaussians": "Against Gaussians", "pixels": "Against pixels", "threads": "Against threads"}
CELLS = {
    "size": lambda row: f"{row['width']}x{row['height']}",
    "Gaussians": lambda row: f"{row['gaussians']:,}",
    "threads": lambda row: str(row["threads"]),
    "forward, ms": lambda row: f"{row['forward_ms']:,.1f}",
    "forward + backward, ms": lambda row: f"{row['forward_backward_ms']:,.1f}",
    "forward, MB": lambda row: f"{row['forward_bytes'] / 1e6:,.0f}",
    "forward + backward, MB": lambda row: f"{row['forward_backward_bytes'] / 1e6:,.0f}",
    "bytes a Gaussian": lambda row: f"{row['forward_backward_bytes'] / row['gaussians']:,.0f}",
}


POWERS = ("forward_ms", "forward_backward_ms", "forward_backward_bytes")


def series(report: dict, name: str) -> list[dict]:
    """Its rows."""
    return [row for row in report["rows"] if row["series"] == name]


def power(sizes: list[float], values: list[float]) -> float:
    """The p of size^p that fits best: 1 is linear."""
    return float(np.polyfit(np.log(sizes), np.log(values), 1)[0])


def growth_line(report: dict) -> str:
    """How figures grow with Gaussians where these, not the pixels, decide."""
    rows = [row for row in series(report, "gaussians") if row["gaussians"] >= 200_000]
    counts = [row["gaussians"] for row in rows]
    powers = [
        f"{what} {power(counts, [row[key] for row in rows]):.2f}"
        for what, key in zip(("forward", "forward + backward", "memory"), POWERS, strict=True)
    ]
    span = f"{counts[0]:,} to {counts[-1]:,}"
    return f"Power of the number of Gaussians that fits best, {span} (1 is linear): {', '.join(powers)}."


def report_with(report: dict, layout: Layout, mark: str) -> str:
    """All tables."""
    lines = [f"{machine_line(report['machine'])}; best times, memory at the peak above the loaded scene."]
    for name, title in TITLES.items():
        lines += ["", mark + title, "", laid_out(CELLS, series(report, name), layout)]
    return "\n".join([*lines, "", growth_line(report)])


def text(report: dict) -> str:
    """For a terminal."""
    return report_with(report, columns, "")


def markdown(report: dict) -> str:
    """For the documentation."""
    return report_with(report, table, "### ")


PANELS = (
    ("gaussians", "Gaussians", lambda row: row["gaussians"], "ms", "milliseconds", 1),
    ("gaussians", "Gaussians", lambda row: row["gaussians"], "bytes", "megabytes above the scene", 1e-6),
    ("pixels", "pixels", lambda row: row["width"] * row["height"], "ms", "milliseconds", 1),
    ("threads", "threads", lambda row: row["threads"], "ms", "milliseconds", 1),
)
RUNS = (("forward", "forward", "tab:blue"), ("forward_backward", "forward + backward", "tab:orange"))


def short(value: float, _: object = None) -> str:
    """A number for an axis: 500, 50k, 2M."""
    for unit, letter in ((1e6, "M"), (1e3, "k")):
        if value >= unit:
            return f"{value / unit:g}{letter}"
    return f"{value:g}"


def label_of(name: str, row: dict) -> str:
    """A point's place on the axis across."""
    return f"{row['width']}x{row['height']}" if name == "pixels" else short(row[name])


def plot(report: dict, path: Path) -> None:
    """Four panels, logarithmic on both axes; dotted lines through the last points are linear."""
    from matplotlib.figure import Figure  # here: only this needs it
    from matplotlib.ticker import LogLocator, NullFormatter

    figure = Figure(figsize=(9, 7), layout="constrained")
    for axes, (name, across, size_of, kind, up, unit) in zip(figure.subplots(2, 2).flat, PANELS, strict=True):
        rows = series(report, name)
        sizes = np.array([size_of(row) for row in rows], float)
        for key, label, colour in RUNS:
            values = unit * np.array([row[f"{key}_{kind}"] for row in rows])
            axes.loglog(sizes, values, "o-", color=colour, label=label)
            if name == "gaussians":
                axes.loglog(sizes, values[-1] * sizes / sizes[-1], ":", color=colour, linewidth=1)
        axes.set_xticks(sizes, [label_of(name, row) for row in rows], fontsize="x-small")
        axes.tick_params(axis="x", which="minor", bottom=False)
        axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.yaxis.set_major_formatter(short)
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.set(xlabel=across, ylabel=up)
        axes.grid(alpha=0.3)
        axes.legend(frameon=False)
    with new_file(path) as partial:
        figure.savefig(partial, dpi=110)
