"""What each part of hybrid is worth, on drawn streets with a truth.

Variants of hybrid with true poses, from corrupted and from clean references: each leaves one part out, or
takes another choice in its place, such as the paper's. All begin with the static fit of ``street``, except
those that vary it, and use what that has prepared in the same ``--runs``.
"""

import argparse
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import get_args

import numpy as np

from dreamdrive.files.digest import digest
from dreamdrive_bench.ablation.tables import markdown, tables
from dreamdrive_bench.ablation.variants import VARIANTS
from dreamdrive_bench.common.keep import is_current, load, save
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import publish
from dreamdrive_bench.common.workers import work_off
from dreamdrive_bench.common.worlds import DEVELOPMENT
from dreamdrive_bench.street.case import NOVEL, Case, References, case_digest
from dreamdrive_bench.street.fit import fit_case, key_of
from dreamdrive_bench.street.jobs import start
from dreamdrive_bench.street.measure import measure, told_apart
from dreamdrive_bench.street.methods import QUALITY
from dreamdrive_bench.street.views import views_digest

SEEDS = DEVELOPMENT[:4]


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
        case = case_digest(Case(self.seed, "true", self.references))
        return digest([key_of(case, variant.change(QUALITY)), self.variant, views_digest(self.seed)])


def make(cut: Cut) -> None:
    """Fit, measure and keep."""
    case, variant = Case(cut.seed, "true", cut.references), VARIANTS[cut.variant]
    fitted = fit_case(start(case, cut.runs), variant.change(QUALITY), variant.around)
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


def options_of(arguments: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = parser_of(__doc__, runs="runs/street", resume=True, markdown=True)
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


def main() -> int:
    """Fit what is not there yet and print the tables."""
    options = options_of()
    wanted = cuts(options)
    for cut in wanted:
        if not (options.resume and is_current(cut.result, cut.key)):
            cut.result.unlink(missing_ok=True)
    failed = work_off([cut for cut in wanted if not cut.result.exists()], make, options.workers)
    records = [record for cut in wanted if (record := load(cut.result)) is not None]
    report = {"machine": describe_machine(), "rows": records, "tables": tables(records)}
    return publish(options, report, markdown(report["tables"]), [cut.name for cut in failed])
