"""The figures of geometry.py as Markdown and as a picture."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from _geometry_alignment import PAPER, STEPS
from _markdown import table

Row = dict[str, Any]
PATH_TARGET, FOCAL_TARGET = 1.0, 3.0
"""Per cent of the path and of the focal length by which an alignment may be off."""
NONE = "-"


def markdown(report: dict[str, Any]) -> str:
    """All tables; those without a row are left out."""
    rows = report["rows"]
    aligned = rows.get("Alignment", [])
    machine = report["machine"]
    parts = [
        f"{machine['processor']}, torch {machine['torch']}, {machine['date']}; seconds of the processor on "
        f"one thread. {report['measured']} of {report['wanted']} measurements are made; a dash is "
        "one that is not, or has no meaning.",
        _section("Ways of getting geometry", backends_table(rows.get("BackendRun", []))),
        _section("Alignment of noisy pairs", accuracy_table(aligned)),
        _section("Seconds to the same loss", speed_table(aligned)),
        *(_section(title, text) for title, text in graph_tables(aligned)),
        _section("Memory and seconds against frames", memory_table(rows.get("MemoryRun", []))),
        _section("A recorded clip with true cameras and without", scenes_table(rows.get("SceneRun", []))),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _section(title: str, text: str | None) -> str | None:
    return None if text is None else f"## {title}\n\n{text}"


def number(value: float | None, digits: int = 2) -> str:
    """A cell; a dash for what has no meaning or was not measured."""
    return NONE if value is None else f"{value:.{digits}f}"


def _yes(value: bool | None) -> str:
    return NONE if value is None else "yes" if value else "no"


def backends_table(rows: Sequence[Row]) -> str | None:
    """One row for each clip and way."""
    if not rows:
        return None
    head = ["clip", "way", "calibrated", "frames", "ATE, m", "ATE, %", "RPE, %", "focal, %", "AbsRel"]
    head += ["AbsRel, median scale", "< 1.25, median scale", "coverage, %", "seconds"]
    return table(head, [_backend_cells(row) for row in rows])


def _backend_cells(row: Row) -> list[str]:
    path, pinhole = row["path"] or {}, row["pinhole"] or {}
    groups = row["depth"]["groups"] if row["depth"] else [{}]
    depth = groups[0]
    as_is, median = depth.get("as_is") or {}, depth.get("median_scale") or {}
    coverage = depth.get("coverage")
    return [
        row["clip"],
        row["way"],
        _yes(row["calibrated"]),
        f"{row['frames']} of {row['size']}",
        number(path.get("ate_m"), 3),
        number(path.get("ate_percent")),
        number(path.get("translation_percent")),
        number(pinhole.get("focal_percent"), 1),
        number(as_is.get("abs_rel"), 3),
        number(median.get("abs_rel"), 3),
        number(median.get("delta_1"), 3),
        number(coverage and 100 * coverage, 1),
        number(row["seconds"], 0),
    ]


def key_of(row: Row, *names: str) -> tuple[Any, ...]:
    """What tells one case from others, in these respects."""
    values = (row[name] for name in names)
    return tuple(tuple(sorted(v.items())) if isinstance(v, dict) else _fixed(v) for v in values)


def _fixed(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def by_case(rows: Iterable[Row], *names: str) -> dict[tuple[Any, ...], list[Row]]:
    """Rows that agree in these respects, in their order."""
    found: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        found.setdefault(key_of(row, *names), []).append(row)
    return found


def _methods(rows: Sequence[Row]) -> dict[str, Row]:
    return {row["method"]: row for row in rows}


def misses(row: Row) -> list[str]:
    """Which targets an alignment misses."""
    far = row["path_percent"] is not None and row["path_percent"] > PATH_TARGET
    return ["path"] * far + ["focal"] * (row["focal_percent"] > FOCAL_TARGET)


def accuracy_table(rows: Sequence[Row]) -> str | None:
    """Ours beside the authors' program; cases with several graphs belong to the choice of these."""
    graphs = {key for key, found in _graph_groups(rows).items() if len(found) > 1}
    wanted = [row for row in rows if key_of(row, *_WORLD) not in graphs]
    cases = by_case(wanted, "world", "frames", "size", "graph", "noise")
    cells = [_accuracy_cells(_methods(found)) for found in cases.values() if "ours" in _methods(found)]
    if not cells:
        return None
    head = ["world", "movers", "path, %", "focal, %", "AbsRel", "path observed", "focal observed", "misses"]
    head += ["path, %: authors' loss", "focal, %", "path, %: authors' program", "focal, %", "AbsRel"]
    return table(head, cells)


