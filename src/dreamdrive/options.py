"""What ``--quality`` means: one row of numbers a name."""

from dataclasses import dataclass, field, replace
from math import ceil

from dreamdrive.choices import DeviceName, MethodName, QualityName, RepresentationName
from dreamdrive.decompose import ActorOptions, DriftOptions, GroupOptions, ScoreOptions
from dreamdrive.fit import DensifySettings, FitOptions, SeedOptions, TrialOptions
from dreamdrive.geometry import GeometryOptions
from dreamdrive.knowledge import SHIPPED
from dreamdrive.motion import REPRESENTATIONS, DeformationConfig, MotionConfig
from dreamdrive.scene.clip import Clip


@dataclass(frozen=True)
class Options:
    """How a scene is built: the options of each stage.

    Attributes:
        static: The fit as if nothing moved.
        score: Training of the dynamic scores.
        fit: The joint fit.
        seeds: How pixels become Gaussians.
        group: The vote.
        cast: The actors' tracks.
        drift: The street, where no path of the camera explains the frames.
        trial: The small fit by which frames judge.
        densify: Growing and pruning in the joint fit.
        network: Size of the deformation field; its width is that of every representation.
        representation: ``"hybrid"``, or one of its baselines.
        device: Where networks and both fits are computed.
        geometry: How cameras and depth are found.
        knowledge: Weights of the street network: the name of those that ship, a file, or ``"none"``.
        method: Whose equations the others are set to, see ``with_method``.
        seed: Seed of everything random.
    """

    static: FitOptions
    score: ScoreOptions
    fit: FitOptions
    seeds: SeedOptions = field(default_factory=SeedOptions)
    group: GroupOptions = field(default_factory=GroupOptions)
    cast: ActorOptions = field(default_factory=ActorOptions)
    drift: DriftOptions = field(default_factory=DriftOptions)
    trial: TrialOptions = field(default_factory=TrialOptions)
    densify: DensifySettings = field(default_factory=DensifySettings)
    network: DeformationConfig = field(default_factory=DeformationConfig)
    representation: RepresentationName = "hybrid"
    device: DeviceName = "cpu"
    geometry: GeometryOptions = field(default_factory=GeometryOptions)
    knowledge: str = SHIPPED
    method: MethodName = "dreamdrive"
    seed: int = 0

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

    The paper's error map is the only target of the scores, unscaled, in all frames; every Gaussian is
    clustered and votes; F_deform alone, of the size of Deformable-3DGS that the paper follows, moves things;
    the loss is L1 + SSIM.
    """
    if method == "dreamdrive":
        return options
    s, g = options.score, options.group
    return replace(
        options,
        method="paper",
        score=replace(s, target="error", error_scale=1.0, error_sigma_px=0.0, window=None),
        group=replace(g, clusters="density", threshold=_PAPER_TAU, majority=0.5),
        cast=replace(options.cast, tracks=False),
        drift=replace(options.drift, allowed=False),
        static=replace(options.static, loss="paper", depth_weight=0.0, sky_weight=0.0),
        fit=replace(options.fit, loss="paper", depth_weight=0.0, sky_weight=0.0, stray_weight=0.0),
        network=replace(options.network, depth=8, width=256),
    )


_VISITS = 3.0  # see ``FitOptions.least_visits``
# Quality is steps, never seconds: the same command gives the same scene on a slow machine.
QUALITIES: dict[QualityName, Options] = {
    "draft": Options(
        FitOptions(steps=75, least_visits=_VISITS),
        ScoreOptions(),
        FitOptions(steps=150, least_visits=_VISITS, plane_rate=5e-2),
    ),
    "standard": Options(
        FitOptions(steps=150, least_visits=_VISITS),
        ScoreOptions(),
        FitOptions(steps=500, least_visits=_VISITS),
    ),
    "high": Options(
        FitOptions(steps=500, least_visits=_VISITS),
        ScoreOptions(steps=300),
        FitOptions(steps=2500, least_visits=_VISITS),
    ),
}
