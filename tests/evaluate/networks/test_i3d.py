"""I3D for FVD against the common PyTorch port, with seeded weights."""

from pathlib import Path

import pytest
import torch
from tests.evaluate.golden import Golden, relative, seeded_state

from dreamdrive.errors import InputError
from dreamdrive.evaluate.networks.i3d import I3d, i3d_features, load_i3d, prepare


@pytest.fixture(scope="module")
def golden(golden_dir: Path) -> Golden:
    return Golden(golden_dir, "perceptual")


@pytest.fixture(scope="module")
def network(golden: Golden, tmp_path_factory: pytest.TempPathFactory) -> I3d:
    settings = golden.values["i3d"]
    path = tmp_path_factory.mktemp("i3d") / "i3d.pt"
    torch.save(seeded_state(settings["keys"], settings["seed"]), path)
    return load_i3d(path)


def test_golden_preparation(golden: Golden) -> None:
    got = prepare(golden.tensor("i3d/video"))[:, :, ::3, ::16, ::16]
    assert relative(got, golden.tensor("i3d/input_sub")) < 1e-5


@pytest.mark.parametrize("count", [10, 16, pytest.param(25, marks=pytest.mark.slow)])
def test_golden_logits(golden: Golden, network: I3d, count: int) -> None:
    video = golden.tensor("i3d/video")
    frames = torch.cat([video, video])[:count]
    assert relative(i3d_features(network, frames), golden.tensor(f"i3d/logits{count}")[0]) < 1e-4


def test_too_short_a_clip_is_refused(golden: Golden, network: I3d) -> None:
    with pytest.raises(InputError, match="9 frames or more, got 8"):
        i3d_features(network, golden.tensor("i3d/video")[:8])
