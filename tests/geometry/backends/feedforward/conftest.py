"""A street, its clip, and packages that know the truth of it."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch
from torch import Tensor

from dreamdrive.geometry.resize import ResizeCrop
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.street.truth import DriveTruth
from streetworld import make_street
from tests.geometry.backends.feedforward.fakes import KINDS, Truth, install, save_weights
from tests.streets import street_clip

FRAMES, SIZE = 8, (160, 96)


@pytest.fixture(scope="session")
def drive() -> DriveTruth:
    return make_street(5, FRAMES, 5.0, SIZE, movers=0)


@pytest.fixture(scope="session")
def clip(drive: DriveTruth) -> Clip:
    return replace(street_clip(drive, 4), known=Known(), features={})


@pytest.fixture(params=KINDS)
def kind(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture
def truth(drive: DriveTruth, shown: dict[ResizeCrop, Tensor]) -> Truth:
    return Truth(drive, shown=shown)


@pytest.fixture
def weights(kind: str, truth: Truth, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The weights of a kind whose package can be imported; torch hub has the encoder of MapAnything."""
    install(monkeypatch, truth, kind)
    monkeypatch.setattr(torch.hub, "get_dir", lambda: str(tmp_path / "hub"))
    (tmp_path / "hub" / "facebookresearch_dinov2_main").mkdir(parents=True)
    return save_weights(tmp_path / "weights", kind)


@pytest.fixture(scope="session")
def shown() -> dict[ResizeCrop, Tensor]:
    """Pictures of the street, made once."""
    return {}
