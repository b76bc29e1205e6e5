"""Inception-v3 for FID against torch-fidelity's, with seeded weights."""

from pathlib import Path

import pytest
import torch
from torch import Tensor

from dreamdrive.evaluate.networks.inception import inception_features, load_inception
from dreamdrive.evaluate.networks.resize import Resize, resize
from tests.evaluate.networks.seeded import seeded_state
from tests.golden.reading import close, tensors, values

LIMIT = 1e-4
"""Of the largest value: float32 through 90 layers with weights of no use, where 1e-6 was seen."""
FILE = "eval/perceptual.npz"


def pictures() -> Tensor:
    return tensors(FILE)["inception/x"].permute(0, 2, 3, 1).contiguous()


def test_golden_features_at_every_depth(tmp_path: Path) -> None:
    settings = values("eval/perceptual.json")["inception"]
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
    means["2048"] = inception_features(network, pictures())
    means["logits_unbiased"] = means["2048"] @ state["fc.weight"].T
    for name, value in means.items():
        close(value, tensors(FILE)[f"inception/{name}"], LIMIT, name)


@pytest.mark.parametrize(
    ("method", "name"), [("tf1", "inception/resized_sub"), ("torch", "inception/resized_pytorch_sub")]
)
def test_golden_bilinear_resizes(method: Resize, name: str) -> None:
    close(resize(pictures(), 299, 299, method)[:, :, ::13, ::13], tensors(FILE)[name], 1e-5)


def test_golden_clean_resize() -> None:
    got = resize(pictures()[:1], 299, 299, "clean")[0].permute(1, 2, 0)[::13, ::13]
    close(got, tensors(FILE)["resize/clean_pil_bicubic_sub"], 1e-5)
