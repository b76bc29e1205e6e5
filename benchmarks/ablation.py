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
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from _ablation_features import with_efficientnet
from _ablation_groups import by_density, by_voxels, scaled_by_frame
from _street_case import NOVEL, Case, References, Start, case_digest, start
from _street_fit import Scale, Vote, fit_case, own_scale, own_vote, with_steps
from _street_fit import options_of as fit_options
from _street_jobs import QUALITY
from _street_keep import is_current, load, save
from _street_measure import measure, told_apart
from _street_table import as_text, grid, number
from _street_views import views_digest
from _workers import work_off

from dreamdrive.fit import Representation
from dreamdrive.options import Quality
from dreamdrive.scene.features import OF_GEOMETRY
from dreamdrive.splat import native_info
from dreamdrive.stages import digest

SEEDS = (0, 1, 2, 3)
FIGURES = ("held_out_psnr", "novel_psnr", "mask_iou", "label_iou", "fake_m")


@dataclass(frozen=True)
class Variant:
    """Hybrid with one thing changed.

    Attributes:
        about: For the table.
        change: Of the options.
        features: What F_score sees as Z_ref: appearance, nothing, or a network's features.
        representation: What is fitted.
        vote: How scores become things.
        scale: What the error maps are brought to before the scores are trained on them.
    """

    about: str
    change: Callable[[Quality], Quality] = lambda quality: quality
    features: Literal["appearance", "none", "efficientnet"] = "appearance"
    representation: Representation = "hybrid"
    vote: Vote = own_vote
    scale: Scale = own_scale


def scored(**changes: Any) -> Callable[[Quality], Quality]:
    """Other options of the scores."""
    return lambda quality: replace(quality, score=replace(quality.score, **changes))


def grouped(**changes: Any) -> Callable[[Quality], Quality]:
    """Other options of the grouping."""
    return lambda quality: replace(quality, group=replace(quality.group, **changes))


def played(**changes: Any) -> Callable[[Quality], Quality]:
    """Other options of the actors."""
    return lambda quality: replace(quality, cast=replace(quality.cast, **changes))


def fitted_with(**changes: Any) -> Callable[[Quality], Quality]:
    """Other options of the joint fit."""
    return lambda quality: replace(quality, fit=replace(quality.fit, **changes))


def grown(**changes: Any) -> Callable[[Quality], Quality]:
    """Other options of densification."""
    return lambda quality: replace(quality, densify=replace(quality.densify, **changes))


def prefit(steps: int) -> Callable[[Quality], Quality]:
    """Another length of the static fit."""
    return lambda quality: with_steps(quality, quality.fit.steps, steps)


def ungrouped(quality: Quality) -> Quality:
    """No clusters, hence no things that could have tracks."""
    cut = grouped(clustering=False)(quality)
    return replace(cut, cast=replace(cut.cast, least_frames=10**6))


