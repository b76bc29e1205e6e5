"""Promises of the compiled backend beyond its values: threads, exact zeros, refusals."""

import numpy as np
import pytest
import torch

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.splat import native_info, rasterize, render, set_threads, threads
from tests.splat.scenes import IMAGES, pinhole, random_scene, relative, render_with_gradients


def test_thread_count_changes_no_bit():
    scene = random_scene(3000, seed=2)
    before, results = threads(), []
    try:
        for count in (1, 2, 3):
            set_threads(count)
            assert native_info()["threads"] == count
            value, gradients = render_with_gradients(scene, camera=pinhole(150, 90))
            results.append([getattr(value, name) for name in IMAGES] + list(gradients.values()))
    finally:
        set_threads(before)
    for other in results[1:]:
        assert all(torch.equal(a, b) for a, b in zip(results[0], other, strict=True))
    with pytest.raises(ValueError, match="threads"):
        set_threads(0)


def test_unseen_gaussians_have_exactly_zero_gradients():
    value, gradients = render_with_gradients(random_scene(400, seed=4))
    assert 0 < value.visible.sum() < 400
    for name, gradient in gradients.items():
        if name != "camera_from_world":
            assert gradient[~value.visible].abs().sum() == 0, name


def test_two_renders_before_either_backward():
    scene = {k: v.float() for k, v in random_scene(100, channels=None).items()}
    means = scene.pop("means").requires_grad_()
    outputs = [rasterize(means, **scene, **pinhole(w, 30)).colour.sum() for w in (20, 50)]
    together = torch.autograd.grad(outputs[0] + outputs[1], means, retain_graph=True)[0]
    alone = [torch.autograd.grad(out, means, retain_graph=True)[0] for out in outputs]
    assert relative(alone[0] + alone[1], together) < 1e-6


def test_non_contiguous_and_integer_looking_inputs():
    scene = {k: v.float() for k, v in random_scene(50, channels=None).items()}
    straight = rasterize(**scene, **pinhole()).colour
    scene["means"] = scene["means"].T.contiguous().T
    assert torch.equal(rasterize(**scene, **pinhole()).colour, straight)


def test_render_activates_the_stored_parameters():
    scene = {k: v.float() for k, v in random_scene(60, channels=None, seed=5).items()}
    gaussians = Gaussians(
        means=scene["means"],
        quaternions=scene["quaternions"],
        log_scales=scene["scales"].log(),
        logit_opacities=torch.logit(scene["opacities"]),
        sh=scene["sh"],
        source_frame=torch.zeros(60, dtype=torch.int64),
    )
    world_from_camera = np.linalg.inv(random_scene(seed=5)["camera_from_world"].numpy())
    camera = Camera(**pinhole(), world_from_camera=world_from_camera)
    del scene["screen_offsets_px"]
    assert relative(render(gaussians, camera).colour, rasterize(**scene, **pinhole()).colour) < 1e-5


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("means", lambda t: t[:, :2], r"means: expected shape \(50, 3\), got \(50, 2\)"),
        ("quaternions", lambda t: t[:-1], r"quaternions: expected shape \(50, 4\), got \(49, 4\)"),
        ("scales", lambda t: t[:, 0], r"scales: expected shape"),
        ("opacities", lambda t: t[:, None], r"opacities: expected shape \(50,\)"),
        ("sh", lambda t: t[:, :5], "sh: expected 1, 4, 9 or 16 coefficients"),
        ("camera_from_world", lambda t: t[:3], r"camera_from_world: expected shape \(4, 4\)"),
        ("channels", lambda t: t[:, 0], "channels: expected shape"),
        ("screen_offsets_px", lambda t: t[:, :1], "screen_offsets_px: expected shape"),
        ("means", lambda t: t.double(), "means: expected float32, got float64"),
        ("scales", lambda t: t.to("meta"), "scales: expected a tensor on the CPU, got one on meta"),
        ("means", lambda t: t.index_fill(0, torch.tensor([3]), float("nan")), "means: expected finite"),
        ("sh", lambda t: t.index_fill(0, torch.tensor([49]), float("inf")), "sh: expected finite"),
    ],
)
def test_wrong_tensors_are_refused_by_name(name, change, message):
    scene = {k: v.float() for k, v in random_scene(50).items()}
    scene[name] = change(scene[name])
    with pytest.raises(ValueError, match=message):
        rasterize(**scene, **pinhole())


@pytest.mark.parametrize(
    ("option", "value"),
    [("fx_px", 0.0), ("fy_px", float("nan")), ("cx_px", float("inf")), ("width_px", 0), ("height_px", 10**6),
     ("sh_degree", 4), ("sh_degree", -1), ("backend", "cuda")],
)  # fmt: skip
def test_wrong_options_are_refused_by_name(option, value):
    scene = {k: v.float() for k, v in random_scene(5).items()}
    with pytest.raises(ValueError, match=option):
        rasterize(**scene, **{**pinhole(), option: value})
    if option == "backend":
        with pytest.raises(ValueError, match="native, reference"):
            rasterize(**scene, **pinhole(), backend=value)


def test_absurd_gaussians_do_no_harm():
    scene = {k: v.float() for k, v in random_scene(50).items()}
    scene["scales"][:10] = 1e25
    scene["scales"][10:20] = 0
    scene["means"][25:30] *= 1e20
    scene["opacities"][30:40] = 0
    value, gradients = render_with_gradients(scene)
    assert all(torch.isfinite(getattr(value, name)).all() for name in IMAGES)
    assert all(torch.isfinite(gradient).all() for gradient in gradients.values())
