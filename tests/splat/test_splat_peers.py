"""Scenes in ``DREAMDRIVE_BENCH``: the float64 program's images, gsplat's torch code in value and gradient."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

from dreamdrive.scene.gaussians import SH_C0
from dreamdrive.splat import rasterize
from dreamdrive.splat.arguments import SplatArguments
from dreamdrive.splat.reference import project
from tests.splat.gsplat_on_cpu import nerfacc_stand_in
from tests.splat.scenes import relative


@pytest.fixture(scope="module")
def street(bench_dir: Path):
    spec = importlib.util.spec_from_file_location("street_scene", bench_dir / "street_scene.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def float64_program(bench_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    program = tmp_path_factory.mktemp("reference") / "reference_f64"
    source = bench_dir / "reference_f64.cpp"
    subprocess.run(["g++", "-O3", "-march=native", "-std=c++17", "-o", program, source], check=True)
    return program


def tensors(scene: dict[str, np.ndarray]) -> dict[str, Tensor]:
    return {
        "means": torch.from_numpy(scene["means"]),
        "quaternions": torch.from_numpy(scene["quats"]),
        "scales": torch.from_numpy(scene["scales"]),
        "opacities": torch.from_numpy(scene["opacities"]),
        "sh": ((torch.from_numpy(scene["colors"]) - 0.5) / SH_C0)[:, None],
        "camera_from_world": torch.from_numpy(scene["viewmat"]),
    }


def pinhole(scene: dict[str, np.ndarray]) -> dict[str, float]:
    names = {"fx_px": "fx", "fy_px": "fy", "cx_px": "cx", "cy_px": "cy", "width_px": "W", "height_px": "H"}
    return {ours: scene[theirs].item() for ours, theirs in names.items()}


def write_scene(scene: dict[str, np.ndarray], path: Path) -> None:
    with path.open("wb") as file:
        np.array([len(scene["means"]), scene["W"], scene["H"]], np.int32).tofile(file)
        np.array([scene["fx"], scene["fy"], scene["cx"], scene["cy"]], np.float32).tofile(file)
        for name in ("viewmat", "means", "quats", "scales", "opacities", "colors"):
            scene[name].tofile(file)


@pytest.mark.parametrize("name", ["t", "a"])
def test_image_agrees_with_the_float64_program(street, float64_program, tmp_path, name):
    scene = street.make(name)
    write_scene(scene, tmp_path / "scene.bin")
    subprocess.run([float64_program, "scene.bin", "image.bin"], cwd=tmp_path, check=True, capture_output=True)
    width, height = scene["W"].item(), scene["H"].item()
    numbers = torch.from_numpy(np.fromfile(tmp_path / "image.bin", np.float32))
    image, through = numbers.split([3 * width * height, width * height])
    out = rasterize(**tensors(scene), **pinhole(scene))
    error = (out.colour - image.reshape(height, width, 3)).abs()
    assert error.max() < 0.01
    assert error.mean() < 1e-5
    assert (1 - out.alpha - through.reshape(height, width)).abs().max() < 0.01


def gsplat_projection(inputs: dict[str, Tensor], camera: dict[str, float]) -> tuple[Tensor, ...]:
    gsplat = pytest.importorskip("gsplat.cuda._torch_impl")
    covariances, _ = gsplat._quat_scale_to_covar_preci(inputs["quaternions"], inputs["scales"], True, False)
    intrinsics = torch.eye(3, dtype=torch.float64)
    intrinsics[0, 0], intrinsics[1, 1] = camera["fx_px"], camera["fy_px"]
    intrinsics[0, 2], intrinsics[1, 2] = camera["cx_px"], camera["cy_px"]
    return gsplat._fully_fused_projection(
        inputs["means"], covariances, inputs["camera_from_world"][None], intrinsics[None],
        camera["width_px"], camera["height_px"], near_plane=0.2,
    )  # fmt: skip


def double_inputs(scene: dict[str, np.ndarray]) -> dict[str, Tensor]:
    return {name: value.double().requires_grad_() for name, value in tensors(scene).items()}


def pull(outputs: list[Tensor], inputs: dict[str, Tensor]) -> list[Tensor]:
    g = torch.Generator().manual_seed(3)
    loss = sum((o * torch.randn(o.shape, generator=g, dtype=torch.float64)).sum() for o in outputs)
    names = ("means", "quaternions", "scales", "camera_from_world")
    return list(torch.autograd.grad(loss, [inputs[name] for name in names]))


def test_projection_agrees_with_gsplat(street):
    scene = street.make("t")
    scene["cx"] += np.float32(11)
    camera, ours, theirs = pinhole(scene), double_inputs(scene), double_inputs(scene)
    _, means2d, depths, conics, _ = gsplat_projection(theirs, camera)
    arguments = SplatArguments(
        **ours,
        focal_px=(camera["fx_px"], camera["fy_px"]),
        centre_px=(camera["cx_px"], camera["cy_px"]),
        size_px=(camera["width_px"], camera["height_px"]),
        sh_degree=0,
    )
    index, centre, conic, _, depth = project(arguments)
    value, expected = [centre, conic, depth], [means2d[0, index], conics[0, index], depths[0, index]]
    for a, b in zip(value, expected, strict=True):
        assert relative(a, b) < 1e-9
    for a, b in zip(pull(value, ours), pull(expected, theirs), strict=True):
        assert relative(a, b) < 1e-9


def pairs_in_order(
    means2d: Tensor, conics: Tensor, opacities: Tensor, depths: Tensor, width: int, height: int
):
    """Stand-in for gsplat's CUDA kernel: the composited (Gaussian, pixel) pairs, front to back by pixel."""
    order = torch.argsort(depths, stable=True)
    order = order[depths[order] >= 0.2]
    gaussians, pixels = [], []
    x = torch.arange(width, dtype=torch.float64) + 0.5
    for row in range(height):
        dy = row + 0.5 - means2d[order, 1]
        near = order[
            (opacities[order] * torch.exp(-0.5 * dy**2 * determinant_share(conics[order])) >= 1 / 255)
        ]
        dx, dy = x[:, None] - means2d[near, 0], row + 0.5 - means2d[near, 1]
        a, b, c = conics[near].unbind(-1)
        alpha = (opacities[near] * torch.exp(-(0.5 * (a * dx**2 + c * dy**2) + b * dx * dy))).clamp(max=0.999)
        alpha = torch.where(alpha >= 1 / 255, alpha, 0.0)
        kept = (alpha > 0) & (torch.cumprod(1 - alpha, 1) > 1e-4)
        column, place = torch.nonzero(kept, as_tuple=True)
        gaussians.append(near[place])
        pixels.append(row * width + column)
    return torch.cat(gaussians), torch.cat(pixels)