def _accuracy_cells(methods: dict[str, Row]) -> list[str]:
    ours = methods["ours"]
    paper, upstream = methods.get(PAPER, {}), methods.get("upstream", {})
    if upstream.get("steps") != STEPS:
        upstream = {}
    return [
        ours["world"],
        "mistaken" if ours["noise"]["mistaken"] else "where they are",
        number(ours["path_percent"]),
        number(ours["focal_percent"]),
        number(ours["abs_rel"], 3),
        _yes(ours["path_observed"]),
        _yes(ours["focal_observed"]),
        ", ".join(misses(ours)) or "none",
        number(paper.get("path_percent")),
        number(paper.get("focal_percent")),
        number(upstream.get("path_percent")),
        number(upstream.get("focal_percent")),
        number(upstream.get("abs_rel"), 3),
    ]


def speed_table(rows: Sequence[Row]) -> str | None:
    """Our solver with the authors' loss and freedom against Adam, of which few steps tell the seconds."""
    cells = []
    smallest_first = sorted(rows, key=lambda row: row["size"])
    for found in by_case(smallest_first, "world", "frames", "size", "graph", "noise").values():
        methods = _methods(found)
        if PAPER in methods and "upstream" in methods:
            cells.append(_speed_cells(methods[PAPER], methods["upstream"]))
    if not cells:
        return None
    head = ["world", "frames", "size", "pairs", "ours, s", "loss", "Adam, s", "loss", "times faster"]
    return table(head, cells)


def _speed_cells(ours: Row, adam: Row) -> list[str]:
    whole = adam["steps"] == STEPS
    return [
        ours["world"],
        str(ours["frames"]),
        "x".join(map(str, ours["size"])),
        str(ours["edges"]),
        number(ours["seconds"], 1),
        number(ours["loss"], 4),
        number(adam["seconds"], 0) + ("" if whole else f" (from {adam['steps']} steps)"),
        number(adam["loss"], 4) if whole else NONE,
        number(adam["seconds"] / ours["seconds"], 1),
    ]


_WORLD = ("world", "frames", "size", "noise", "method")


def _graph_groups(rows: Iterable[Row]) -> dict[tuple[Any, ...], list[Row]]:
    return by_case((row for row in rows if row["method"] == "ours"), *_WORLD)


def graph_tables(rows: Sequence[Row]) -> list[tuple[str, str]]:
    """A title and a table for each length of clip and kind of noise: all worlds beside each other."""
    compared = [row for found in _graph_groups(rows).values() if len(found) > 1 for row in found]
    tables = []
    for found in by_case(compared, "frames", "noise").values():
        first = found[0]
        unseen = first["noise"]["unseen"]
        worse = f", {unseen:g} times the noise where the first camera does not look" if unseen != 1 else ""
        tables.append((f"Which pairs: {first['frames']} frames{worse}", _graph_table(found)))
    return tables


