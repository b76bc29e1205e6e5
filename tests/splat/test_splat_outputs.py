"""What a pass gives beyond the image: antialiasing, absolute gradients, weights, median depth, many views."""

import pytest
import torch

from dreamdrive.splat import rasterize
from tests.splat.scenes import IMAGES, pinhole, random_scene, relative, render_with_gradients


def small(scene: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """The same with footprints about as large as the blur, some of them needles."""
    return {**scene, "scales": scene["scales"] * torch.tensor([0.2, 0.05, 0.004])}


@pytest.mark.parametrize("seed", range(3))
def test_antialiased_value_and_gradients_agree(seed):
    scene = small(random_scene(150, seed=seed))
    value, gradients = render_with_gradients(scene, antialiased=True)
    expected, by_reference = render_with_gradients(scene, "reference", antialiased=True)
    for name in IMAGES:
        assert relative(getattr(value, name), getattr(expected, name)) < 1e-4, name
    for name, gradient in gradients.items():
        assert relative(gradient, by_reference[name]) < 1e-4, name


def test_reference_gradient_of_antialiasing_is_that_of_finite_differences():
    scene = small(random_scene(4, coefficients=1, channels=None, seed=2))
    scene["means"][:, 2] = scene["means"][:, 2].abs() + 2
    fixed = {k: scene.pop(k) for k in ("sh", "camera_from_world", "screen_offsets_px")}
    fixed["camera_from_world"] = torch.eye(4, dtype=torch.float64)

    def image(*values):
        named = dict(zip(scene, values, strict=True))
        drawn = rasterize(**named, **fixed, **pinhole(12, 9), antialiased=True, backend="reference")
        return drawn.colour

    scene["opacities"] = torch.full_like(scene["opacities"], 0.9)
    assert torch.autograd.gradcheck(image, [v.requires_grad_() for v in scene.values()], atol=1e-6)


def test_a_gaussian_twice_as_far_keeps_its_light_when_antialiased():
    def light(z: float, antialiased: bool) -> float:
        drawn = rasterize(
            torch.tensor([[0.0, 0.0, z]]), torch.tensor([[1.0, 0, 0, 0]]), torch.full((1, 3), 0.02),
            torch.tensor([0.8]), torch.zeros(1, 1, 3), torch.eye(4),
            **pinhole(80, 60), antialiased=antialiased,
        )  # fmt: skip
        return drawn.alpha.sum().item() * z * z

    # Its true area falls with the square of the distance; the blur makes it fall more slowly.
    assert light(8.0, False) > 1.5 * light(4.0, False)
    assert light(8.0, True) == pytest.approx(light(4.0, True), rel=0.15)


@pytest.mark.parametrize("seed", range(3))
def test_absolute_gradients_agree_and_bound_the_signed_ones(seed):
    scene = random_scene(150, seed=seed)
    scene["screen_absolute_px"] = torch.ones_like(scene["screen_offsets_px"])
    _, gradients = render_with_gradients(scene)
    _, by_reference = render_with_gradients(scene, "reference")
    for name, gradient in gradients.items():
        assert relative(gradient, by_reference[name]) < 1e-4, name
    excess = gradients["screen_absolute_px"] - gradients["screen_offsets_px"].abs()
    assert excess.min() > -1e-4 * gradients["screen_absolute_px"].max()


def test_asking_for_absolute_gradients_changes_no_bit():
    scene = random_scene(150, seed=4)
    plain, gradients = render_with_gradients(scene)
    more, with_absolute = render_with_gradients({**scene, "screen_absolute_px": scene["screen_offsets_px"]})
    assert all(torch.equal(getattr(plain, name), getattr(more, name)) for name in IMAGES)
    assert all(torch.equal(gradient, with_absolute[name]) for name, gradient in gradients.items())


@pytest.mark.parametrize("seed", range(3))
def test_median_depth_and_weights_agree(seed):
    scene = random_scene(150, seed=seed)
    scene["opacities"] = torch.where(torch.arange(150) % 3 == 0, 1.0, scene["opacities"])
    value, _ = render_with_gradients(scene, inspect=True)
    expected, _ = render_with_gradients(scene, "reference", inspect=True)
    assert value.median_depth_m is not None
    assert expected.median_depth_m is not None
    # A pixel half covered within rounding may take the next Gaussian.
    same = torch.isclose(value.median_depth_m.double(), expected.median_depth_m, rtol=1e-5, atol=1e-6)
    assert same.double().mean() > 0.995
    assert (value.median_depth_m > 0).any()
    assert relative(value.weight_sum_px, expected.weight_sum_px) < 1e-4
    assert relative(value.weight_most, expected.weight_most) < 1e-4


def test_weights_add_up_to_the_alpha():
    value, _ = render_with_gradients(random_scene(300, seed=5), camera=pinhole(150, 90), inspect=True)
    assert value.weight_sum_px is not None
    assert value.weight_sum_px.sum().item() == pytest.approx(value.alpha.sum().item(), rel=1e-5)


def test_inspecting_changes_no_bit_and_is_absent_unless_asked_for():
    scene = random_scene(150, seed=6)
    plain, gradients = render_with_gradients(scene)
    more, with_inspection = render_with_gradients(scene, inspect=True)
    assert plain.median_depth_m is None
    assert plain.weight_sum_px is None
    assert all(torch.equal(getattr(plain, name), getattr(more, name)) for name in IMAGES)
    assert all(torch.equal(gradient, with_inspection[name]) for name, gradient in gradients.items())


def test_expected_depth_is_that_of_what_covers_the_pixel():
    scene = random_scene(200, seed=7)
    value, _ = render_with_gradients(scene)
    expected = value.expected_depth_m()
    covered = value.alpha > 1e-3
    assert torch.allclose(expected[covered] * value.alpha[covered], value.depth_m[covered], rtol=1e-5)
    assert (expected[~covered] == 0).all()


@pytest.mark.parametrize("backend", ["native", "reference"])
def test_several_views_are_those_of_each_alone(backend):
    scene = {k: v.float() for k, v in random_scene(120, seed=8).items()}
    poses = scene.pop("camera_from_world").repeat(3, 1, 1)
    poses[1, 0, 3] += 0.2
    poses[2, 2, 3] += 0.5
    poses.requires_grad_()
    scene["means"].requires_grad_()
    drawn = rasterize(**scene, camera_from_world=poses, **pinhole(), inspect=True, backend=backend)
    assert drawn.colour.shape == (3, 37, 53, 3)
    assert drawn.visible.shape == (3, 120)
    together = torch.autograd.grad(drawn.colour.square().sum(), [scene["means"], poses])
    alone = []
    for i, pose in enumerate(poses):
        one = rasterize(**scene, camera_from_world=pose, **pinhole(), inspect=True, backend=backend)
        assert torch.equal(one.colour, drawn.colour[i])
        assert drawn.weight_sum_px is not None
        assert one.weight_sum_px is not None
        assert torch.equal(one.weight_sum_px, drawn.weight_sum_px[i])
        alone.append(torch.autograd.grad(one.colour.square().sum(), [scene["means"], poses]))
    for k in range(2):
        assert relative(together[k], torch.stack([grads[k] for grads in alone]).sum(0)) < 1e-6
