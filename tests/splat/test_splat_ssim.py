"""Fused SSIM against plain torch."""

import sys
from collections.abc import Generator
from types import SimpleNamespace

import pytest
import torch

from dreamdrive.splat import mean_ssim, set_threads, ssim, ssim_map, threads
from dreamdrive.splat.ssim import _fused_ssim, ssim_map_reference
from tests.fit.pretended import pretending
from tests.splat.scenes import relative


def pair(height: int, width: int) -> tuple[torch.Tensor, torch.Tensor]:
    g = torch.Generator().manual_seed(height)
    image = torch.rand(height, width, 3, generator=g, dtype=torch.float64)
    noise = torch.rand(height, width, 3, generator=g, dtype=torch.float64)
    return image, (0.7 * image + 0.3 * noise).roll(1, 1)


def with_gradients(function, image, target, dtype):
    a, b = image.to(dtype).requires_grad_(), target.to(dtype).requires_grad_()
    similarity = function(a, b)
    upstream = torch.randn(similarity.shape, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    (similarity * upstream.to(dtype)).sum().backward()
    return similarity, a.grad, b.grad


@pytest.mark.parametrize("size", [(37, 53), (1, 1), (3, 2), (12, 200), (70, 5), (64, 48)])
def test_value_and_gradients_agree_with_plain_torch(size):
    image, target = pair(*size)
    native = with_gradients(ssim_map, image, target, torch.float32)
    expected = with_gradients(ssim_map_reference, image, target, torch.float64)
    for value, wanted in zip(native, expected, strict=True):
        assert relative(value, wanted) < 1e-4


def test_gradcheck_of_the_plain_torch_twin():
    image, target = pair(4, 5)
    assert torch.autograd.gradcheck(ssim_map_reference, (image.requires_grad_(), target.requires_grad_()))


def test_equal_images_score_one_and_the_mean_is_the_maps():
    image = pair(40, 30)[0].float()
    assert ssim(image, image).item() == pytest.approx(1, abs=1e-6)
    other = image.flip(0)
    assert ssim(image, other).item() == pytest.approx(ssim_map(image, other).mean().item())


def test_thread_count_changes_no_bit():
    image, target = pair(120, 40)
    before, results = threads(), []
    try:
        for count in (1, 2, 3):
            set_threads(count)
            results.append(with_gradients(ssim_map, image, target, torch.float32))
    finally:
        set_threads(before)
    for other in results[1:]:
        assert all(torch.equal(a, b) for a, b in zip(results[0], other, strict=True))


def test_other_types_are_refused():
    image = torch.rand(8, 9, 3)
    with pytest.raises(ValueError, match="target"):
        ssim_map(image, torch.rand(8, 9, 3, dtype=torch.float64))


def of_mean(function, image, target):
    leaf = image.clone().requires_grad_()
    value = function(leaf, target)
    (3 * value).backward()
    return value.detach(), leaf.grad


def mean_of_the_map(image, target):
    return ssim_map_reference(image, target).mean()


@pytest.mark.parametrize("size", [(37, 53), (1, 1), (3, 2), (12, 70)])
def test_the_closed_gradient_of_the_mean_is_that_of_plain_torch(size):
    image, target = pair(*size)
    found, expected = (of_mean(each, image, target) for each in (mean_ssim, mean_of_the_map))
    for value, wanted in zip(found, expected, strict=True):
        torch.testing.assert_close(value, wanted, rtol=1e-8, atol=1e-12)
    assert mean_ssim(image, target) == found[0]


@pytest.fixture
def fused(monkeypatch: pytest.MonkeyPatch) -> Generator[SimpleNamespace, None, None]:
    """A package fused_ssim in plain torch, of what the real one computes; it counts how often it is used."""
    told = SimpleNamespace(calls=0, edge=0)

    def fused_ssim(image, target, padding="same", train=True):
        assert padding == "same"
        assert image.is_contiguous()
        assert target.is_contiguous()
        told.calls += 1
        whole = ssim_map_reference(*(each[0].permute(1, 2, 0) for each in (image, target)))
        return whole[told.edge : len(whole) - told.edge].mean()

    monkeypatch.setitem(sys.modules, "fused_ssim", SimpleNamespace(fused_ssim=fused_ssim))
    _fused_ssim.cache_clear()
    yield told
    _fused_ssim.cache_clear()


@pytest.mark.parametrize("edge", [0, 1])
def test_the_fused_kernel_is_taken_off_the_cpu_where_it_is_the_same(fused, edge):
    fused.edge = edge
    image, target = (each.float() for each in pair(20, 24))
    expected = of_mean(mean_of_the_map, image, target)
    assert of_mean(mean_ssim, image, target)[0] == pytest.approx(float(expected[0]))
    assert fused.calls == 0
    with pretending() as there:
        value, gradient = of_mean(mean_ssim, image.to(there), target.to(there))
        of_mean(mean_ssim, image.to(there), target.to(there))
    assert fused.calls == (3 if edge == 0 else 1)
    assert value.here.item() == pytest.approx(float(expected[0]), rel=1e-5)
    assert relative(gradient.here, expected[1]) < 1e-4
