import torch

from dreamdrive.fit.losses import disparity_loss, render_loss


def images() -> tuple[torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(1)
    return torch.rand(24, 32, 3, generator=generator), torch.rand(24, 32, 3, generator=generator)


def test_equal_images_cost_nothing_under_either_name():
    image, _ = images()
    for name in ("field", "paper"):
        assert render_loss(image, image, None, name).abs() < 1e-6


def test_the_paper_sums_without_weights():
    from dreamdrive.splat import ssim

    image, other = images()
    l1, similarity = (image - other).abs().mean(), ssim(image, other)
    torch.testing.assert_close(render_loss(image, other, None, "paper"), l1 + 1 - similarity)
    torch.testing.assert_close(render_loss(image, other, None, "field"), 0.8 * l1 + 0.2 * (1 - similarity))


def test_masked_pixels_neither_cost_nor_pull():
    image, other = images()
    mask = torch.zeros(24, 32, dtype=torch.bool)
    mask[:12] = True
    image.requires_grad_(True)
    changed = other.clone()
    changed[20:] = 0
    loss = render_loss(image, other, mask, "field")
    torch.testing.assert_close(loss, render_loss(image, changed, mask, "field"), atol=1e-2, rtol=0)
    loss.backward()
    assert (image.grad[12:] == 0).all()
    assert (image.grad[:12] != 0).any()


def test_disparity_compares_inverse_expected_depth():
    alpha = torch.full((2, 2), 0.5)
    depth = torch.full((2, 2), 5.0)  # expected depth 10 m
    weight = torch.tensor([[1.0, 0.0], [0.0, 0.0]])
    loss = disparity_loss(depth, alpha, torch.tensor([[5.0, 0.0], [0.0, 0.0]]), weight)
    torch.testing.assert_close(loss, torch.tensor(0.1))
