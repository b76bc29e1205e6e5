"""What ``--quality`` means: one row of numbers a name."""

from dataclasses import dataclass, field
from typing import Literal

from dreamdrive.decompose import GroupOptions, ScoreOptions
from dreamdrive.decompose.actors import ActorOptions
from dreamdrive.fit import DensifySettings, FitOptions, SeedOptions
from dreamdrive.motion import MotionConfig, choose_representation

QualityName = Literal["draft", "standard", "high"]


@dataclass(frozen=True)
class Quality:
    """How much work each stage does.

    Attributes:
        static: The fit as if nothing moved.
        score: Training of the dynamic scores.
        fit: The joint fit.
        seeds: How pixels become Gaussians.
        group: The vote.
        cast: The actors' tracks.
        densify: Growing and pruning in the joint fit.
        width: Units of the layers of every motion's network (the paper's baseline: 256; 64 suits two cores).
    """

    static: FitOptions
    score: ScoreOptions
    fit: FitOptions
    seeds: SeedOptions = field(default_factory=SeedOptions)
    group: GroupOptions = field(default_factory=GroupOptions)
    cast: ActorOptions = field(default_factory=ActorOptions)
    densify: DensifySettings = field(default_factory=DensifySettings)
    width: int = 64

    def motion(self, representation: str) -> MotionConfig | None:
        """What the joint fit learns motion by; all networks have the same width."""
        motion = choose_representation(representation).motion
        return None if motion is None else motion.config_type.sized(self.width)

    def steps(self, representation: str) -> dict[str, int]:
        """Optimisation steps of each stage: those on Gaussians are the same for all representations.

        ``score`` trains the classifier of the decomposition and changes no Gaussian.
        """
        fits = {"static": self.static.steps, "fit": self.fit.steps}
        scored = choose_representation(representation).moves == "scored"
        return {**fits, "score": self.score.steps} if scored else fits


# Quality is steps, never seconds: the same command gives the same scene on a slow machine.
QUALITIES: dict[QualityName, Quality] = {
    "draft": Quality(FitOptions(steps=150), ScoreOptions(), FitOptions(steps=300, plane_rate=5e-2)),
    "standard": Quality(FitOptions(steps=400), ScoreOptions(), FitOptions(steps=1600)),
    "high": Quality(FitOptions(steps=1500), ScoreOptions(steps=300), FitOptions(steps=8000)),
}
