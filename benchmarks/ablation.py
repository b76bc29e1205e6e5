"""What each part of hybrid is worth, on drawn streets with a truth.

    python benchmarks/ablation.py [--seeds S ...] [--variants NAME ...] [--workers N] [--resume]
                                  [--runs runs/street] [--json FILE] [--markdown FILE]

Variants of hybrid with true poses, from corrupted and from clean references: each leaves one part out, or
takes another choice in its place, such as the paper's. All begin with the static fit of ``street.py``, except
those that vary it, and use what that has prepared in the same ``--runs``.
"""

import argparse
import os
import sys
from dataclasses import asdict, dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any, get_args

import numpy as np
import torch
from _ablation_features import with_efficientnet
from _ablation_variants import VARIANTS, Variant
from _report_file import write
from _street_case import NOVEL, Case, References, Start, case_digest, start
from _street_fit import fit_case
from _street_fit import options_of as fit_options
from _street_jobs import QUALITY
from _street_keep import is_current, load, save
from _street_measure import measure, told_apart
from _street_table import as_text, grid, number
from _street_views import views_digest
from _workers import work_off

from dreamdrive.options import Quality
from dreamdrive.run.stages import digest
from dreamdrive.scene.features import OF_GEOMETRY
from dreamdrive.splat import native_info

SEEDS = (0, 1, 2, 3)
FIGURES = {
    "held_out_psnr": ("withheld, dB", ".2f"),
    "novel_psnr": ("novel, dB", ".2f"),
    "mask_iou": ("mask IoU", ".3f"),
    "mask_precision": ("mask precision", ".2f"),
    "label_iou": ("label IoU", ".3f"),
    "fake_m": ("fake motion, m", ".4f"),
}


@dataclass(frozen=True)
class Cut:
    """One fit of a variant."""

    seed: int
    references: References
    variant: str
    runs: Path

    @property
    def name(self) -> str:
        """For files and messages."""
        return f"{self.seed}-{self.references}-{self.variant}"

    @property
    def block(self) -> str:
        """Its table."""
        return self.references

    @property
    def owner(self) -> str:
        """Its world."""
        return str(self.seed)

    @property
    def result(self) -> Path:
        """Where its figures are kept."""
        return self.runs / "ablation" / f"{self.name}.json"

    @property
    def key(self) -> str:
        """Of everything its figures follow from."""
        variant = VARIANTS[self.variant]
        options = fit_options(variant.change(QUALITY), variant.representation)
        others = [self.variant, variant.features, variant.representation]
        case = case_digest(Case(self.seed, "true", self.references))
        return digest([case, options, others, views_digest(self.seed)])


def begun(begin: Start, variant: Variant, quality: Quality) -> Start:
    """What the variant is fitted to."""
    if variant.features == "all":
        return begin
    if variant.features == "efficientnet":
        return with_efficientnet(begin, quality)
    features = begin.seeds.features
    assert features is not None
    seen = torch.zeros_like(features)
    if variant.features == "evidence":
        seen[:, :OF_GEOMETRY] = features[:, :OF_GEOMETRY]
    if variant.features == "appearance":
        seen[:, OF_GEOMETRY:] = features[:, OF_GEOMETRY:]
    return replace(begin, seeds=replace(begin.seeds, features=seen))


def make(cut: Cut) -> None:
    """Fit, measure and keep."""
    case, variant = Case(cut.seed, "true", cut.references), VARIANTS[cut.variant]
    quality = variant.change(QUALITY)
    steps = quality.static.steps
    cases = cut.runs / ("cases" if steps == QUALITY.static.steps else f"cases-{steps}")
    begin = begun(start(case, quality, cases), variant, quality)
    fitted = fit_case(begin, variant.representation, quality, variant.vote, variant.errors)
    scene = fitted.scene
    views, _, _ = measure(scene, case, [], cut.runs / "truth")
    novel = [views[view]["psnr"] for view in NOVEL if views[view]["psnr"] is not None]
    record = {
        "seed": cut.seed,
        "references": cut.references,
        "variant": cut.variant,
        **asdict(fitted.cost),
        "gaussians": {"static": len(scene.static), "dynamic": len(scene.dynamic)},
        "held_out_psnr": views["held_out"]["psnr"],
        "novel_psnr": float(np.mean(novel)),
        "views": views,
        **told_apart(scene, cut.seed),
    }
    save(cut.result, cut.key, record)


def tables(records: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Means over the worlds that all variants have, and what each changes against all parts."""
    found: list[dict[str, Any]] = []
    for references in dict.fromkeys(record["references"] for record in records):
        here = [record for record in records if record["references"] == references]
        worlds = common_worlds(here)
        by_variant: dict[str, dict[int, dict[str, Any]]] = {}
        for record in here:
            if record["seed"] in worlds:
                by_variant.setdefault(record["variant"], {})[record["seed"]] = record
        whole = by_variant.get("hybrid", {})
        rows = [_row(variant, rows, whole) for variant, rows in by_variant.items()]
        found.append({"references": references, "worlds": worlds, "rows": rows})
    return found


def common_worlds(records: list[dict[str, Any]]) -> list[int]:
    """Seeds that every variant was measured on: means over different worlds cannot be compared."""
    seeds: dict[str, set[int]] = {}
    for record in records:
        seeds.setdefault(record["variant"], set()).add(record["seed"])
    return sorted(set.intersection(*seeds.values())) if seeds else []


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


def options_of(arguments: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, nargs="+", metavar="S", default=list(SEEDS))
    parser.add_argument("--variants", nargs="+", choices=VARIANTS, default=list(VARIANTS))
    parser.add_argument(
        "--references", nargs="+", choices=get_args(References), default=["corrupted", "clean"]
    )
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="fits side by side")
    parser.add_argument("--resume", action="store_true", help="keep fits that are finished")
    parser.add_argument("--runs", type=Path, default=Path("runs/street"), metavar="DIR")
    parser.add_argument("--json", type=Path, metavar="FILE")
    parser.add_argument("--markdown", type=Path, metavar="FILE")
    return parser.parse_args(arguments)


def cuts(options: argparse.Namespace) -> list[Cut]:
    """All fits, world by world."""
    return [
        Cut(seed, references, variant, options.runs)
        for references in options.references
        for seed in options.seeds
        for variant in options.variants
    ]


def main() -> int:
    """Fit what is not there yet and print the tables."""
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")
    options = options_of()
    for name in {"hdbscan", "hdbscan-features"}.intersection(options.variants):
        if find_spec("sklearn") is None:
            print(f"not measured: {name}: pip install scikit-learn", file=sys.stderr)
            options.variants.remove(name)
    wanted = cuts(options)
    for cut in wanted:
        if not (options.resume and is_current(cut.result, cut.key)):
            cut.result.unlink(missing_ok=True)
    failed = work_off([cut for cut in wanted if not cut.result.exists()], make, options.workers)
    records = [record for cut in wanted if (record := load(cut.result)) is not None]
    report = {"machine": native_info(), "rows": records, "tables": tables(records)}
    text = markdown(report["tables"])
    print(text)
    write(options.json, as_text(report))
    write(options.markdown, text)
    for cut in failed:
        print(f"failed: {cut.name}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
