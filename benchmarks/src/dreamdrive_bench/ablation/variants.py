"""What the ablation varies: hybrid with one thing changed."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from dreamdrive.decompose import PerFrameOptions
from dreamdrive.options import Options
from dreamdrive_bench.ablation.errors import by_frame, dssim_errors, feature_errors, own_errors, scored_on
from dreamdrive_bench.ablation.features import (
    with_appearance,
    with_efficientnet,
    with_evidence,
    without_features,
)
from dreamdrive_bench.ablation.groups import by_density, by_density_and_features, by_voxels
from dreamdrive_bench.street.fit import Around, with_steps
from dreamdrive_bench.street.methods import QUALITY, options_of


@dataclass(frozen=True)
class Variant:
    """Hybrid with one thing changed.

    Attributes:
        about: For the table.
        change: Of the options.
        around: What is made in place of a stage's result.
    """

    about: str
    change: Callable[[Options], Options] = lambda options: options
    around: Mapping[str, Around] = field(default_factory=dict)


def of_method(name: str) -> Callable[[Options], Options]:
    """Another representation."""
    return lambda _: options_of(name)


def scored(**changes: Any) -> Callable[[Options], Options]:
    """Other options of the scores."""
    return lambda options: replace(options, score=replace(options.score, **changes))


def grouped(**changes: Any) -> Callable[[Options], Options]:
    """Other options of the grouping."""
    return lambda options: replace(options, group=replace(options.group, **changes))


def played(**changes: Any) -> Callable[[Options], Options]:
    """Other options of the actors."""
    return lambda options: replace(options, cast=replace(options.cast, **changes))


def fitted_with(**changes: Any) -> Callable[[Options], Options]:
    """Other options of the joint fit."""
    return lambda options: replace(options, fit=replace(options.fit, **changes))


def grown(**changes: Any) -> Callable[[Options], Options]:
    """Other options of densification."""
    return lambda options: replace(options, densify=replace(options.densify, **changes))


def prefit(steps: int) -> Callable[[Options], Options]:
    """Another length of the static fit."""
    return lambda options: with_steps(options, options.fit.steps, steps)


def tau(threshold: float) -> Callable[[Options], Options]:
    """Another threshold; candidates reach below it as far as they do by default, the core stays."""
    usual = QUALITY.group
    return grouped(
        threshold=threshold, candidate=min(usual.candidate, threshold * usual.candidate / usual.threshold)
    )


_SHORT = 1.25
"""Frames that a copy lives: without a track it is wrong soon."""


def untracked(lifespan_frames: float) -> Callable[[Options], Options]:
    """No tracks: each copy stays where it was seen, and lives so long."""
    return played(least_frames=10**6, untracked_frames=lifespan_frames)


def ungrouped(options: Options) -> Options:
    """No clusters, hence no things that could have tracks."""
    return grouped(clusters="none")(untracked(_SHORT)(options))


VARIANTS = {
    "hybrid": Variant("all parts"),
    "static": Variant("no hybrid: nothing moves", of_method("static")),
    "deformable": Variant("no hybrid: everything goes through F_deform", of_method("deformable")),
    "no-grouping": Variant("each Gaussian's own score against tau, no tracks", ungrouped),
    "no-features": Variant(
        "F_score sees the position alone, no Z_ref", around={"initialise": without_features}
    ),
    "no-appearance": Variant("Z_ref is the evidence alone", around={"initialise": with_evidence}),
    "efficientnet": Variant(
        "Z_ref is the evidence and EfficientNet-Lite0", around={"initialise": with_efficientnet}
    ),
    "target-error": Variant("the colour error alone as target (eq. 6)", scored(target="error")),
    "error-alone": Variant(
        "the same, and Z_ref is the appearance alone: no evidence",
        scored(target="error"),
        {"initialise": with_appearance},
    ),
    "paper": Variant(
        "the same, and scores splatted into all frames: the paper",
        scored(target="error", window=None),
        {"initialise": with_appearance},
    ),
    "all-frames": Variant("scores splatted into all frames", scored(window=None)),
    "no-balance": Variant("what moves weighs no more than what stands", scored(balance=None)),
    "dssim": Variant("(1 - SSIM) / 2 as error", around={"score": scored_on(dssim_errors)}),
    "feature-error": Variant(
        "distance of splatted features (appearance) as error", around={"score": scored_on(feature_errors)}
    ),
    "error-scale-0.1": Variant("an error of 0.1 counts as 1, not of 0.2", scored(error_scale=0.1)),
    "error-scale-0.4": Variant("an error of 0.4 counts as 1", scored(error_scale=0.4)),
    "error-by-frame": Variant(
        "errors over the 98th percentile of their frame",
        around={"score": scored_on(by_frame(own_errors))},
    ),
    "dssim-by-frame": Variant(
        "(1 - SSIM) / 2, scaled so", around={"score": scored_on(by_frame(dssim_errors))}
    ),
    "feature-error-by-frame": Variant(
        "distance of features, scaled so", around={"score": scored_on(by_frame(feature_errors))}
    ),
    "hdbscan": Variant("clusters of HDBSCAN over space, time and score", around={"group": by_density}),
    "hdbscan-features": Variant("the same, over Z_ref as well", around={"group": by_density_and_features}),
    "voxels": Variant("clusters of touching voxels of 1 m and a frame", around={"group": by_voxels}),
    "tau-0.20": Variant("tau = 0.20", tau(0.20)),
    "tau-0.50": Variant("tau = 0.50", tau(0.50)),
    "tau-0.65": Variant("tau = 0.65", tau(0.65)),
    "shadows": Variant("shadows and road around the wheels move with their cars", grouped(road=None)),
    "no-tracks": Variant(
        "no tracks: F_deform alone moves things",
        untracked(_SHORT),
    ),
    "no-lives": Variant("no tracks, and copies live for ever (eq. 11)", untracked(1e3)),
    "no-residual": Variant("tracks alone, F_deform stays 0", fitted_with(deformation_rate=0.0)),
    "short-lives": Variant("what no other frame sees lives no longer", played(lasting=False)),
    "brief-lives": Variant("copies that others replace live a third as long", played(lifespan_frames=_SHORT)),
    "no-completing": Variant("what no frame saw of a vehicle stays empty", played(complete=False)),
    "no-stray": Variant("what moves may cover what stands for nothing", fitted_with(stray_weight=0.0)),
    "no-drift": Variant(
        "no street drifts", lambda options: replace(options, drift=PerFrameOptions(allowed=False))
    ),
    "paper-loss": Variant("joint fit with L1 + SSIM unweighted (eq. 14)", fitted_with(loss="paper")),
    "no-depth": Variant("joint fit without the term on depth", fitted_with(depth_weight=0.0)),
    "no-densify": Variant("nothing grows or is pruned", grown(start=1.0, stop=0.0)),
    "prefit-50": Variant("static fit of 50 steps, not 150", prefit(50)),
    "prefit-400": Variant("static fit of 400 steps", prefit(400)),
}
