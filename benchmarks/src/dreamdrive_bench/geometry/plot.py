"""Memory and seconds of alignments against the number of frames, as a picture."""

from pathlib import Path
from typing import Any

from dreamdrive.files.output import new_file
from dreamdrive_bench.geometry.cases import Row
from dreamdrive_bench.geometry.rows import by_case


def plot(report: dict[str, Any], path: Path) -> None:
    """Logarithmic; a line for each graph and kind of number."""
    from matplotlib.figure import Figure  # here: only this needs it

    rows = [row for row in report["rows"].get("MemoryRun", []) if "failed" not in row]
    rows.sort(key=lambda row: row["frames"])
    figure = Figure(figsize=(9, 4), layout="constrained")
    memory, seconds = figure.subplots(1, 2)
    for (graph, dtype), found in by_case(rows, "graph", "dtype").items():
        _draw_curve(memory, seconds, found, f"{graph}, {dtype}")
    memory.set(ylabel="GB above the libraries", title="dotted: predicted; crosses: refused")
    seconds.set(ylabel="seconds of the processor", title="one thread")
    counts = sorted({row["frames"] for row in rows})
    for axes in (memory, seconds):
        _set_axes(axes, counts)
    with new_file(path) as partial:
        figure.savefig(partial, dpi=100)


def _draw_curve(memory: Any, seconds: Any, rows: list[Row], label: str) -> None:
    """Measured, predicted and refused rows of one curve in axes of memory, the first in those of seconds."""
    ran = [row for row in rows if "refused" not in row]
    refused = [row for row in rows if "refused" in row]
    above = [(row["peak_bytes"] - row["before_bytes"]) / 1e9 for row in ran]
    frames = [row["frames"] for row in ran]
    colour = memory.loglog(frames, above, "o-", label=label)[0].get_color()
    memory.loglog(*_predicted(rows), ":", color=colour)
    memory.loglog(*_predicted(refused), "x", color=colour)
    seconds.loglog(frames, [row["seconds"] for row in ran], "o-", color=colour, label=label)


def _predicted(rows: list[Row]) -> tuple[list[int], list[float]]:
    return [row["frames"] for row in rows], [row["predicted_bytes"] / 1e9 for row in rows]


def _set_axes(axes: Any, frames: list[int]) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axes.set_xticks(frames, [str(count) for count in frames])
    axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set(xlabel="frames")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, fontsize="x-small")
