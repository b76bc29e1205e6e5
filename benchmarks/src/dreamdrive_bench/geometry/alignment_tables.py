"""Tables of the alignments that ``geometry`` measures: errors, seconds to the same loss, choice of pairs."""

from collections.abc import Iterable, Sequence
from statistics import mean
from typing import Any

from dreamdrive_bench.common.markdown import NONE, number, span, table
from dreamdrive_bench.geometry.alignment import GRAPH, GRAPHS, PAPER, STEPS
from dreamdrive_bench.geometry.cases import Row
from dreamdrive_bench.geometry.rows import FAILED, by_case, figure, yes

PATH_TARGET, FOCAL_TARGET = 1.0, 3.0
"""Per cent of the path and of the focal length by which an alignment may be off."""

ACCURACY_NOTE = """\
Path and RPE are after the best similarity, in per cent of the length of the path and of stretches of it. Each
row is of one draw of the noise, and of `align` alone: `generate` finds what moves with the depth and the path
of a first alignment, and aligns a second time without."""
SPEED_NOTE = """\
A ratio is given where both losses are known and ours ends at most as high. It is of the authors' loss with a
focal length for each image. Our default has another loss and one focal length: of it the seconds alone can be
compared."""
GRAPHS_NOTE = """\
A mean with its range in brackets is of several draws of the noise; the other figures are of one draw."""


def misses(row: Row) -> list[str]:
    """Which targets an alignment misses, and whether it says so."""
    far = row["path_percent"] is not None and not row["path_percent"] <= PATH_TARGET
    focal = "focal" if row.get("focal_observed", True) else "focal, as it says"
    return ["path"] * far + [focal] * (not row["focal_percent"] <= FOCAL_TARGET)


def noise_words(noise: Row) -> str:
    """What is wrong with the pairs beside what always is."""
    if noise["common_focal"]:
        long, across = 100 * noise["common_focal"], 100 * noise["place"]
        return f"focal {long:g} % long in all pairs, {across:g} % across rays"
    return "movers mistaken" if noise["mistaken"] else "movers where they are"


def _methods(rows: Sequence[Row]) -> dict[str, Row]:
    return {row["method"]: row for row in rows}


def accuracy_table(rows: Sequence[Row]) -> str | None:
    """Ours beside the authors' program; clips of which pairs are chosen have tables of their own."""
    wanted = [row for row in rows if row["graph"] == GRAPH and row["frames"] not in GRAPHS]
    cases = by_case(wanted, "world", "frames", "size", "noise").values()
    cells = [_accuracy_cells(_methods(found)) for found in cases if "ours" in _methods(found)]
    if not cells:
        return None
    ours = ["path, %", "RPE, %", "focal, %", "AbsRel", "< 1.25", "path observed", "focal observed", "misses"]
    program = ["path, %: authors' program", "RPE, %", "focal, %", "AbsRel", "< 1.25"]
    head = ["world", "frames", "noise", *ours, "path, %: authors' loss", "focal, %", *program]
    return f"{table(head, cells)}\n\n{ACCURACY_NOTE}"


def _accuracy_cells(methods: dict[str, Row]) -> list[str]:
    ours = methods["ours"]
    paper, upstream = methods.get(PAPER, {}), methods.get("upstream", {})
    if upstream.get("steps") != STEPS:
        upstream = {}
    return [
        ours["world"],
        f"{ours['frames']} of {_size(ours)}",
        noise_words(ours["noise"]),
        *_errors(ours),
        yes(ours, "path_observed"),
        yes(ours, "focal_observed"),
        FAILED if "failed" in ours else ", ".join(misses(ours)) or "none",
        figure(paper, "path_percent"),
        figure(paper, "focal_percent"),
        *_errors(upstream),
    ]


def _errors(row: Row) -> list[str]:
    percent = [figure(row, name) for name in ("path_percent", "rpe_percent", "focal_percent")]
    return [*percent, figure(row, "abs_rel", 3), figure(row, "delta_1", 3)]


def _size(row: Row) -> str:
    return "x".join(map(str, row["size"]))


def speed_table(rows: Sequence[Row]) -> str | None:
    """Our solver with the authors' loss and freedom against Adam, of which few steps tell the seconds."""
    cells = []
    wanted = sorted((row for row in rows if row["graph"] == GRAPH), key=lambda row: row["size"])
    for found in by_case(wanted, "world", "frames", "size", "noise").values():
        methods = _methods(found)
        if PAPER in methods and "upstream" in methods:
            cells.append(_speed_cells(methods[PAPER], methods["upstream"], methods.get("ours", {})))
    if not cells:
        return None
    head = ["world", "noise", "frames", "size", "pairs", "ours, authors' loss, s", "loss"]
    head += ["Adam, authors' loss, s", "loss", "times faster", "our default, s"]
    return f"{table(head, cells)}\n\n{SPEED_NOTE}"


def _speed_cells(ours: Row, adam: Row, default: Row) -> list[str]:
    whole = adam["steps"] == STEPS
    known = whole and "failed" not in ours and "failed" not in adam and ours["loss"] <= adam["loss"]
    return [
        ours["world"],
        noise_words(ours["noise"]),
        str(ours["frames"]),
        _size(ours),
        figure(ours, "edges", 0),
        figure(ours, "seconds", 1),
        figure(ours, "loss", 4),
        figure(adam, "seconds", 0) + ("" if whole else f" (from {adam['steps']} steps)"),
        figure(adam, "loss", 4) if whole else "not known",
        number(adam["seconds"] / ours["seconds"], ".1f") if known else NONE,
        figure(default, "seconds", 1),
    ]


def graph_tables(rows: Sequence[Row]) -> list[tuple[str, str]]:
    """A title and a table for each length of clip and kind of noise: all worlds beside each other."""
    tables = []
    for found in by_case(_compared(rows), "frames", "size", "noise").values():
        first = found[0]
        unseen = first["noise"]["unseen"]
        worse = f", {unseen:g} times the noise where the first camera does not look" if unseen != 1 else ""
        title = f"Which pairs: {first['frames']} frames{worse}"
        tables.append((title, f"{_graph_table(found)}\n\n{GRAPHS_NOTE}"))
    return tables


def _compared(rows: Iterable[Row]) -> list[Row]:
    """Those of ours of which other pairs of the same clip were aligned as well."""
    ours = (row for row in rows if row["method"] == "ours")
    groups = by_case(ours, "world", "frames", "size", "noise").values()
    return [row for found in groups if len(by_case(found, "graph")) > 1 for row in found]


def _graph_table(rows: Sequence[Row]) -> str:
    worlds = list(dict.fromkeys(row["world"] for row in rows))
    head = ["pairs", "edges"]
    for world in worlds:
        head += [f"{world}: path, %", "focal, %", "seconds"]
    cells = []
    for (graph,), found in by_case(rows, "graph").items():
        line = [graph, figure(found[0], "edges", 0)]
        for world in worlds:
            draws = [row for row in found if row["world"] == world]
            line += [of_draws(draws, name) for name in ("path_percent", "focal_percent")]
            line.append(of_draws(draws, "seconds", 0))
        cells.append(line)
    return table(head, cells)


def of_draws(rows: Sequence[Row], name: str, digits: int = 2) -> str:
    """The mean and, of several, the range."""
    if any("failed" in row for row in rows):
        return FAILED
    form, values = f".{digits}f", list[Any](row[name] for row in rows if row[name] is not None)
    if len(values) < 2:
        return number(values[0] if values else None, form)
    return number(mean(values), form) + span(min(values), max(values), form)
