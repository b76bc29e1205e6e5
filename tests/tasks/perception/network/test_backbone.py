"""The trunk against the package it is named after, with seeded weights."""

import numpy as np
import pytest
import torch

from dreamdrive.tasks.perception import EfficientNetFront
from dreamdrive.tasks.perception.network.backbone import MbConv, PaddedConv
from tests.evaluate.networks.seeded import seeded_state
from tests.golden.reading import close, tensors, values

PREFIX = "encoder.backbone."
TABLE, NUMBERS = "eval/cvt_efficientnet_b4.json", "eval/cvt_efficientnet_b4.npz"
SEED, SIZE = 123, (224, 480)


def test_golden_features() -> None:
    every = values("eval/cvt_official_state_dict.json")
    shapes = {key.removeprefix(PREFIX): shape for key, shape in every.items() if key.startswith(PREFIX)}
    trunk = EfficientNetFront()
    assert not trunk.load_state_dict(seeded_state(shapes, SEED), strict=False).unexpected_keys
    rng = np.random.RandomState(SEED)
    counters = ("num_batches_tracked",)
    rng.standard_normal(sum(int(np.prod(s)) for key, s in shapes.items() if not key.endswith(counters)))
    pictures = torch.from_numpy(rng.rand(1, 3, *SIZE).astype(np.float32))
    with torch.no_grad():
        fine, coarse = trunk.eval()(pictures)
    assert [list(each.shape) for each in (fine, coarse)] == values(TABLE)["output_shapes"]
    wanted = tensors(NUMBERS)
    close(fine[:, ::4, ::8, ::8], wanted["f0_sub"], 1e-6)
    close(coarse[:, ::4, ::2, ::3], wanted["f1_sub"], 1e-5)
    for name, found in (("f0_mean_std", fine), ("f1_mean_std", coarse)):
        close(torch.stack([found.mean(), found.std()]), wanted[name], 1e-5, name)


def test_golden_convolutions() -> None:
    modules = dict(EfficientNetFront().named_modules())
    for name, channels, out, kernel, stride, groups, pads in values(TABLE)["convs"]:
        conv = modules[name]
        assert isinstance(conv, torch.nn.Conv2d)
        assert (conv.in_channels, conv.out_channels, conv.groups) == (channels, out, groups)
        assert (list(conv.kernel_size), list(conv.stride)) == (kernel, stride)
        found = conv.pads if isinstance(conv, PaddedConv) else (0, 0, 0, 0)
        assert list(found) == pads, name


@pytest.mark.parametrize(("size", "coarse"), [((96, 208), (6, 13)), ((224, 480), (14, 30))])
def test_strides_are_4_and_16(size: tuple[int, int], coarse: tuple[int, int]) -> None:
    trunk = EfficientNetFront(0.25).eval()
    with torch.no_grad():
        features = trunk(torch.rand(1, 3, *size))
    assert [each.shape[1] for each in features] == list(trunk.channels) == [8, 32]
    assert features[0].shape[2:] == (size[0] // 4, size[1] // 4)
    assert features[1].shape[2:] == coarse


def test_a_dropped_sample_keeps_its_input_alone() -> None:
    torch.manual_seed(0)
    block = MbConv(8, 8, 3, 1, 2, 10, drop=0.5).train()
    x = torch.rand(64, 8, 4, 4)
    out = block(x)
    kept = (out - x).abs().amax(dim=(1, 2, 3)) > 0
    assert 20 < int(kept.sum()) < 44
    block.eval()
    assert bool(((block(x) - x).abs().amax(dim=(1, 2, 3)) > 0).all())


def test_half_precision_is_near_and_can_be_learned_from() -> None:
    torch.manual_seed(0)
    trunk = EfficientNetFront(0.5).train()
    pictures = torch.randn(2, 3, 32, 64)
    exact = trunk(pictures)[0]
    with torch.autocast("cpu", torch.bfloat16):
        near = trunk(pictures)[0]
    assert near.dtype == torch.bfloat16
    assert float((near - exact).detach().norm() / exact.detach().norm()) < 0.1
    near.float().sum().backward()
    assert all(each.grad is not None for each in trunk.layers[1].parameters())
