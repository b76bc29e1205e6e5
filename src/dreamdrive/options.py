"""Options of all stages, and the qualities: one row of numbers a name."""

from dataclasses import dataclass, field, replace
from functools import partial
from math import ceil
from typing import Any

from dreamdrive.complete import CompletionOptions
from dreamdrive.decompose import ActorOptions, GroupOptions, PerFrameOptions, ScoreOptions
from dreamdrive.errors import InputError
from dreamdrive.fit import DensifySettings, FitOptions, SeedOptions, TrialOptions
from dreamdrive.geometry import GeometryOptions
from dreamdrive.motion import REPRESENTATIONS, DeformationConfig, MotionConfig
from dreamdrive.names import DeviceName, MethodName, QualityName, RepresentationName
from dreamdrive.scene.clip import Clip
from dreamdrive.street_network import SHIPPED

_VISITS = 3.0  # see ``FitOptions.least_visits``


@dataclass(frozen=True)
class Options:
    """How a scene is built: the options of each stage, by default those of the quality ``"standard"``.

    Attributes:
        quality: Name of the row of ``QUALITIES`` that they began as.
        static: The fit as if nothing moved.
        score: Training of the dynamic scores.
        fit: The joint fit.
        seeds: How pixels become Gaussians.
        group: The vote.
        cast: The actors' tracks.
        drift: The street, where no path of the camera explains the frames.
        trial: The small fit by which frames judge.
        densify: Growing and pruning in the joint fit.
        completion: What is put where no frame saw anything.
        network: Size of the deformation field; its width is that of every representation.
        representation: ``"hybrid"``, or one of its baselines.
        device: Where networks and both fits are computed.
        geometry: How cameras and depth are found.
        knowledge: Weights of the street network: the name of those that ship, a file, or ``"none"``.
        method: Whose equations the others are set to, see ``with_method``.
    """

    quality: QualityName = "standard"
    static: FitOptions = field(default_factory=partial(FitOptions, steps=150, least_visits=_VISITS))
    score: ScoreOptions = field(default_factory=ScoreOptions)
    fit: FitOptions = field(default_factory=partial(FitOptions, steps=500, least_visits=_VISITS))
    seeds: SeedOptions = field(default_factory=SeedOptions)
    group: GroupOptions = field(default_factory=GroupOptions)
    cast: ActorOptions = field(default_factory=ActorOptions)
    drift: PerFrameOptions = field(default_factory=PerFrameOptions)
    trial: TrialOptions = field(default_factory=TrialOptions)
    densify: DensifySettings = field(default_factory=DensifySettings)
    completion: CompletionOptions = field(default_factory=CompletionOptions)
    network: DeformationConfig = field(default_factory=DeformationConfig)
    representation: RepresentationName = "hybrid"
    device: DeviceName = "cpu"
    geometry: GeometryOptions = field(default_factory=GeometryOptions)
    knowledge: str = SHIPPED
    method: MethodName = "dreamdrive"

    @property
    def name(self) -> str:
        """The quality's, or ``"custom"`` where they are no longer its own.

        What is chosen beside a quality does not matter: device, networks, what is known of the camera.
        """
        g, own = self.geometry, with_method(QUALITIES[self.quality], self.method)
        told = {"method": g.method, "weights": g.weights}
        told |= {"camera_height_m": g.camera_height_m, "refine_poses": g.refine_poses}
        beside = {name: getattr(self, name) for name in ("representation", "device", "knowledge")}
        same = self == replace(own, geometry=replace(own.geometry, **told), **beside)
        return self.quality if same else "custom"

    @property
    def motion(self) -> MotionConfig:
        """What the joint fit learns motion by; all networks have the same width."""
        motion = REPRESENTATIONS[self.representation].motion
        if motion is None or motion.config_type is type(self.network):
            return self.network
        return motion.config_type.sized(self.network.width)

    def for_frames(self, frames: int, drives: int = 1) -> "Options":
        """The options with the steps that a clip takes.

        Args:
            frames: How many of its frames a fit may see.
            drives: How many drives from one frame they are of; each gets the steps of one.
        """
        fits = {
            name: replace(each, steps=max(drives * each.steps, ceil(each.least_visits * frames)))
            for name, each in (("static", self.static), ("fit", self.fit))
        }
        return replace(self, **fits)

    def for_clip(self, clip: Clip) -> "Options":
        """The options with the steps that a clip takes."""
        drives = len(clip.rig) if clip.known.shared_first else 1
        return self.for_frames(int((~clip.held_out).sum()), drives)

    @property
    def steps(self) -> dict[str, int]:
        """Optimisation steps of each stage: those on Gaussians are the same for all representations.

        ``score`` trains the classifier of the decomposition and changes no Gaussian.
        """
        fits = {"static": self.static.steps, "fit": self.fit.steps}
        scored = REPRESENTATIONS[self.representation].moves == "scored"
        return {**fits, "score": self.score.steps} if scored else fits


