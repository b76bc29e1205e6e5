"""What splatting refuses, in which words, and how far a number that slips through may reach."""

import inspect
from contextlib import nullcontext

import pytest
import torch
from hypothesis import given, settings, strategies as st
from torch import Tensor

from dreamdrive import _native
from dreamdrive.splat import rasterize
from dreamdrive.splat.arguments import SplatArguments, check_shapes, check_values
from tests.splat.agreement import pull
from tests.splat.drawn import Case, build
from tests.splat.scenes import IMAGES, pinhole, random_scene, render_with_gradients

NAN, INF = float("nan"), float("inf")
FLOATS = ("means", "quaternions", "scales", "opacities", "sh", "channels", "screen_offsets_px")


def scene(n: int = 50) -> dict[str, Tensor]:
    return {name: value.float() for name, value in random_scene(n).items()}


def with_row(tensor: Tensor, value: float, row: int = 7) -> Tensor:
    changed = tensor.clone()
    changed[row] = value
    return changed


@pytest.mark.parametrize("backend", ["native", "reference"])
@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        *((name, NAN, "expected .*, got nan in row 7") for name in FLOATS),
        *((name, INF, "expected .*, got inf in row 7") for name in FLOATS),
        ("means", -2e30, r"expected finite numbers \(at most 1e\+30 in magnitude\), got -2e\+30 in row 7"),
        ("sh", 3e38, "expected finite numbers"),
        ("scales", -0.5, "expected finite numbers of at least 0, got -0.5 in row 7"),
        ("opacities", 1.5, "expected numbers from 0 to 1, got 1.5 in row 7"),
        ("opacities", -0.25, "expected numbers from 0 to 1, got -0.25 in row 7"),
        ("quaternions", 0.0, r"expected lengths from 1e-12 to 1e\+18, got 0 in row 7"),
        ("quaternions", 1e19, "expected lengths"),
        ("quaternions", 1e-14, "expected lengths"),
    ],
)
def test_numbers_of_no_use_are_refused_by_name_and_row(backend, name, value, message):
    given = scene()
    given[name] = with_row(given[name], value)
    with pytest.raises(ValueError, match=f"^{name}: {message}"):
        rasterize(**given, **pinhole(), backend=backend)


@pytest.mark.parametrize("backend", ["native", "reference"])
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda p: 2 * p, "not a rotation"),
        (lambda p: torch.zeros(4, 4), "not a rotation"),
        (lambda p: torch.diag(torch.tensor([-1.0, 1, 1, 1])) @ p, "not a rotation"),
        (lambda p: p + torch.tensor([[0.0, 0.02, 0, 0], [0] * 4, [0] * 4, [0] * 4]), "not a rotation"),
        (lambda p: p.index_fill(0, torch.tensor([3]), 1.0), "last row must be 0 0 0 1"),
        (lambda p: p.T, "last row must be 0 0 0 1"),
        (lambda p: p * NAN, "NaN or infinite"),
        (lambda p: p[:3], r"expected shape \(4, 4\), got \(3, 4\)"),
        (lambda p: torch.stack([p, 2 * p]), "not a rotation"),
    ],
)
def test_poses_that_are_not_rigid_are_refused(backend, change, message):
    given = scene()
    given["camera_from_world"] = change(given["camera_from_world"])
    with pytest.raises(ValueError, match=f"^camera_from_world: .*{message}"):
        rasterize(**given, **pinhole(), backend=backend)


@pytest.mark.parametrize("name", [*FLOATS, "camera_from_world"])
def test_other_types_are_refused_by_name(name):
    given = scene()
    check = inspect.unwrap(check_shapes)  # without the annotations, which users do not execute
    for dtype in (torch.int64, torch.bool, torch.complex64):
        with pytest.raises(ValueError, match=f"^{name}: expected a floating type, got {str(dtype)[6:]}"):
            check({**given, name: given[name].to(dtype)})
    with pytest.raises(ValueError, match=f"^{name}: expected a torch tensor, got list"):
        check({**given, name: given[name].tolist()})
    for dtype in (torch.float64, torch.float16):
        with pytest.raises(ValueError, match=f"^{name}: expected float32, got {str(dtype)[6:]}"):
            rasterize(**{**given, name: given[name].to(dtype)}, **pinhole())


@pytest.mark.parametrize("value", [0.0, -1.0, NAN, INF, 1e300])
@pytest.mark.parametrize("option", ["fx_px", "fy_px"])
def test_focal_lengths_that_float32_cannot_use_are_refused(option, value):
    with pytest.raises(ValueError, match=f"^{option}: expected a positive number of pixels up to 1e"):
        rasterize(**scene(), **{**pinhole(), option: value})


@pytest.mark.parametrize("value", [NAN, -INF, 1e300])
@pytest.mark.parametrize("option", ["cx_px", "cy_px"])
def test_principal_points_that_float32_cannot_use_are_refused(option, value):
    with pytest.raises(ValueError, match=f"^{option}: expected a number of pixels up to 1e"):
        rasterize(**scene(), **{**pinhole(), option: value})


SPECIAL = (
    0.0,
    -0.0,
    1.0,
    1e-45,
    -1e-45,
    1.0000001,
    -1.0,
    9e29,
    -9e29,
    2e30,
    1e-13,
    1e19,
    NAN,
    -NAN,
    INF,
    -INF,
)