def determinant_share(conics: Tensor) -> Tensor:
    """Least value of the quadratic form over dx, for dy = 1."""
    return conics[:, 2] - conics[:, 1] ** 2 / conics[:, 0]


def test_whole_render_agrees_with_gsplats_projection_and_compositing(street, monkeypatch):
    gsplat = pytest.importorskip("gsplat.cuda._torch_impl")
    monkeypatch.setitem(sys.modules, "nerfacc", nerfacc_stand_in())
    scene = street.make("t")
    camera, theirs = pinhole(scene), double_inputs(scene)
    width, height = camera["width_px"], camera["height_px"]
    upstream = torch.from_numpy(scene["v_img"])
    _, means2d, depths, conics, _ = gsplat_projection(theirs, camera)
    with torch.no_grad():
        pairs = pairs_in_order(means2d[0], conics[0], theirs["opacities"], depths[0], width, height)
    colours = (theirs["sh"][:, 0] * SH_C0 + 0.5).clamp(min=0)
    image, _ = gsplat.accumulate(
        means2d,
        conics,
        theirs["opacities"][None],
        colours[None],
        *pairs,
        torch.zeros_like(pairs[0]),
        width,
        height,
    )
    ours = {name: value.requires_grad_() for name, value in tensors(scene).items()}
    out = rasterize(**ours, **camera)
    assert relative(out.colour, image[0]) < 1e-4
    (out.colour * upstream).sum().backward()
    (image[0] * upstream.double()).sum().backward()
    for name, value in ours.items():
        assert relative(value.grad, theirs[name].grad) < 1e-4, name
