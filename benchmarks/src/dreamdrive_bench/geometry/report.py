"""The figures of ``geometry`` as Markdown."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from dreamdrive_bench.common.markdown import NONE, number, table
from dreamdrive_bench.geometry.alignment_tables import accuracy_table, graph_tables, speed_table
from dreamdrive_bench.geometry.cases import Measurement, Row, load
from dreamdrive_bench.geometry.rows import FAILED, by_case, figure, yes

BACKENDS_NOTE = """\
`files` is told the true cameras: its path and its focal length are right by construction, as is the focal
length of any calibrated clip. Its depth is found. Seconds are those of both threads together."""
MEMORY_NOTE = """\
The peak is that of the whole process, with Python and its libraries. What is refused was predicted to take
more than that row allows."""
SCENES_NOTE = """\
All frames but every eighth are fitted, at the quality `draft`; `refined` lets the given cameras tell only how
long the path is."""


def report_of(wanted: Sequence[Measurement], runs: Path) -> dict[str, Any]:
    """Rows of what is there, by kind; those that failed are among them."""
    rows: dict[str, list[Row]] = {}
    for job in wanted:
        if (row := load(job, runs)) is not None:
            rows.setdefault(type(job).__name__, []).append(row)
    found = [row for each in rows.values() for row in each]
    failed = sum("failed" in row for row in found)
    return {"wanted": len(wanted), "measured": len(found) - failed, "failed": failed, "rows": rows}


def markdown(report: dict[str, Any]) -> str:
    """All tables; those without a row are left out."""
    rows = report["rows"]
    aligned = rows.get("Alignment", [])
    every = [row for each in rows.values() for row in each]
    parts = [
        f"{origin(every)} {report['measured']} of {report['wanted']} measurements are made, "
        f"{report['failed']} failed; a dash is one that is not made, or has no meaning. Seconds are those of "
        "the processor; an alignment has one thread.",
        _section("Ways of getting geometry", backends_table(rows.get("BackendRun", []))),
        _section("Alignment of noisy pairs", accuracy_table(aligned)),
        _section("Seconds to the same loss", speed_table(aligned)),
        *(_section(title, text) for title, text in graph_tables(aligned)),
        _section("Memory and seconds against frames", memory_table(rows.get("MemoryRun", []))),
        _section("A recorded clip with true cameras and without", scenes_table(rows.get("SceneRun", []))),
        _section("What failed", failures(every)),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _section(title: str, text: str | None) -> str | None:
    return None if text is None else f"## {title}\n\n{text}"


def origin(rows: Sequence[Row]) -> str:
    """On what, by which code and when the rows were measured; of several machines or codes how many each."""
    made = by_case([row["measured_on"] for row in rows], "processor", "torch", "commit")
    told = []
    for (processor, torch, commit), found in made.items():
        dates = sorted({one["date"] for one in found})
        when = dates[0] if len(dates) == 1 else f"{dates[0]} to {dates[-1]}"
        told.append(f"{processor}, torch {torch}, commit {commit}, {when}")
    if len(made) < 2:
        return f"{told[0]}." if told else "Nothing is measured."
    counts = [f"{len(found)} on {one}" for one, found in zip(told, made.values(), strict=True)]
    return f"Not all of one machine and code: {'; '.join(counts)}."


def failures(rows: Sequence[Row]) -> str | None:
    """What was tried and raised, and the first line of the reason."""
    lines = [(row["measurement"], row["failed"].splitlines()[0]) for row in rows if "failed" in row]
    return "\n".join(f"- `{name}`: {why}" for name, why in lines) or None


def backends_table(rows: Sequence[Row]) -> str | None:
    """One row for each clip and way."""
    if not rows:
        return None
    head = ["clip", "way", "calibrated", "frames", "ATE, m", "ATE, %", "RPE, %", "focal, %", "AbsRel"]
    head += ["AbsRel, median scale", "< 1.25, median scale", "coverage, %", "seconds"]
    return f"{table(head, [_backend_cells(row) for row in rows])}\n\n{BACKENDS_NOTE}"


def _backend_cells(row: Row) -> list[str]:
    if "failed" in row:
        return [row["clip"], row["way"], FAILED, *[NONE] * 10]
    path, pinhole = row["path"] or {}, row["pinhole"] or {}
    depth = row["depth"]["groups"][0] if row["depth"] else {}
    as_is, median = depth.get("as_is") or {}, depth.get("median_scale") or {}
    coverage = depth.get("coverage")
    return [
        row["clip"],
        row["way"],
        yes(row, "calibrated"),
        f"{row['frames']} of {row['size']}",
        figure(path, "ate_m", 3),
        figure(path, "ate_percent"),
        figure(path, "translation_percent"),
        figure(pinhole, "focal_percent", 1),
        figure(as_is, "abs_rel", 3),
        figure(median, "abs_rel", 3),
        figure(median, "delta_1", 3),
        number(coverage and 100 * coverage, ".1f"),
        figure(row, "seconds", 0),
    ]


def memory_table(rows: Sequence[Row]) -> str | None:
    """Curve by curve: the rows of a graph and a kind of number follow each other."""
    if not rows:
        return None
    head = ["frames", "size", "pairs", "edges", "numbers", "predicted, GB", "peak, GB", "above libraries, GB"]
    curves = by_case(sorted(rows, key=lambda row: row["frames"]), "size", "graph", "dtype").values()
    cells = [_memory_cells(row) for found in sorted(curves, key=len, reverse=True) for row in found]
    return f"{table([*head, 'seconds'], cells)}\n\n{MEMORY_NOTE}"


def _memory_cells(row: Row) -> list[str]:
    size = "x".join(map(str, row["size"]))
    first = [str(row["frames"]), size, row["graph"], figure(row, "edges", 0), row["dtype"]]
    if "failed" in row:
        return [*first, *[FAILED] * 4]
    first.append(number(row["predicted_bytes"] / 1e9))
    if "refused" in row:
        return [*first, f"refused: above {row['memory_gb']:g} GB", NONE, NONE]
    above = row["peak_bytes"] - row["before_bytes"]
    return [*first, number(row["peak_bytes"] / 1e9), number(above / 1e9), figure(row, "seconds", 0)]


def scenes_table(rows: Sequence[Row]) -> str | None:
    """Held-out quality."""
    if not rows:
        return None
    head = ["run of clips.py", "PSNR, dB", "SSIM", "moving PSNR, dB", "moving IoU", "focal, px", "path, %"]
    return f"{table(head, [_scene_cells(row) for row in rows])}\n\n{SCENES_NOTE}"


def _scene_cells(row: Row) -> list[str]:
    if "failed" in row:
        return [row["clip"], FAILED, *[NONE] * 5]
    path = row.get("path_error")
    return [
        row["clip"],
        figure(row["held_out"], "psnr"),
        figure(row["held_out"], "ssim", 3),
        figure(row, "moving_psnr"),
        figure(row, "moving_iou", 3),
        figure(row["focal"], "px", 1),
        number(path and 100 * path),
    ]
