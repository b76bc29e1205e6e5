"""The sections of README.md and docs/figures.md that ``readme`` writes, from the rows of its report."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from dreamdrive_bench.common.markdown import NONE, number, table
from dreamdrive_bench.common.worlds import DEVELOPMENT, TEST, common_worlds, set_of
from dreamdrive_bench.street.methods import FULL_SIZE, OURS, REPRESENTATIONS

Rows = Sequence[dict[str, Any]]
MAIN_CLIP = {
    "pandaset": "`standard`",
    "pandaset-draft": "`draft`",
    "pandaset-static": "the same Gaussians, all static",
    "pandaset-deformable": "the same, all through the deformation network",
}
"""Runs of the clip of the picture, and what the tables call them."""
OTHER_CLIPS = {
    "kitti06": "KITTI 06, tree-lined street",
    "kitti07": "KITTI 07, hard left turn",
    "kitti07-intrinsics": "KITTI 07, intrinsics given",
    "kitti04": "KITTI 04, behind a van",
    "udacity": "Udacity motorway, two cars",
    "udacity-lens": "the same, lens given",
    "pandaset-standing": "PandaSet, standing",
}
FIGURES: dict[str, tuple[Callable[[dict[str, Any]], float | None], str]] = {
    "moving mask, IoU": (lambda row: row["mask_iou"], ".2f"),
    "held out, dB": (lambda row: row["views"]["held_out"]["psnr"], ".2f"),
    "2 m aside, dB": (lambda row: row["views"]["shift_2"]["psnr"], ".2f"),
}
"""Of a fit of a drawn street, by the heads of their columns."""


def sections(report: dict[str, Any]) -> dict[str, str]:
    """By the names of their marks; one that lacks its rows is left out."""
    streets, clips = report["streets"], {row["name"]: row for row in report["clips"]}
    estimated = [row for row in streets if row["geometry"] == "estimated"]
    paper = [row for row in streets if row["geometry"] == "true"]
    found = {"drop": drop_table(estimated), "whole-paper": methods_table(paper, (OURS, *FULL_SIZE))}
    found["figures"] = "\n\n".join(filter(None, [_drawn(estimated), _main_clip(clips)]))
    found["clip"], found["clips"] = _clip_details(clips), _other_clips(clips)
    line = measured_line(report["machine"])
    return {name: f"{text}\n\n{line}" for name, text in found.items() if text}


def measured_line(machine: dict[str, Any]) -> str:
    """On what and when, for the end of a section."""
    return (
        f"Measured {machine['date']} with `python benchmarks/readme.py` at commit {machine['commit']}, on "
        f"{machine['cores']} cores of {machine['processor']} ({machine['isa']})."
    )


def mean_and_error(rows: Rows, figure: str) -> tuple[float | None, float | None]:
    """Mean over worlds of one set, and its standard error; None where too few are known."""
    set_of(row["seed"] for row in rows)
    known = [value for row in rows if (value := FIGURES[figure][0](row)) is not None]
    if not known:
        return None, None
    return float(np.mean(known)), float(np.std(known, ddof=1) / math.sqrt(len(known))) if known[1:] else None


def drop_table(rows: Rows) -> str:
    """Hybrid on the worlds of the development beside those that are kept for tests."""
    body: list[list[str]] = []
    for references in dict.fromkeys(row["references"] for row in rows):
        ours = [r for r in rows if r["references"] == references and r["representation"] == OURS]
        sides = [[row for row in ours if row["seed"] in seeds] for seeds in (DEVELOPMENT, TEST)]
        for figure, (_, form) in FIGURES.items():
            (before, error), (after, other) = (mean_and_error(side, figure) for side in sides)
            change = None if before is None or after is None else after - before
            cells = [_with_error(before, error, form), _with_error(after, other, form)]
            body.append([f"{figure}, {references} references", *cells, number(change, "+" + form)])
    worlds = [len({row["seed"] for row in rows if row["seed"] in seeds}) for seeds in (DEVELOPMENT, TEST)]
    heads = [f"{name}, {count} worlds" for name, count in zip(("development", "test"), worlds, strict=True)]
    return table(["", *heads, "test less development"], body) if body else ""


def methods_table(rows: Rows, methods: Sequence[str]) -> str:
    """A row a method, means over the worlds that all of them have."""
    rows = [row for row in rows if row["representation"] in methods]
    worlds = common_worlds(rows, "representation")
    body: list[list[str]] = []
    for method in methods:
        here = [row for row in rows if row["representation"] == method and row["seed"] in worlds]
        if here:
            values = [number(mean_and_error(here, figure)[0], FIGURES[figure][1]) for figure in FIGURES]
            steps = f"{np.mean([row['steps'] for row in here]):.0f}"
            body.append([f"`{method}`", *values, steps, f"{np.mean([row['seconds'] for row in here]):.0f}"])
    head = ["", *FIGURES, "steps", "seconds of one core"]
    return table(head, body) + f"\n\nMeans over {len(worlds)} worlds." if body else ""


def _drawn(rows: Rows) -> str:
    """Test worlds alone."""
    test = [row for row in rows if row["seed"] in TEST]
    clean = [row for row in test if row["references"] == "clean"]
    shown = methods_table(clean, REPRESENTATIONS)
    iou, _ = mean_and_error([r for r in test if r["references"] == "corrupted"], "moving mask, IoU")
    worse = f" Frames corrupted as generated video is: {iou:.2f} of IoU." if iou is not None else ""
    title = "Drawn streets that no choice was made on, intrinsics known, poses not, all in equal steps:"
    return f"{title}\n\n{shown}{worse}" if shown else ""


def _main_clip(clips: dict[str, dict[str, Any]]) -> str:
    """The clip of the picture, as the README has it."""
    there = {name: clips[run] for run, name in MAIN_CLIP.items() if run in clips}
    if not there:
        return ""
    body = [
        [name, _likeness(row), number(row["moving_psnr"], ".1f"), f"{row['seconds']:.0f}"]
        for name, row in there.items()
    ]
    first = next(iter(there.values()))
    flow = first["baselines"]["flow_interpolation"]
    likeness = f"{flow['psnr']:.1f} / {flow['ssim']:.3f}"
    body.append(["flow interpolation between the neighbours", likeness, "", ""])
    about = "24 frames, 480x270, no intrinsics, no poses, three held out"
    head = ["", "held-out PSNR / SSIM", "inside moving cars, dB", "seconds"]
    end = (
        f"The camera path is within {100 * first['path_error']:.2f} % of its length; the pixels called "
        f"moving overlap the labelled boxes with an IoU of {number(first['moving_iou'])}."
    )
    return f"The clip of the picture, a development clip ({about}):\n\n{table(head, body)}\n\n{end}"


def _clip_details(clips: dict[str, dict[str, Any]]) -> str:
    """The same with all that is known of it."""
    body: list[list[str]] = []
    for run, name in MAIN_CLIP.items():
        if run in clips:
            row = clips[run]
            moving = [number(row["moving_psnr"]), number(row["moving_iou"], ".3f")]
            cost = [f"{row['seconds']:.0f}", f"{row['peak_rss_mb'] / 1000:.2f} GB"]
            body.append([name, _likeness(row, ".2f"), *moving, f"{100 * row['path_error']:.2f} %", *cost])
    if not body:
        return ""
    head = ["", "held-out PSNR / SSIM", "inside moving boxes, dB", "moving pixels, IoU", "path error"]
    first = next(clips[run] for run in MAIN_CLIP if run in clips)
    stages = ", ".join(f"{stage} {seconds:.0f}" for stage, seconds in first["stages"].items())
    end = f"Baselines: {_baselines(first)}. Seconds of each stage in the first row: {stages}."
    return f"{table([*head, 'seconds', 'peak memory'], body)}\n\n{end}"


def _other_clips(clips: dict[str, dict[str, Any]]) -> str:
    """Drafts of the other clips."""
    body: list[list[str]] = []
    for run, name in OTHER_CLIPS.items():
        if run in clips:
            row = clips[run]
            path = f"{100 * row['path_error']:.2f} %" if "path_error" in row else ""
            focal = f"{row['focal']['px']:.0f}, {'observed' if row['focal']['observed'] else 'prior'}"
            moves = row["gaussians"]["dynamic"]
            what = f"{moves:,} Gaussians" if moves else "nothing"
            body.append([name, _likeness(row, ".2f"), _baselines(row), path, focal, what])
    head = ["development clip", "held-out PSNR / SSIM", "baselines", "path error", "focal length, px"]
    return table([*head, "what moves"], body) if body else ""


def _likeness(row: dict[str, Any], form: str = ".1f") -> str:
    return f"{row['held_out']['psnr']:{form}} / {row['held_out']['ssim']:.3f}"


def _baselines(row: dict[str, Any]) -> str:
    return " / ".join(f"{found['psnr']:.1f}" for found in row["baselines"].values())


def _with_error(value: float | None, error: float | None, form: str) -> str:
    return NONE if value is None else f"{value:{form}}" + ("" if error is None else f" ± {error:{form}}")