@given(
    name=st.sampled_from(FLOATS),
    place=st.integers(0, 10**6),
    special=st.sampled_from(SPECIAL),
    whole_row=st.booleans(),
    n=st.sampled_from((1, 2, 17, 4095, 4097, 9000)),
)
@settings(max_examples=300)
def test_the_native_pass_finds_what_the_named_check_finds(name, place, special, whole_row, n):
    tensors = {
        "means": torch.zeros(n, 3),
        "quaternions": torch.ones(n, 4),
        "scales": torch.ones(n, 3),
        "opacities": torch.ones(n),
        "sh": torch.zeros(n, 4, 3),
        "channels": torch.zeros(n, 3),
        "screen_offsets_px": torch.zeros(n, 2),
    }
    if whole_row:
        tensors[name][place % n] = special
    else:
        tensors[name].view(-1)[place % tensors[name].numel()] = special
    arguments = SplatArguments(
        **tensors,
        camera_from_world=torch.eye(4),
        focal_px=(1.0, 1.0),
        centre_px=(0.0, 0.0),
        size_px=(1, 1),
        sh_degree=0,
    )
    usable = _native.all_usable(_native.gaussians(*tensors.values(), 0))
    with nullcontext() if usable else pytest.raises(ValueError, match=f"^{name}: expected "):
        check_values(arguments)


@pytest.mark.parametrize("name", [*FLOATS, "camera_from_world"])
def test_any_memory_layout_gives_the_same_bytes(name):
    given = scene()
    straight, by_straight = render_with_gradients(given)
    tensor = given[name]
    strided = torch.empty(*tensor.shape[:-1], 2 * tensor.shape[-1])[..., ::2].copy_(tensor)
    turned = tensor.movedim(0, -1).contiguous().movedim(-1, 0)
    offset = torch.cat([torch.zeros(1), tensor.flatten()])[1:].view(tensor.shape)
    for layout in (strided, turned, offset):
        leaf = layout.detach().requires_grad_()
        inputs = {k: leaf if k == name else v.clone().requires_grad_() for k, v in given.items()}
        out = rasterize(**inputs, **pinhole())
        assert all(torch.equal(getattr(out, image), getattr(straight, image)) for image in IMAGES)
        pulled(out).backward()
        assert all(torch.equal(value.grad, by_straight[k]) for k, value in inputs.items())


def pulled(out) -> Tensor:
    """The loss of ``render_with_gradients``, through gradients that are not contiguous."""
    g, loss = torch.Generator().manual_seed(7), torch.zeros(())
    for name in IMAGES:
        image = getattr(out, name)
        upstream = torch.randn(image.shape, generator=g, dtype=torch.float64).float()
        loss = loss + (image.transpose(0, 1) * upstream.transpose(0, 1).contiguous()).sum()
    return loss


def test_an_expanded_upstream_gradient_is_taken():
    given = scene()
    means = given.pop("means").requires_grad_()
    image = rasterize(means, **given, **pinhole()).colour
    (by_sum,) = torch.autograd.grad(image.sum(), means, retain_graph=True)
    (by_ones,) = torch.autograd.grad(image, means, torch.ones_like(image))
    assert torch.equal(by_sum, by_ones)


def test_a_change_between_forward_and_backward_is_noticed():
    given = scene()
    means = given.pop("means").requires_grad_()
    image = rasterize(means, **given, **pinhole()).colour
    given["scales"] *= 2
    with pytest.raises(RuntimeError, match="modified by an inplace operation"):
        image.sum().backward()


def test_the_largest_numbers_stay_on_their_own_pixels():
    """Colours and channels at the limit: pixels that the Gaussian does not reach keep every byte."""
    case = Case(5, n=40, size_px=(64, 48), degree=1, stored=1, channels=2)
    plain = {name: value.float() for name, value in build(case).items()}
    loud = {**plain, "sh": with_row(plain["sh"], 1e30), "channels": with_row(plain["channels"], 1e30)}
    quiet, shrill = (rasterize(**s, **case.camera()) for s in (plain, loud))
    changed = (shrill.channels != quiet.channels).any(-1)
    assert 0 < changed.double().mean() < 0.5
    assert torch.equal(shrill.colour[~changed], quiet.colour[~changed])
    assert all(torch.isfinite(getattr(shrill, name)).all() for name in IMAGES)


def test_nan_from_upstream_stays_near_its_pixel():
    """A NaN reaches the Gaussians of its pixel and the pose, and none that ends more than a tile away."""
    case = Case(11, n=200, size_px=(120, 90), degree=1, stored=1, channels=2)
    given, spot = build(case), (40, 60)
    reach = {}
    for name, radius in (("pixel", 0), ("tile", 16)):
        window = torch.zeros(90, 120, dtype=torch.bool)
        window[spot[0] - radius : spot[0] + radius + 1, spot[1] - radius : spot[1] + radius + 1] = True
        reach[name] = pull(case, given, window)[1]["channels"].any(1)
    inputs = {name: value.float().requires_grad_() for name, value in given.items()}
    out = rasterize(**inputs, **case.camera())
    upstream = torch.ones_like(out.colour)
    upstream[spot] = NAN
    out.colour.backward(upstream)
    assert reach["pixel"].any()
    assert not reach["tile"].all()
    for name, value in inputs.items():
        if name == "camera_from_world":
            assert value.grad.isnan().any()
        elif value.grad is not None:
            rows = value.grad.flatten(1).isnan() if value.grad.ndim > 1 else value.grad.isnan()[:, None]
            assert not rows[~reach["tile"]].any(), name
    assert inputs["means"].grad[reach["pixel"]].isnan().all()