_PAPER_TAU = 0.05
"""tau of eq. 9, which has no number there: the best of 0.025 to 0.3 on drawn streets of the development
(``benchmarks/results/parts-2026-11-23.md``). Errors of a static fit are that small."""


def with_method(options: Options, method: MethodName) -> Options:
    """The options of ``--method``: ``"paper"`` takes eq. 5-14 as printed, ``"dreamdrive"`` is ours.

    The paper's error map is the only target of the scores, unscaled, in all frames, all pixels alike; every
    Gaussian is clustered and votes; F_deform alone, of the size of Deformable-3DGS that the paper follows,
    moves things; the loss is L1 + SSIM. What stays as it is here stands in docs/design.md.
    """
    if method == "dreamdrive":
        return options
    s, g = options.score, options.group
    weights = dict.fromkeys(("depth_weight", "sky_weight", "solid_weight", "stray_weight"), 0.0)
    as_printed: dict[str, Any] = {"loss": "paper", **weights}
    return replace(
        options,
        method="paper",
        score=replace(s, target="error", error_scale=1.0, error_sigma_px=0.0, window=None, balance=None),
        group=replace(g, clusters="density", threshold=_PAPER_TAU, majority=0.5),
        cast=replace(options.cast, tracks=False),
        drift=replace(options.drift, allowed=False),
        static=replace(options.static, **as_printed),
        fit=replace(options.fit, **as_printed),
        completion=replace(options.completion, aside_m=0.0),
        network=replace(options.network, depth=8, width=256),
    )


# Quality is steps, never seconds: the same command gives the same scene on a slow machine.
QUALITIES: dict[QualityName, Options] = {
    "draft": Options(
        "draft",
        FitOptions(steps=75, least_visits=_VISITS),
        ScoreOptions(),
        FitOptions(steps=225, least_visits=_VISITS, plane_rate=5e-2),
    ),
    "standard": Options(),
    "high": Options(
        "high",
        FitOptions(steps=500, least_visits=_VISITS),
        ScoreOptions(steps=300),
        FitOptions(steps=2500, least_visits=_VISITS),
    ),
}


def options_of(quality: str) -> Options:
    """Those of a quality.

    Raises:
        InputError: There is no such quality.
    """
    found = next((options for name, options in QUALITIES.items() if name == quality), None)
    if found is None:
        raise InputError(f"quality {quality!r}: expected {', '.join(QUALITIES)}, or an Options")
    return found


def chosen_options(
    options: Options | QualityName | None, quality: QualityName | None, camera_height_m: float | None
) -> Options:
    """What ``generate`` was given, as one ``Options``."""
    if options is not None and quality is not None:
        raise InputError("generate takes options or a quality, not both; the quality decides the options")
    whole = options if isinstance(options, Options) else options_of(options or quality or "standard")
    if camera_height_m is None:
        return whole
    return replace(whole, geometry=replace(whole.geometry, camera_height_m=camera_height_m))
