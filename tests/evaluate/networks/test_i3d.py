"""I3D for FVD against the common PyTorch port, with seeded weights."""

import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.evaluate.networks.i3d import I3d, i3d_features, load_i3d, prepare
from tests.evaluate.networks.seeded import seeded_state
from tests.golden.reading import cases, close, tensors, values

LIMIT = 1e-4
"""Of the largest value: float32 through 60 layers with weights of no use, where 1e-6 was seen."""
FILE = "eval/perceptual.npz"


@pytest.fixture(scope="module")
def network(tmp_path_factory: pytest.TempPathFactory) -> I3d:
    settings = values("eval/perceptual.json")["i3d"]
    path = tmp_path_factory.mktemp("i3d") / "i3d.pt"
    torch.save(seeded_state(settings["keys"], settings["seed"]), path)
    return load_i3d(path)


def test_golden_preparation() -> None:
    given = tensors(FILE)
    close(prepare(given["i3d/video"])[:, :, ::3, ::16, ::16], given["i3d/input_sub"], 1e-5)


@pytest.mark.parametrize(
    "count",
    cases(FILE, r"i3d/logits(\d+)"),
)
def test_golden_logits(network: I3d, count: str) -> None:
    given = tensors(FILE)
    video = given["i3d/video"]
    frames = video[torch.arange(int(count)) % len(video)]  # again from the first
    close(i3d_features(network, frames), given[f"i3d/logits{count}"][0], LIMIT)


def test_too_short_a_clip_is_refused() -> None:
    with pytest.raises(InputError, match="9 frames or more, got 8"):
        i3d_features(I3d().eval(), torch.zeros(8, 32, 48, 3, dtype=torch.uint8))