VARIANTS = {
    "hybrid": Variant("all parts"),
    "no-grouping": Variant("each Gaussian's own score against tau, no tracks", ungrouped),
    "no-features": Variant("F_score without Z_ref", features="none"),
    "efficientnet": Variant("features of EfficientNet-Lite0 as Z_ref", features="efficientnet"),
    "error-alone": Variant("the colour error alone as target (eq. 6)", scored(target="error")),
    "dssim": Variant("(1 - SSIM) / 2 as error", scored(error="dssim")),
    "feature-error": Variant("distance of splatted features (appearance) as error", scored(error="features")),
    "all-frames": Variant("scores splatted into all frames, as the paper", scored(window=None)),
    "paper": Variant(
        "error-alone and all-frames together, as the paper", scored(target="error", window=None)
    ),
    "error-scale-0.1": Variant("an error of 0.1 counts as 1, not of 0.2", scored(error_scale=0.1)),
    "error-scale-0.4": Variant("an error of 0.4 counts as 1", scored(error_scale=0.4)),
    "error-by-frame": Variant(
        "errors over the 98th percentile of their frame",
        scale=lambda errors, quality: scaled_by_frame(errors, quality.score.error_scale),
    ),
    "hdbscan": Variant("clusters of HDBSCAN over space, time and score", vote=by_density),
    "voxels": Variant("clusters of touching voxels of 1 m and 0.1 s", vote=by_voxels),
    "tau-0.20": Variant("tau = 0.20", grouped(threshold=0.20)),
    "tau-0.50": Variant("tau = 0.50", grouped(threshold=0.50)),
    "tau-0.65": Variant("tau = 0.65", grouped(threshold=0.65)),
    "no-tracks": Variant("F_deform alone moves things (eq. 11)", played(least_frames=10**6)),
    "short-lives": Variant("what no other frame sees lives no longer", played(lasting=False)),
    "long-lives": Variant("all copies live three times as long", played(lifespan_frames=3.75)),
    "paper-loss": Variant("L1 + SSIM unweighted (eq. 14)", fitted_with(loss="paper")),
    "no-depth": Variant("no term on depth", fitted_with(depth_weight=0.0)),
    "no-shape": Variant("no term on elongation", fitted_with(shape_weight=0.0)),
    "no-densify": Variant("nothing grows or is pruned", grown(start=1.0, stop=0.0)),
    "prefit-50": Variant("static fit of 50 steps", prefit(50)),
    "prefit-400": Variant("static fit of 400 steps", prefit(400)),
    "static": Variant("nothing moves", representation="static"),
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
    if variant.features == "appearance":
        return begin
    if variant.features == "efficientnet":
        return with_efficientnet(begin, quality)
    features = begin.seeds.features
    assert features is not None
    bare = features.clone()
    bare[:, OF_GEOMETRY:] = 0
    return replace(begin, seeds=replace(begin.seeds, features=bare))


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


def tables(records: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Means over worlds, and what each variant changes against all parts, world by world."""
    found: list[dict[str, Any]] = []
    for references in dict.fromkeys(record["references"] for record in records):
        here = [record for record in records if record["references"] == references]
        whole = {record["seed"]: record for record in here if record["variant"] == "hybrid"}
        rows = [
            _row(variant, [record for record in here if record["variant"] == variant], whole)
            for variant in dict.fromkeys(record["variant"] for record in here)
        ]
        found.append({"references": references, "rows": rows})
    return found


def _row(variant: str, found: list[dict[str, Any]], whole: dict[int, dict[str, Any]]) -> dict[str, Any]:
    row: dict[str, Any] = {"variant": variant, "worlds": len(found)}
    for figure in FIGURES:
        row[figure] = _mean([record[figure] for record in found])
        pairs = [
            (record[figure], whole[record["seed"]][figure]) for record in found if record["seed"] in whole
        ]
        row[f"{figure}_change"] = _mean([a - b for a, b in pairs if a is not None and b is not None])
    return row


def _mean(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def markdown(found: list[dict[str, Any]]) -> str:
    """The tables as text; in brackets the change against all parts."""
    parts: list[str] = []
    heads = ["withheld, dB", "novel, dB", "mask IoU", "label IoU", "fake motion, m"]
    forms = (".2f", ".2f", ".3f", ".3f", ".4f")
    for table in found:
        lines = [["variant", "", "worlds", *heads]]
        for row in table["rows"]:
            cells = [
                f"{number(row[figure], form)} ({number(row[figure + '_change'], '+' + form)})"
                for figure, form in zip(FIGURES, forms, strict=True)
            ]
            about = VARIANTS[row["variant"]].about
            lines.append([row["variant"], about, str(row["worlds"]), *cells])
        parts += [f"## {table['references']} references, true poses\n", grid(lines)]
    return "\n".join(parts)


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
    if "hdbscan" in options.variants and find_spec("sklearn") is None:
        print("not measured: hdbscan: pip install scikit-learn", file=sys.stderr)
        options.variants.remove("hdbscan")
    wanted = cuts(options)
    for cut in wanted:
        if not (options.resume and is_current(cut.result, cut.key)):
            cut.result.unlink(missing_ok=True)
    failed = work_off([cut for cut in wanted if not cut.result.exists()], make, options.workers)
    records = [record for cut in wanted if (record := load(cut.result)) is not None]
    report = {"machine": native_info(), "rows": records, "tables": tables(records)}
    text = markdown(report["tables"])
    print(text)
    if options.json:
        options.json.write_text(as_text(report))
    if options.markdown:
        options.markdown.write_text(text)
    for cut in failed:
        print(f"failed: {cut.name}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
