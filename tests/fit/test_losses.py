"""The losses against their definitions in plain torch, and what they are for."""

from collections.abc import Callable

import pytest
import torch

from dreamdrive.fit.losses import geometry_loss, render_loss
from dreamdrive.splat import set_threads, ssim, threads
from dreamdrive_bench.splat import plain_step as plain
from tests.splat.scenes import relative


def images(height: int = 75, width: int = 32) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Two images and a mask, in float64."""
    generator = torch.Generator().manual_seed(height)
    image = torch.rand(height, width, 3, generator=generator, dtype=torch.float64)
    other = 0.6 * image + 0.4 * torch.rand(height, width, 3, generator=generator, dtype=torch.float64)
    return image, other, torch.rand(height, width, generator=generator) > 0.3


def geometry(height: int = 75, width: int = 67) -> tuple[torch.Tensor, ...]:
    """Depth sum, alpha, reference, weight and sky, in float64; some without depth, cover or trust."""
    generator = torch.Generator().manual_seed(width)

    def uniform() -> torch.Tensor:
        return torch.rand(height, width, generator=generator, dtype=torch.float64)

    alpha = uniform() * (uniform() > 0.1)
    depth, reference = 20 * uniform() * alpha, 20 * uniform() + 1
    weight = uniform() * (uniform() > 0.4)
    return depth, alpha, torch.where(weight > 0, reference, 0.0), weight, uniform() > 0.7


def with_gradient(
    loss: Callable[..., torch.Tensor], learned: list[torch.Tensor], *others: object
) -> list[torch.Tensor]:
    leaves = [value.clone().requires_grad_() for value in learned]
    value = loss(*leaves, *others)
    return [value.detach(), *torch.autograd.grad(3 * value, leaves)]


@pytest.mark.parametrize("name", ["field", "paper"])
@pytest.mark.parametrize("size", [(75, 32), (3, 2), (34, 9)])
def test_render_loss_agrees_with_plain_torch(name, size) -> None:
    image, other, mask = images(*size)
    ours = with_gradient(render_loss, [image.float()], other.float(), mask, name)
    expected = with_gradient(plain.render_loss, [image], other, mask, name)
    for value, wanted in zip(ours, expected, strict=True):
        assert relative(value, wanted) < 1e-4


def test_geometry_loss_agrees_with_plain_torch() -> None:
    *tensors, sky = geometry()
    single = [t.float() for t in tensors]
    ours = with_gradient(geometry_loss, single[:2], *single[2:], sky, 0.5, 0.05)
    expected = with_gradient(plain.geometry_loss, tensors[:2], *tensors[2:], sky, 0.5, 0.05)
    for value, wanted in zip(ours, expected, strict=True):
        torch.testing.assert_close(value.double(), wanted, rtol=1e-5, atol=1e-9)


def test_gradcheck_of_the_plain_twins() -> None:
    image, other, mask = images(4, 5)
    assert torch.autograd.gradcheck(
        lambda x: plain.render_loss(x, other, mask, "field"), image.requires_grad_()
    )
    depth, alpha, *others = geometry(3, 4)
    learned = (depth + 0.5).requires_grad_(), (0.9 * alpha + 0.05).requires_grad_()
    assert torch.autograd.gradcheck(lambda d, a: plain.geometry_loss(d, a, *others, 0.5, 0.05), learned)


def test_thread_count_changes_no_bit() -> None:
    image, other, mask = (t if t.dtype == torch.bool else t.float() for t in images(120, 40))
    *tensors, sky = (t if t.dtype == torch.bool else t.float() for t in geometry(120, 80))
    before, results = threads(), []
    try:
        for count in (1, 2, 3):
            set_threads(count)
            results.append(
                with_gradient(render_loss, [image], other, mask, "field")
                + with_gradient(geometry_loss, tensors[:2], *tensors[2:], sky, 0.5, 0.05)
            )
    finally:
        set_threads(before)
    for result in results[1:]:
        assert all(torch.equal(a, b) for a, b in zip(results[0], result, strict=True))


def test_equal_images_cost_nothing_under_either_name() -> None:
    image = images()[0].float()
    for name in ("field", "paper"):
        assert render_loss(image, image, None, name).abs() < 1e-6


def test_the_paper_sums_without_weights() -> None:
    image, other = (value.float() for value in images()[:2])
    l1, similarity = (image - other).abs().mean(), ssim(image, other)
    torch.testing.assert_close(render_loss(image, other, None, "paper"), l1 + 1 - similarity)
    torch.testing.assert_close(render_loss(image, other, None, "field"), 0.8 * l1 + 0.2 * (1 - similarity))


def test_masked_pixels_neither_cost_nor_pull() -> None:
    image, other = (value.float() for value in images(24, 32)[:2])
    mask = torch.zeros(24, 32, dtype=torch.bool)
    mask[:12] = True
    changed = other.clone()
    changed[20:] = 0
    loss, gradient = with_gradient(lambda x: render_loss(x, other, mask, "field"), [image])
    torch.testing.assert_close(loss, render_loss(image, changed, mask, "field"), atol=1e-2, rtol=0)
    assert (gradient[12:] == 0).all()
    assert (gradient[:12] != 0).any()


def test_disparity_compares_inverse_expected_depth() -> None:
    alpha = torch.full((2, 2), 0.5)
    depth = torch.full((2, 2), 5.0)  # expected depth 10 m
    weight = torch.tensor([[1.0, 0.0], [0.0, 0.0]])
    reference, sky = torch.tensor([[5.0, 0.0], [0.0, 0.0]]), torch.zeros(2, 2, dtype=torch.bool)
    loss = geometry_loss(depth, alpha, reference, weight, sky, 1.0, 7.0)
    torch.testing.assert_close(loss, torch.tensor(0.1))


def test_cover_costs_in_the_sky_only() -> None:
    alpha, nothing = torch.tensor([[0.5, 0.25]]), torch.zeros(1, 2)
    loss = geometry_loss(nothing, alpha, nothing, nothing, torch.tensor([[True, False]]), 1.0, 0.1)
    torch.testing.assert_close(loss, torch.tensor(0.1 * 0.5 / 2))


def test_what_gets_no_gradient_or_is_not_float32_is_refused() -> None:
    image, other, mask = images()
    with pytest.raises(ValueError, match="image: expected float32"):
        render_loss(image, other, mask, "field")
    with pytest.raises(ValueError, match="reference"):
        render_loss(image.float(), other.float().requires_grad_(), mask, "field")
