"""The CUDA backend against the reference: on a GPU, or with gsplat's torch functions in place of kernels."""

import warnings
from types import ModuleType

import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.splat import cuda, rasterize, render
from dreamdrive.splat.cuda import load_gsplat, why_unusable
from tests.splat.gsplat_on_cpu import gsplat_on_cpu
from tests.splat.scenes import IMAGES, pinhole, random_scene, relative, render_with_gradients

# Of values and gradients. The kernels approximate exp, and regain the transmittance before each Gaussian from
# 1 - alpha in float32, which leaves three digits of 1e-4.
TOLERANCES = {"cpu": (1e-4, 1e-4), "cuda": (1e-3, 5e-3)}


WAYS = [(of, packed) for of in ("gsplat's torch functions", "kernels") for packed in ("", ", packed")]


@pytest.fixture(
    params=[
        pytest.param(f"{of}{packed}", marks=pytest.mark.gpu if of == "kernels" else ()) for of, packed in WAYS
    ]
)
def device(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    if "packed" in request.param:
        monkeypatch.setattr(cuda, "PACKED_ABOVE", 0)
    if "kernels" in request.param:
        return gpu()
    stand_in = gsplat_on_cpu(monkeypatch)
    monkeypatch.setattr(cuda, "load_gsplat", lambda: stand_in)
    monkeypatch.setattr(cuda, "check_device", lambda tensors, kind: None)
    return "cpu"


def gpu() -> str:
    trouble = why_unusable()
    if trouble is not None:
        pytest.skip(trouble)
    with warnings.catch_warnings():  # what compilers have to say
        warnings.simplefilter("ignore")
        load_gsplat()
    return "cuda"


def unmoved(scene: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """With screen offsets of zero, as densification has them."""
    return scene | {"screen_offsets_px": torch.zeros_like(scene["screen_offsets_px"])}


def assert_agrees(scene, device, **options):
    value, gradients = render_with_gradients(scene, "gsplat", device=device, **options)
    expected, expected_gradients = render_with_gradients(scene, "reference", **options)
    of_values, of_gradients = TOLERANCES[device]
    for name in IMAGES:
        if getattr(expected, name).numel():
            assert relative(getattr(value, name), getattr(expected, name)) < of_values, name
    for name, gradient in gradients.items():
        if expected_gradients[name].norm() == 0:
            assert gradient.abs().sum() == 0, name
        else:
            assert relative(gradient, expected_gradients[name]) < of_gradients, name
    visible = value.visible.cpu()
    assert (visible | ~expected.visible).all()
    for name in gradients.keys() - {"camera_from_world"}:
        assert gradients[name][~visible].abs().sum() == 0, name
    return value, gradients


@pytest.mark.parametrize(("seed", "size"), [(0, (53, 37)), (1, (16, 16)), (2, (7, 40)), (3, (64, 33))])
def test_value_and_every_gradient_agree(device, seed, size):
    value, gradients = assert_agrees(unmoved(random_scene(150, seed=seed)), device, camera=pinhole(*size))
    assert 0 < value.visible.sum() < 150
    for name in ("screen_offsets_px", "camera_from_world"):
        assert gradients[name].abs().sum() > 0, name


@pytest.mark.parametrize(("stored", "active"), [(1, None), (4, None), (9, 1), (16, 0), (16, 2)])
def test_degrees_of_spherical_harmonics(device, stored, active):
    scene = unmoved(random_scene(80, coefficients=stored, seed=3))
    _, gradients = assert_agrees(scene, device, sh_degree=active)
    used = stored if active is None else (active + 1) ** 2
    assert gradients["sh"][:, used:].abs().sum() == 0
    assert gradients["sh"][:, :used].abs().sum() > 0


@pytest.mark.parametrize("channels", [None, 0, 1, 40])
def test_any_number_of_extra_channels(device, channels):
    scene = unmoved(random_scene(80, coefficients=1, channels=channels, seed=5))
    value, _ = assert_agrees(scene, device)
    assert value.channels.shape == (37, 53, channels or 0)


def test_antialiased(device):
    scene = unmoved(random_scene(80, seed=4))
    scene["scales"] = scene["scales"] * 0.3
    assert_agrees(scene, device, antialiased=True)


@pytest.mark.parametrize("image", IMAGES)
def test_gradient_of_one_output_alone(device, image):
    assert_agrees(unmoved(random_scene(60, seed=6)), device, images=(image,))


def test_offsets_move_the_projected_centres(device):
    scene = random_scene(60, seed=7)
    scene["means"] *= torch.tensor([0.2, 0.2, 0.5])  # all within the image
    scene["screen_offsets_px"] *= 10
    assert_agrees(scene, device)


def test_opaque_stacks_stop_and_cap_alike(device):
    scene = unmoved(random_scene(150, seed=8))
    scene["opacities"] = torch.where(torch.arange(150) % 2 == 0, 1.0, scene["opacities"])
    scene["scales"] = 2 * scene["scales"]
    value, _ = assert_agrees(scene, device)
    assert value.alpha.max() > 0.999


def test_wide_thin_near_and_faint_gaussians(device):
    scene = unmoved(random_scene(120, seed=9))
    scene["scales"][::3, 0] *= 8
    scene["scales"][1::3] *= 0.02
    scene["means"][::4, 2] -= 3
    scene["opacities"][::5] = 0.003
    assert_agrees(scene, device)


def test_equal_depths_keep_index_order(device):
    scene = unmoved(random_scene(2, coefficients=1, channels=None))
    scene["means"] = torch.tensor([[0.0, 0, 3], [0, 0, 3]], dtype=torch.float64)
    scene["camera_from_world"] = torch.eye(4, dtype=torch.float64)
    scene["opacities"] = torch.full((2,), 0.9, dtype=torch.float64)
    assert_agrees(scene, device)


def test_nothing_at_all(device):
    value, gradients = render_with_gradients(random_scene(0), "gsplat", device=device)
    assert value.colour.shape == (37, 53, 3)
    assert value.channels.shape == (37, 53, 5)
    assert not any(getattr(value, name).any() for name in IMAGES)
    assert gradients["means"].shape == (0, 3)


def test_nothing_in_view(device):
    scene = {k: v.to(device, torch.float32) for k, v in random_scene(20).items()}
    scene["means"][:, 2] -= 1000
    value = rasterize(**scene, **pinhole(), backend="gsplat")
    assert not any(getattr(value, name).any() for name in IMAGES)
    assert not value.visible.any()


def test_a_camera_sees_gaussians(device):
    from tests.scene.scenes import make_scene

    scene = make_scene()
    moved = {name: value.to(device) for name, value in scene.static.tensors().items()}
    value = render(Gaussians(**moved), scene.cameras[0], backend="gsplat")
    assert relative(value.colour, render(scene.static, scene.cameras[0]).colour) < TOLERANCES[device][0]


@pytest.mark.gpu
@pytest.mark.parametrize("size", [(640, 384), (333, 201)])
def test_kernels_agree_with_the_native_core_on_many(size):
    device, scene = gpu(), unmoved(random_scene(20_000, seed=10))
    scene["scales"] = 0.1 * scene["scales"]
    value, gradients = render_with_gradients(scene, "gsplat", camera=pinhole(*size), device=device)
    expected, expected_gradients = render_with_gradients(scene, "native", camera=pinhole(*size))
    of_values, of_gradients = TOLERANCES["cuda"]
    for name in IMAGES:
        assert relative(getattr(value, name), getattr(expected, name)) < of_values, name
    for name, gradient in gradients.items():
        assert relative(gradient, expected_gradients[name]) < of_gradients, name


@pytest.mark.gpu
def test_rendering_in_inference_mode_does_not_keep_training_from_the_same_camera():
    device, scene = gpu(), random_scene(50)
    cuda._intrinsics.cache_clear()
    with torch.inference_mode():
        rasterize(**{k: v.to(device, torch.float32) for k, v in scene.items()}, **pinhole(), backend="gsplat")
    render_with_gradients(scene, "gsplat", device=device)


def float32(scene: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    return {name: value.float() for name, value in scene.items()}


def test_tensors_have_to_be_float32_and_on_a_cuda_device(monkeypatch):
    stand_in = gsplat_on_cpu(monkeypatch)
    monkeypatch.setattr(cuda, "load_gsplat", lambda: stand_in)
    with pytest.raises(ValueError, match="means: expected a tensor on a CUDA device, got one on cpu"):
        rasterize(**float32(random_scene(5)), **pinhole(), backend="gsplat")
    monkeypatch.setattr(cuda, "check_device", lambda tensors, kind: None)
    with pytest.raises(ValueError, match="means: expected float32, got float64"):
        rasterize(**random_scene(5), **pinhole(), backend="gsplat")


FOUND = {"gsplat": True, "gsplat.csrc": False}


def pretend(
    monkeypatch: pytest.MonkeyPatch,
    version: str | None = "13.0",
    found: dict[str, bool] = FOUND,
    device: bool = True,
    compiler: bool = True,
) -> None:
    """Let the machine look as if it had CUDA, except for what a test takes away."""
    monkeypatch.setattr("torch.version.cuda", version)
    monkeypatch.setattr("torch.cuda.is_available", lambda: device)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: object() if found[name] else None)
    monkeypatch.setattr(cuda, "_has_compiler", lambda: compiler)


def test_what_it_has_not_is_refused():
    scene = {k: v.float() for k, v in random_scene(5).items()}
    with pytest.raises(ValueError, match="inspect"):
        rasterize(**scene, **pinhole(), inspect=True, backend="gsplat")
    with pytest.raises(ValueError, match="screen_absolute_px"):
        rasterize(**scene, **pinhole(), screen_absolute_px=torch.zeros(5, 2), backend="gsplat")


@pytest.mark.parametrize(
    ("absent", "message"),
    [
        ({"version": None}, "is built without CUDA: install a build with it"),
        ({"found": {"gsplat": False}}, r"gsplat is not installed: .*pip install -e '\.\[gpu\]'"),
        ({"device": False}, "torch finds no CUDA device: nvidia-smi has to list one"),
        ({"compiler": False}, r"no nvcc to compile them: install the CUDA toolkit 13\.0, or set CUDA_HOME"),
    ],
)
def test_what_is_missing_is_said_in_one_sentence(monkeypatch, absent, message):
    pretend(monkeypatch, **absent)
    with pytest.raises(InputError, match=f"^backend 'gsplat': .*{message}") as caught:
        rasterize(**float32(random_scene(5)), **pinhole(), backend="gsplat")
    assert "\n" not in str(caught.value)


def test_compiled_kernels_need_no_compiler(monkeypatch):
    pretend(monkeypatch, compiler=False, found={"gsplat": True, "gsplat.csrc": True})
    assert why_unusable() is None


def test_a_compiler_is_nvcc_of_the_toolkit(monkeypatch, tmp_path):
    monkeypatch.setattr("torch.utils.cpp_extension.CUDA_HOME", None)
    assert not cuda._has_compiler()
    monkeypatch.setattr("torch.utils.cpp_extension.CUDA_HOME", str(tmp_path))
    assert not cuda._has_compiler()
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "nvcc").touch(mode=0o755)
    assert cuda._has_compiler()


def test_kernels_that_do_not_compile_are_said_in_one_sentence(monkeypatch):
    def fail(name: str) -> ModuleType:
        raise RuntimeError("Error building extension 'gsplat_cuda'\nninja: build stopped")

    pretend(monkeypatch)
    monkeypatch.setattr("importlib.import_module", fail)
    with pytest.raises(
        InputError, match=r"\(Error building extension 'gsplat_cuda'\): .* CUDA 13\.0"
    ) as caught:
        rasterize(**float32(random_scene(5)), **pinhole(), backend="gsplat")
    assert "\n" not in str(caught.value)