def _graph_table(rows: Sequence[Row]) -> str:
    worlds = list(dict.fromkeys(row["world"] for row in rows))
    head = ["pairs", "edges"]
    for world in worlds:
        head += [f"{world}: path, %", "focal, %", "seconds"]
    cells = []
    for graph, found in by_case(rows, "graph").items():
        of = {row["world"]: row for row in found}
        line = [graph[0], str(found[0]["edges"])]
        for world in worlds:
            row = of.get(world, {})
            line += [number(row.get(name)) for name in ("path_percent", "focal_percent")]
            line.append(number(row.get("seconds"), 0))
        cells.append(line)
    return table(head, cells)


def memory_table(rows: Sequence[Row]) -> str | None:
    """Peaks are of the whole process, with Python and its libraries."""
    if not rows:
        return None
    head = ["frames", "size", "pairs", "edges", "numbers", "predicted, GB", "peak, GB", "above libraries, GB"]
    return table([*head, "seconds"], [_memory_cells(row) for row in sorted(rows, key=_size)])


def _size(row: Row) -> tuple[int, int, str]:
    return row["frames"], row["edges"], row["dtype"]


def _memory_cells(row: Row) -> list[str]:
    size = "x".join(map(str, row["size"]))
    first = [str(row["frames"]), size, row["graph"], str(row["edges"]), row["dtype"]]
    first.append(number(row["predicted_bytes"] / 1e9))
    if "refused" in row:
        return [*first, f"refused: above {row['memory_gb']:g} GB", NONE, NONE]
    above = row["peak_bytes"] - row["before_bytes"]
    return [*first, number(row["peak_bytes"] / 1e9), number(above / 1e9), number(row["seconds"], 0)]


def scenes_table(rows: Sequence[Row]) -> str | None:
    """Held-out quality."""
    if not rows:
        return None
    head = ["run of clips.py", "PSNR, dB", "SSIM", "moving PSNR, dB", "moving IoU", "focal, px", "path, %"]
    return table(head, [_scene_cells(row) for row in rows])


def _scene_cells(row: Row) -> list[str]:
    held_out, path = row["held_out"], row.get("path_error")
    return [
        row["name"],
        number(held_out["psnr"]),
        number(held_out["ssim"], 3),
        number(row.get("moving_psnr")),
        number(row.get("moving_iou"), 3),
        number(row["focal"]["px"], 1),
        number(path and 100 * path),
    ]


def plot(report: dict[str, Any], path: Path) -> None:
    """Memory and seconds against frames, logarithmic; a line for each graph and kind of number."""
    from matplotlib.figure import Figure  # here: only this needs it
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    rows = sorted(report["rows"].get("MemoryRun", []), key=_size)
    figure = Figure(figsize=(9, 4), layout="constrained")
    memory, seconds = figure.subplots(1, 2)
    for (graph, dtype), found in by_case(rows, "graph", "dtype").items():
        ran = [row for row in found if "refused" not in row]
        frames = [row["frames"] for row in ran]
        label = f"{graph}, {dtype}"
        above = [(row["peak_bytes"] - row["before_bytes"]) / 1e9 for row in ran]
        colour = memory.loglog(frames, above, "o-", label=label)[0].get_color()
        told = [(row["frames"], row["predicted_bytes"] / 1e9) for row in found]
        memory.loglog(*zip(*told, strict=True), ":", color=colour)
        refused = [row for row in found if "refused" in row]
        memory.loglog(
            [row["frames"] for row in refused],
            [row["predicted_bytes"] / 1e9 for row in refused],
            "x",
            color=colour,
        )
        seconds.loglog(frames, [row["seconds"] for row in ran], "o-", color=colour, label=label)
    memory.set(ylabel="GB above the libraries", title="dotted: predicted; crosses: refused")
    seconds.set(ylabel="seconds of the processor", title="one thread")
    counts = sorted({row["frames"] for row in rows})
    for axes in (memory, seconds):
        axes.set_xticks(counts, [str(count) for count in counts])
        axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.set(xlabel="frames")
        axes.grid(alpha=0.3)
        axes.legend(frameon=False, fontsize="x-small")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100)
