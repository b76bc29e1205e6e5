"""LPIPS against the package of its authors, with seeded weights."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.evaluate.networks.lpips import CHANNELS, TRUNKS, Heads, PerceptualDistance, load_lpips
from tests.evaluate.networks.seeded import seeded_state
from tests.golden.reading import cases, tensors, values


def files(settings: dict[str, Any], kind: str, folder: Path) -> tuple[Path, Path]:
    """Trunk and heads as the well-known files hold them."""
    slices = seeded_state(settings["net_keys"], settings["weights_seed"])
    trunk = {"features." + key.split(".", 1)[1]: value for key, value in slices.items()}
    rng = np.random.RandomState(settings["lin_seed"])
    heads = {
        f"lin{k}.model.1.weight": torch.from_numpy(np.abs(rng.standard_normal(count)) * 0.1)
        .float()
        .reshape(1, -1, 1, 1)
        for k, count in enumerate(CHANNELS[kind])
    }
    torch.save({**trunk, "classifier.6.bias": torch.zeros(1000)}, folder / f"{kind}.pth")
    torch.save(heads, folder / f"{kind}_heads.pth")
    return folder / f"{kind}.pth", folder / f"{kind}_heads.pth"


@pytest.mark.parametrize("kind", cases("eval/perceptual.json", "lpips_(.+)"))
def test_golden_distances(tmp_path: Path, kind: str) -> None:
    settings, images = values("eval/perceptual.json")[f"lpips_{kind}"], tensors("eval/perceptual.npz")
    distance = load_lpips(*files(settings, kind, tmp_path))
    assert distance.kind == kind
    a, b = images["lpips/a"], images["lpips/b"]
    # A sum of squares through all layers in float32: 1e-6 was seen.
    assert distance(2 * a - 1, 2 * b - 1).item() == pytest.approx(settings["normalize_true"], rel=1e-4)
    assert distance(a, b).item() == pytest.approx(settings["normalize_false_01_input"], rel=1e-4)


def test_files_of_different_networks_are_refused(tmp_path: Path) -> None:
    shapes = {key: list(value.shape) for key, value in TRUNKS["alex"]().state_dict().items()}
    trunk, heads = files({"net_keys": shapes, "weights_seed": 1, "lin_seed": 2}, "alex", tmp_path)
    torch.save({"lin0.model.1.weight": torch.zeros(1, 64, 1, 1)}, heads)
    with pytest.raises(InputError, match=r"4 missing: lin1.model.1.weight.*here those of alex"):
        load_lpips(trunk, heads)
    with pytest.raises(InputError, match="holds neither network"):
        load_lpips(heads, heads)


def test_it_can_be_learned_from() -> None:
    torch.manual_seed(0)
    heads = Heads(CHANNELS["alex"])
    for weight in heads.parameters():
        torch.nn.init.uniform_(weight, 0, 0.1)
    distance = PerceptualDistance("alex", TRUNKS["alex"](), heads).to(torch.device("cpu"))
    a, b = torch.rand(2, 2, 3, 64, 64) * 2 - 1
    a.requires_grad_(True)
    told = distance.of(a, b)
    torch.testing.assert_close(told.detach(), distance(a.detach(), b))
    told.sum().backward()
    assert a.grad is not None
    assert (a.grad != 0).any()
    assert all(weight.grad is None for weight in [*distance.trunk.parameters(), *heads.parameters()])


def test_where_no_channel_answers_it_still_has_a_gradient() -> None:
    trunk = TRUNKS["alex"]()
    for value in trunk.parameters():
        torch.nn.init.zeros_(value)
    distance = PerceptualDistance("alex", trunk, Heads(CHANNELS["alex"])).to(torch.device("cpu"))
    a = torch.rand(1, 3, 64, 64).requires_grad_(True)
    distance.of(a, torch.rand(1, 3, 64, 64)).sum().backward()
    assert a.grad is not None
    assert a.grad.isfinite().all()
