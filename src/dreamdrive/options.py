"""What ``--quality`` means: one row of numbers a name."""

from dataclasses import dataclass, field

from dreamdrive.choices import QualityName, Representation
from dreamdrive.decompose import ActorOptions, GroupOptions, ScoreOptions
from dreamdrive.fit import DensifySettings, FitOptions, MotionConfig, SeedOptions
from dreamdrive.geometry import GeometryOptions
from dreamdrive.scene.deformation import DeformationConfig
from dreamdrive.scene.hexplane import HexPlaneConfig
from dreamdrive.scene.vibration import VibrationConfig


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
        densify: Growing and pruning in the joint fit.
        network: Size of the deformation field; its width is that of every representation.
        representation: ``"hybrid"``, or one of its baselines.
        geometry: How cameras and depth are found.
        seed: Seed of everything random.
    """

    static: FitOptions
    score: ScoreOptions
    fit: FitOptions
    seeds: SeedOptions = field(default_factory=SeedOptions)
    group: GroupOptions = field(default_factory=GroupOptions)
    cast: ActorOptions = field(default_factory=ActorOptions)
    densify: DensifySettings = field(default_factory=DensifySettings)
    network: DeformationConfig = field(default_factory=DeformationConfig)
    representation: Representation = "hybrid"
    geometry: GeometryOptions = field(default_factory=GeometryOptions)
    seed: int = 0

    @property
    def motion(self) -> MotionConfig:
        """What the joint fit learns motion by; all networks have the same width."""
        if self.representation == "hexplane":
            return HexPlaneConfig(width=self.network.width)
        if self.representation == "vibration":
            return VibrationConfig()
        return self.network

    @property
    def steps(self) -> dict[str, int]:
        """Optimisation steps of each stage: those on Gaussians are the same for all representations.

        ``score`` trains the classifier of the decomposition, which hybrid alone has, and changes no Gaussian.
        """
        fits = {"static": self.static.steps, "fit": self.fit.steps}
        return {**fits, "score": self.score.steps} if self.representation == "hybrid" else fits


# Quality is steps, never seconds: the same command gives the same scene on a slow machine.
QUALITIES: dict[QualityName, Options] = {
    "draft": Options(FitOptions(steps=150), ScoreOptions(), FitOptions(steps=300, plane_rate=5e-2)),
    "standard": Options(FitOptions(steps=400), ScoreOptions(), FitOptions(steps=1600)),
    "high": Options(FitOptions(steps=1500), ScoreOptions(steps=300), FitOptions(steps=8000)),
}
