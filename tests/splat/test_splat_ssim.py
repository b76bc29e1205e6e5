"""Fused SSIM against plain torch."""

import pytest
import torch

from dreamdrive.splat import set_threads, ssim, ssim_map, threads
from dreamdrive.splat.ssim import ssim_map_reference
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
