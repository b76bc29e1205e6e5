"""The committed protocol of the experiment, as typed values."""

from dataclasses import dataclass
from pathlib import Path

import msgspec

from dreamdrive.tasks.perception import (
    CvtOptions,
    CvtTraining,
    LossOptions,
    Regime,
    ScheduleOptions,
)

PROTOCOL = Path(__file__).with_name("protocol.json")


class Streets(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The family of drawn streets that stands for real ones."""

    edition: int
    first_training: int
    training: int
    first_validation: int
    validation: int
    seconds: float
    rate_hz: float
    width_px: int
    height_px: int
    noise_levels: float

    def seeds(self, split: str) -> range:
        """Seeds of a split."""
        first, count = {
            "training": (self.first_training, self.training),
            "validation": (self.first_validation, self.validation),
        }[split]
        return range(first, first + count)


class Real(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What is recorded and labelled in the arms beside the oracle."""

    streets: int
    key_frames: int


class Generated(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How scenes are made of recorded pictures, and how samples are rendered of them."""

    quality: str
    per_street: int
    aside_m: float
    turned_deg: float
    validation_streets: int


class Training(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How every network is trained."""

    steps: int
    batch: int
    rate: float
    frozen_layers: int
    low_precision: bool
    alpha: float


class Realism(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Which network is tested on generated samples."""

    trained: str
    tested: str


class Protocol(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """All of it."""

    about: str
    streets: Streets
    real: Real
    generated: Generated
    regime: Training
    arms: dict[str, list[str]]
    realism: Realism
    seeds: list[int]

    @property
    def sets(self) -> list[str]:
        """Names of all sets that are learned from or tested on."""
        learned = [name for names in self.arms.values() for name in names]
        return list(dict.fromkeys([*learned, "validation", self.realism.tested]))

    @property
    def used(self) -> range:
        """Training streets that any of these sets is made of."""
        training = self.streets.seeds("training")
        return (
            training if {"real-all", "generated-of-all"} & set(self.sets) else training[: self.real.streets]
        )

    def regime_of(self, seed: int, network: CvtOptions, trunk: str) -> Regime:
        """How a network is trained."""
        r = self.regime
        training = CvtTraining(
            schedule=ScheduleOptions(steps=r.steps, rate=r.rate),
            losses=LossOptions(alpha=r.alpha),
            low_precision=r.low_precision,
            frozen_layers=r.frozen_layers,
            seed=seed,
        )
        return Regime(network, training, r.batch, trunk)


def read_protocol(path: Path = PROTOCOL) -> Protocol:
    """The protocol of a file."""
    return msgspec.json.decode(path.read_bytes(), type=Protocol)


@dataclass(frozen=True)
class Places:
    """Where parts of the experiment lie in its folder of runs."""

    runs: Path

    def street(self, seed: int) -> Path:
        """A drawn street in the format of nuScenes."""
        return self.runs / "streets" / f"street-{seed}"

    def scene(self, seed: int) -> Path:
        """What ``generate`` makes of it."""
        return self.runs / "scenes" / f"street-{seed}"

    def set(self, name: str) -> Path:
        """A set of samples."""
        return self.runs / "sets" / name
