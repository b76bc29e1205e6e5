"""Inception-v3 for FID against torch-fidelity's, with seeded weights."""

from pathlib import Path

import pytest
import torch
from tests.evaluate.golden import Golden, relative, seeded_state
from torch import Tensor

from dreamdrive.evaluate.networks.inception import inception_features, load_inception
from dreamdrive.evaluate.networks.resize import resize


@pytest.fixture(scope="module")
def golden(golden_dir: Path) -> Golden:
    return Golden(golden_dir, "perceptual")


def test_golden_features_at_every_depth(golden: Golden, tmp_path: Path) -> None:
    settings = golden.values["inception"]
    state = seeded_state(settings["keys"], settings["seed"])
    torch.save(state, tmp_path / "inception.pth")
    network = load_inception(tmp_path / "inception.pth")
    means: dict[str, Tensor] = {}

    def keep(name: str, consumer: str) -> None:
        def pooled(module: object, inputs: tuple[Tensor]) -> None:
            means[name] = inputs[0].mean(dim=(2, 3))

        network.get_submodule(consumer).register_forward_pre_hook(pooled)

    for name, consumer in (("64", "Conv2d_3b_1x1"), ("192", "Mixed_5b"), ("768", "Mixed_7a")):
        keep(name, consumer)
    frames = golden.tensor("inception/x").permute(0, 2, 3, 1).contiguous()
    means["2048"] = inception_features(network, frames)
    means["logits_unbiased"] = means["2048"] @ state["fc.weight"].T
    for name, value in means.items():
        assert relative(value, golden.tensor(f"inception/{name}")) < 1e-4, name


@pytest.mark.parametrize(
    ("method", "name"), [("tf1", "inception/resized_sub"), ("torch", "inception/resized_pytorch_sub")]
)
def test_golden_bilinear_resizes(golden: Golden, method: str, name: str) -> None:
    frames = golden.tensor("inception/x").permute(0, 2, 3, 1).contiguous()
    got = resize(frames, 299, 299, method)[:, :, ::13, ::13]  # type: ignore[arg-type]
    assert relative(got, golden.tensor(name)) < 1e-5


def test_golden_clean_resize(golden: Golden) -> None:
    frames = golden.tensor("inception/x").permute(0, 2, 3, 1).contiguous()
    got = resize(frames[:1], 299, 299, "clean")[0].permute(1, 2, 0)[::13, ::13]
    assert relative(got, golden.tensor("resize/clean_pil_bicubic_sub")) < 1e-5
