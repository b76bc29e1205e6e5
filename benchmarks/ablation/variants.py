"""What the ablation varies: hybrid with one thing changed."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal

from ablation.errors import by_frame, dssim_errors, feature_errors
from ablation.groups import by_density, by_density_and_features, by_voxels
from dreamdrive.motion import RepresentationName
from dreamdrive.options import Quality
from street.fit import Errors, Vote, own_errors, own_vote, with_steps
from street.jobs import QUALITY


@dataclass(frozen=True)
class Variant:
    """Hybrid with one thing changed.

    Attributes:
        about: For the table.
        change: Of the options.
        features: What F_score sees as Z_ref beside the position: evidence and appearance, either alone,
            neither, or evidence and a network's features.
        representation: What is fitted.
        vote: How scores become things.
        errors: What the scores are trained on.
    """

    about: str
    change: Callable[[Quality], Quality] = lambda quality: quality
    features: Literal["all", "evidence", "appearance", "none", "efficientnet"] = "all"
    representation: RepresentationName = "hybrid"
    vote: Vote = own_vote
    errors: Errors = own_errors


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


def tau(threshold: float) -> Callable[[Quality], Quality]:
    """Another threshold; candidates reach below it as far as they do by default, the core stays."""
    usual = QUALITY.group
    return grouped(
        threshold=threshold, candidate=min(usual.candidate, threshold * usual.candidate / usual.threshold)
    )


def untracked(lifespan_frames: float) -> Callable[[Quality], Quality]:
    """No tracks: each copy stays where it was seen, and lives so long."""
    return played(least_frames=10**6, untracked_frames=lifespan_frames)


def ungrouped(quality: Quality) -> Quality:
    """No clusters, hence no things that could have tracks; copies live as long as those of things do."""
    return grouped(clusters="none")(untracked(quality.cast.lifespan_frames)(quality))


VARIANTS = {
    "hybrid": Variant("all parts"),
    "static": Variant("no hybrid: nothing moves", representation="static"),
    "deformable": Variant("no hybrid: everything goes through F_deform", representation="deformable"),
    "no-grouping": Variant("each Gaussian's own score against tau, no tracks", ungrouped),
    "no-features": Variant("F_score sees the position alone, no Z_ref", features="none"),
    "no-appearance": Variant("Z_ref is the evidence alone", features="evidence"),
    "efficientnet": Variant("Z_ref is the evidence and EfficientNet-Lite0", features="efficientnet"),
    "target-error": Variant("the colour error alone as target (eq. 6)", scored(target="error")),
    "error-alone": Variant(
        "the same, and Z_ref is the appearance alone: no evidence", scored(target="error"), "appearance"
    ),
    "paper": Variant(
        "the same, and scores splatted into all frames: the paper",
        scored(target="error", window=None),
        "appearance",
    ),
    "all-frames": Variant("scores splatted into all frames", scored(window=None)),
    "dssim": Variant("(1 - SSIM) / 2 as error", errors=dssim_errors),
    "feature-error": Variant("distance of splatted features (appearance) as error", errors=feature_errors),
    "error-scale-0.1": Variant("an error of 0.1 counts as 1, not of 0.2", scored(error_scale=0.1)),
    "error-scale-0.4": Variant("an error of 0.4 counts as 1", scored(error_scale=0.4)),
    "error-by-frame": Variant("errors over the 98th percentile of their frame", errors=by_frame(own_errors)),
    "dssim-by-frame": Variant("(1 - SSIM) / 2, scaled so", errors=by_frame(dssim_errors)),
    "feature-error-by-frame": Variant("distance of features, scaled so", errors=by_frame(feature_errors)),
    "hdbscan": Variant("clusters of HDBSCAN over space, time and score", vote=by_density),
    "hdbscan-features": Variant("the same, over Z_ref as well", vote=by_density_and_features),
    "voxels": Variant("clusters of touching voxels of 1 m and a frame", vote=by_voxels),
    "tau-0.20": Variant("tau = 0.20", tau(0.20)),
    "tau-0.50": Variant("tau = 0.50", tau(0.50)),
    "tau-0.65": Variant("tau = 0.65", tau(0.65)),
    "shadows": Variant("shadows and road around the wheels move with their cars", grouped(road=None)),
    "no-tracks": Variant(
        "no tracks: F_deform alone moves things",
        lambda quality: untracked(quality.cast.lifespan_frames)(quality),
    ),
    "no-lives": Variant("no tracks, and copies live for ever (eq. 11)", untracked(1e3)),
    "no-residual": Variant("tracks alone, F_deform stays 0", fitted_with(deformation_rate=0.0)),
    "short-lives": Variant("what no other frame sees lives no longer", played(lasting=False)),
    "long-lives": Variant(
        "copies that others replace live three times as long", played(lifespan_frames=3.75)
    ),
    "paper-loss": Variant("joint fit with L1 + SSIM unweighted (eq. 14)", fitted_with(loss="paper")),
    "no-depth": Variant("joint fit without the term on depth", fitted_with(depth_weight=0.0)),
    "no-densify": Variant("nothing grows or is pruned", grown(start=1.0, stop=0.0)),
    "prefit-50": Variant("static fit of 50 steps, not 150", prefit(50)),
    "prefit-400": Variant("static fit of 400 steps", prefit(400)),
}
