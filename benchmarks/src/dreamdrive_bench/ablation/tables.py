"""Means over worlds of each variant, and what it changes against all parts."""

from typing import Any

import numpy as np

from dreamdrive_bench.ablation.variants import VARIANTS
from dreamdrive_bench.common.markdown import grid, number
from dreamdrive_bench.common.worlds import common_worlds

FIGURES = {
    "held_out_psnr": ("held out, dB", ".2f"),
    "novel_psnr": ("novel, dB", ".2f"),
    "mask_iou": ("mask IoU", ".3f"),
    "mask_precision": ("mask precision", ".2f"),
    "label_iou": ("label IoU", ".3f"),
    "fake_m": ("fake motion, m", ".4f"),
}


def tables(records: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Means over the worlds that all variants have, and what each changes against all parts."""
    found: list[dict[str, Any]] = []
    for references in dict.fromkeys(record["references"] for record in records):
        here = [record for record in records if record["references"] == references]
        worlds = common_worlds(here, "variant")
        by_variant: dict[str, dict[int, dict[str, Any]]] = {}
        for record in here:
            if record["seed"] in worlds:
                by_variant.setdefault(record["variant"], {})[record["seed"]] = record
        whole = by_variant.get("hybrid", {})
        rows = [_row(variant, rows, whole) for variant, rows in by_variant.items()]
        found.append({"references": references, "worlds": worlds, "rows": rows})
    return found


def _row(variant: str, found: dict[int, dict[str, Any]], whole: dict[int, dict[str, Any]]) -> dict[str, Any]:
    row: dict[str, Any] = {"variant": variant}
    for figure in FIGURES:
        known = [record[figure] for record in found.values() if record[figure] is not None]
        pairs = [(record[figure], whole[seed][figure]) for seed, record in found.items() if seed in whole]
        changes = [a - b for a, b in pairs if a is not None and b is not None]
        row[figure] = float(np.mean(known)) if known else None
        row[f"{figure}_change"] = float(np.mean(changes)) if changes else None
        row[f"{figure}_range"] = [min(changes), max(changes)] if changes else None
    return row


def markdown(found: list[dict[str, Any]]) -> str:
    """The tables as text; in brackets the change against all parts, its mean and its range over worlds."""
    parts: list[str] = []
    for table in found:
        lines = [["variant", "", *(head for head, _ in FIGURES.values())]]
        lines += [
            [row["variant"], VARIANTS[row["variant"]].about, *(_cell(row, figure) for figure in FIGURES)]
            for row in table["rows"]
        ]
        worlds = ", ".join(map(str, table["worlds"]))
        parts += [f"## {table['references']} references, true poses, worlds {worlds}\n", grid(lines)]
    return "\n".join(parts)


def _cell(row: dict[str, Any], figure: str) -> str:
    form = FIGURES[figure][1]
    mean = number(row[figure], form)
    if row[f"{figure}_range"] is None or row["variant"] == "hybrid":
        return mean
    low, high = (format(value, "+" + form) for value in row[f"{figure}_range"])
    return f"{mean} ({number(row[f'{figure}_change'], '+' + form)}; {low} to {high})"
