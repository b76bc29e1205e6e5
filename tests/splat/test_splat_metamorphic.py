"""What must not change an image, and what must change it in a known way."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import torch
from hypothesis import given, settings, strategies as st
from torch import Tensor

from dreamdrive.motion import multiply_quaternions
from dreamdrive.scene.render import Render
from dreamdrive.splat import rasterize, set_threads, threads
from tests.splat.agreement import (
    assert_gradients_agree,
    assert_images_agree,
    edges,
    pull,
)
from tests.splat.drawn import KINDS, Case, build, cases, random_rotation, select
from tests.splat.scenes import IMAGES

UNTIED = tuple(kind for kind in KINDS if kind != "tied")
ALL = torch.ones((), dtype=torch.bool)


def assert_same_bytes(a: tuple[Render, dict[str, Tensor]], b: tuple[Render, dict[str, Tensor]]) -> None:
    for one, other in zip(a, b, strict=True):
        one, other = (part if isinstance(part, dict) else vars(part) for part in (one, other))
        for name, tensor in one.items():
            assert tensor is other[name] is None or torch.equal(tensor, other[name]), name


def joined(a: dict[str, Tensor], b: dict[str, Tensor]) -> dict[str, Tensor]:
    """Two scenes before one camera."""
    return {k: v if k == "camera_from_world" else torch.cat([v, b[k]]) for k, v in a.items()}


@given(cases(UNTIED), st.randoms(use_true_random=False))
@settings(max_examples=20)
def test_the_order_of_gaussians_in_memory_does_not_matter(case, random):
    scene = build(case)
    rows = list(range(len(scene["means"])))
    random.shuffle(rows)
    value, gradients = pull(case, scene, ALL)
    shuffled, by_shuffled = pull(case, select(scene, torch.tensor(rows, dtype=torch.int64)), ALL)
    for name in IMAGES:
        assert torch.equal(getattr(value, name), getattr(shuffled, name)), name
    for name in ("visible", "weight_sum_px", "weight_most"):
        if case.inspect or name == "visible":
            assert torch.equal(getattr(value, name)[rows], getattr(shuffled, name)), name
    for name, gradient in select(gradients, torch.tensor(rows, dtype=torch.int64)).items():
        if name == "camera_from_world":  # a sum over Gaussians in the order of memory
            torch.testing.assert_close(
                gradient, by_shuffled[name], rtol=1e-3, atol=1e-3 * gradient.abs().max()
            )
        else:
            assert torch.equal(gradient, by_shuffled[name]), name


def test_equal_depths_keep_index_order_among_many():
    """All on one plane before an unrotated camera; the reference sorts stably."""
    case = Case(3, n=50, degree=0, stored=0, size_px=(37, 29))
    scene = build(case)
    scene["camera_from_world"] = torch.eye(4, dtype=torch.float64)
    scene["means"] = scene["means"] % 1 - 0.5
    scene["means"][:, 2] = 2
    where = edges(case, scene)
    value, gradients = pull(case, scene, where.sure)
    expected, expected_gradients = pull(case, scene, where.sure, "reference")
    assert_images_agree(value, expected, where)
    assert_gradients_agree(gradients, expected_gradients, where)
    turned = pull(case, select(scene, torch.arange(len(scene["means"])).flip(0)), where.sure)[0]
    assert (turned.colour - value.colour).abs().max() > 0.01


@given(cases())
@settings(max_examples=20)
def test_nothing_behind_an_opaque_wall_counts(case):
    """Two sheets: the first leaves 0.001 of the light; the second would leave 1e-6 and ends every pixel."""
    scene = build(case)
    pose = scene["camera_from_world"]
    in_camera = torch.tensor([[0.0, 0, 0.3], [0, 0, 0.31]], dtype=torch.float64)
    wall = {k: v if k == "camera_from_world" else v.new_ones(2, *v.shape[1:]) for k, v in scene.items()}
    wall["means"] = (in_camera - pose[:3, 3]) @ pose[:3, :3]
    wall["scales"] = 1e4 * wall["scales"]
    hidden = select(scene, scene["means"] @ pose[2, :3] + pose[2, 3] > 0.32)
    alone, by_wall = pull(case, wall, ALL)
    assert (alone.alpha > 0.99).all()
    together, by_both = pull(case, joined(wall, hidden), ALL)
    for name in IMAGES:
        assert torch.equal(getattr(alone, name), getattr(together, name)), name
    for name, gradient in by_both.items():
        if name != "camera_from_world":
            assert torch.equal(gradient[:2], by_wall[name]), name
            assert not gradient[2:].any(), name


@given(cases(UNTIED), st.integers(0, 2**20))
@settings(max_examples=20)
def test_moving_camera_and_world_together_changes_nothing(case, seed):
    """Colours of degree 0: higher harmonics would have to be rotated too."""
    case = replace(case, degree=0, stored=0)
    scene = build(case)
    where = edges(case, scene)
    turn, quaternion = random_rotation(seed)
    shift = torch.tensor([0.5, -0.25, 1.0], dtype=torch.float64)
    moved = dict(scene)
    moved["means"] = scene["means"] @ turn.T + shift
    moved["quaternions"] = multiply_quaternions(
        quaternion.expand(len(scene["means"]), 4), scene["quaternions"]
    )
    world_from_moved = torch.eye(4, dtype=torch.float64)
    world_from_moved[:3, :3], world_from_moved[:3, 3] = turn.T, -turn.T @ shift
    moved["camera_from_world"] = scene["camera_from_world"] @ world_from_moved
    value, gradients = pull(case, scene, where.sure)
    expected, by_moved = pull(case, moved, where.sure)
    assert_images_agree(value, expected, where)
    by_moved["means"] = (by_moved["means"].double() @ turn).float()
    for turned in ("quaternions", "camera_from_world"):
        del gradients[turned]
    assert_gradients_agree(gradients, by_moved, where)


@given(cases(("plain", "needle", "opaque", "near", "tied")), st.data())
@settings(max_examples=20)
def test_a_crop_is_rendered_by_shifting_the_principal_point(case, data):
    """Of Gaussians whose centres lie in the crop: the clamp of x/z belongs to the image that is rendered."""
    scene = build(case)
    (width, height), camera = case.size_px, case.camera()
    left, top = data.draw(st.integers(0, width - 1)), data.draw(st.integers(0, height - 1))
    size = (data.draw(st.integers(1, width - left)), data.draw(st.integers(1, height - top)))
    in_camera = scene["means"] @ scene["camera_from_world"][:3, :3].T + scene["camera_from_world"][:3, 3]
    focal = torch.tensor([camera["fx_px"], camera["fy_px"]])
    centre = in_camera[:, :2] / in_camera[:, 2:] * focal + torch.tensor([camera["cx_px"], camera["cy_px"]])
    corner = torch.tensor([left, top])
    inside = ((centre >= corner) & (centre <= corner + torch.tensor(size))).all(1)
    scene = select(scene, inside)
    where = edges(case, scene)
    whole = rasterize(**floats(scene), **camera, sh_degree=case.degree)
    shifted = {"cx_px": camera["cx_px"] - left, "cy_px": camera["cy_px"] - top}
    cropped = camera | shifted | {"width_px": size[0], "height_px": size[1]}
    crop = rasterize(**floats(scene), **cropped, sh_degree=case.degree)
    rows, columns = slice(top, top + size[1]), slice(left, left + size[0])
    cut = Render(**{n: getattr(whole, n)[rows, columns] for n in IMAGES}, visible=whole.visible)
    assert_images_agree(crop, cut, where.cropped(rows, columns))


def floats(scene: dict[str, Tensor]) -> dict[str, Tensor]:
    return {name: value.float() for name, value in scene.items()}


@given(cases(most=200))
@settings(max_examples=15)
def test_thread_count_changes_no_byte(case):
    scene, before = build(case), threads()
    results = []
    try:
        for count in (1, 2, 3):
            set_threads(count)
            results.append(pull(case, scene, ALL))
    finally:
        set_threads(before)
    assert_same_bytes(results[0], results[1])
    assert_same_bytes(results[0], results[2])


def test_renders_at_the_same_time_do_not_mix():
    """Two Python threads share the core's pool and its store of buffers."""
    cases_at_once = [Case(k, 60 + k, channels=k % 3, size_px=(30 + k, 20), inspect=True) for k in range(8)]
    alone = [pull(case, build(case), ALL) for case in cases_at_once]
    with ThreadPoolExecutor(2) as pool:
        together = list(pool.map(lambda case: pull(case, build(case), ALL), cases_at_once))
    for one, other in zip(alone, together, strict=True):
        assert_same_bytes(one, other)


