"""The command line of ``ablation.py``, and one fit of a variant."""

import argparse
import os
import sys
from dataclasses import asdict, dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import get_args

import numpy as np
import torch

from ablation.features import with_efficientnet
from ablation.tables import markdown, tables
from ablation.variants import VARIANTS, Variant
from common.keep import is_current, load, save
from common.machine import describe_machine
from common.options import parser_of
from common.report import publish
from common.workers import work_off
from dreamdrive.options import Quality
from dreamdrive.run.stages import digest
from dreamdrive.scene.features import OF_GEOMETRY
from street.case import NOVEL, Case, References, Start, case_digest, start
from street.fit import fit_case
from street.fit import options_of as fit_options
from street.jobs import QUALITY
from street.measure import measure, told_apart
from street.views import views_digest

SEEDS = (0, 1, 2, 3)


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
    fitted = fit_case(begin, variant.representation, quality, variant.vote, variant.scale)
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


def options_of(doc: str | None = None, arguments: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = parser_of(doc, runs="runs/street", resume=True, markdown=True)
    parser.add_argument("--seeds", type=int, nargs="+", metavar="S", default=list(SEEDS))
    parser.add_argument("--variants", nargs="+", choices=VARIANTS, default=list(VARIANTS))
    parser.add_argument(
        "--references", nargs="+", choices=get_args(References), default=["corrupted", "clean"]
    )
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="fits side by side")
    return parser.parse_args(arguments)


def cuts(options: argparse.Namespace) -> list[Cut]:
    """All fits, world by world."""
    return [
        Cut(seed, references, variant, options.runs)
        for references in options.references
        for seed in options.seeds
        for variant in options.variants
    ]


def main(doc: str | None) -> int:
    """Fit what is not there yet and print the tables."""
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")
    options = options_of(doc)
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
    report = {"machine": describe_machine(), "rows": records, "tables": tables(records)}
    return publish(options, report, markdown(report["tables"]), [cut.name for cut in failed])
