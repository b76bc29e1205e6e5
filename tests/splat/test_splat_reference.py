"""The compiled backend against the plain-torch one, and that one against finite differences."""

import pytest
import torch

from dreamdrive.splat import rasterize
from tests.splat.scenes import IMAGES, pinhole, random_scene, relative, render_with_gradients


def assert_backends_agree(scene, **options):
    value, gradients = render_with_gradients(scene, "native", **options)
    expected, expected_gradients = render_with_gradients(scene, "reference", **options)
    for name in IMAGES:
        if getattr(expected, name).numel():
            assert relative(getattr(value, name), getattr(expected, name)) < 1e-4, name
    for name, gradient in gradients.items():
        if expected_gradients[name].norm() == 0:
            assert gradient.abs().sum() == 0, name
        else:
            assert relative(gradient, expected_gradients[name]) < 1e-4, name
    assert (value.visible | ~expected.visible).all()
    return value, gradients


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("size", [(53, 37), (16, 16), (7, 40), (64, 33)])
def test_value_and_every_gradient_agree(seed, size):
    assert_backends_agree(random_scene(150, seed=seed), camera=pinhole(*size))


@pytest.mark.parametrize("degree", range(4))
def test_every_sh_degree_agrees(degree):
    assert_backends_agree(random_scene(100, coefficients=(degree + 1) ** 2, seed=degree))


@pytest.mark.parametrize("degree", range(4))
def test_lower_active_degree_leaves_higher_coefficients_without_gradient(degree):
    _, gradients = assert_backends_agree(random_scene(80, seed=3), sh_degree=degree)
    assert gradients["sh"][:, (degree + 1) ** 2 :].abs().sum() == 0
    assert gradients["sh"][:, : (degree + 1) ** 2].abs().sum() > 0


@pytest.mark.parametrize("channels", [None, 0, 1, 5, 17])
def test_any_number_of_extra_channels(channels):
    value, _ = assert_backends_agree(random_scene(80, coefficients=1, channels=channels, seed=5))
    assert value.channels.shape == (37, 53, channels or 0)


@pytest.mark.parametrize("image", IMAGES)
def test_gradient_of_one_output_alone(image):
    assert_backends_agree(random_scene(80, seed=6), images=(image,))


def test_opaque_stacks_stop_and_cap_alike():
    scene = random_scene(150, seed=8)
    scene["opacities"] = torch.where(torch.arange(150) % 2 == 0, 1.0, scene["opacities"])
    scene["scales"] = 2 * scene["scales"]
    value, _ = assert_backends_agree(scene)
    assert value.alpha.max() > 0.999


def test_wide_thin_and_near_gaussians():
    scene = random_scene(120, seed=9)
    scene["scales"][::3, 0] *= 60
    scene["scales"][1::3] *= 0.02
    scene["means"][::4, 2] -= 3
    assert_backends_agree(scene)


def test_equal_depths_keep_index_order():
    scene = random_scene(2, coefficients=1, channels=None)
    scene["means"] = torch.tensor([[0.0, 0, 3], [0, 0, 3]], dtype=torch.float64)
    scene["camera_from_world"] = torch.eye(4, dtype=torch.float64)
    scene["opacities"] = torch.full((2,), 0.9, dtype=torch.float64)
    value, _ = assert_backends_agree(scene)
    swapped = {k: v if k == "camera_from_world" else v.flip(0) for k, v in scene.items()}
    assert relative(render_with_gradients(swapped)[0].colour, value.colour) > 1e-3


@pytest.mark.parametrize("backend", ["native", "reference"])
@pytest.mark.parametrize("n", [0, 40])
def test_nothing_in_view_gives_an_empty_image_and_zero_gradients(backend, n):
    scene = random_scene(n)
    scene["means"] = scene["means"] - torch.tensor([0.0, 0, 60])
    value, gradients = render_with_gradients(scene, backend)
    assert all(getattr(value, name).abs().sum() == 0 for name in IMAGES)
    assert not value.visible.any()
    assert all(g.abs().sum() == 0 for g in gradients.values())


def test_gradcheck_of_the_reference():
    scene = random_scene(4, coefficients=9, channels=1, seed=1)
    scene["means"] = scene["means"] * 0.3 + torch.tensor([0.0, 0, 2])
    names = list(scene)

    def images(*values):
        out = rasterize(**dict(zip(names, values, strict=True)), **pinhole(4, 3), backend="reference")
        return tuple(getattr(out, name) for name in IMAGES)

    assert torch.autograd.gradcheck(images, [scene[name].clone().requires_grad_() for name in names])