def test_buffers_of_a_huge_scene_leave_no_trace():
    """Work space is kept from call to call: small, then huge in every respect, then small again."""
    every = {"absolute": True, "inspect": True}
    small = [Case(k, n=30, degree=1, stored=2, channels=k, size_px=(20 + k, 9), **every) for k in range(4)]
    huge = Case(9, 20_000, ("plain", "huge"), (300, 200), degree=3, stored=3, channels=7, **every)
    fresh = [pull(case, build(case), ALL) for case in small]
    pull(huge, build(huge), ALL)
    for case, expected in zip(small, fresh, strict=True):
        assert_same_bytes(pull(case, build(case), ALL), expected)


@given(cases())
@settings(max_examples=15)
def test_twice_the_upstream_gradient_is_exactly_twice_the_gradient(case):
    scene = build(case)
    (value, once), (again, twice) = pull(case, scene, ALL), pull(case, scene, ALL, factor=2)
    assert_same_bytes((value, {k: 2 * g for k, g in once.items()}), (again, twice))


@given(cases())
@settings(max_examples=15)
def test_channels_that_repeat_the_depth_are_the_depth(case):
    """Extra channels take another path through the compositing than colour, alpha and depth."""
    scene = floats(build(case))
    in_camera = scene["means"] @ scene["camera_from_world"][:3, :3].T + scene["camera_from_world"][:3, 3]
    scene["channels"] = torch.stack([torch.ones_like(in_camera[:, 2]), in_camera[:, 2]], 1).clamp(-100, 1e11)
    out = rasterize(**scene, **case.camera(), sh_degree=case.degree)
    both = torch.stack([out.alpha, out.depth_m], -1)
    torch.testing.assert_close(out.channels, both, rtol=1e-4, atol=1e-6)
