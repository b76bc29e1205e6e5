"""What is written is read by programs that are not ours."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dreamdrive.data.splats.glb import pack_glb
from dreamdrive.data.splats.ply import pack_ply, unpack_ply
from dreamdrive.data.splats.spz import pack_spz
from dreamdrive.export import EXPORTS, export, function
from dreamdrive.scene.gaussians import SH_C0
from tests.data.splats.some import check_same, some, up_and_back
from tests.export.splats.transform import transformed
from tests.scene.scenes import make_scene

_SPZ: dict[str, Any] = {"place_m": 2e-4, "size": 0.09, "opacity": 0.0021, "colour": 0.09}


@pytest.mark.slow
def test_gsply_reads_spz(tmp_path: Path) -> None:
    import gsply

    true = some()
    (tmp_path / "a.spz").write_bytes(pack_spz(true))
    read = gsply.read_spz(tmp_path / "a.spz")
    names = {
        "means": "means",
        "quaternions": "quats",
        "log_scales": "scales",
        "logit_opacities": "opacities",
    }
    numbers = {ours: np.array(getattr(read, theirs)) for ours, theirs in names.items()}
    numbers["sh"] = np.concatenate([np.array(read.sh0)[:, None], np.array(read.shN)], axis=1)
    check_same(up_and_back(numbers), true, **_SPZ)


@pytest.mark.slow
@pytest.mark.parametrize("coefficients", [1, 4, 16])
def test_splat_transform_reads_spz(tmp_path: Path, coefficients: int) -> None:
    true = some(coefficients=coefficients)
    (tmp_path / "a.spz").write_bytes(pack_spz(true))
    found, _ = unpack_ply(transformed(tmp_path / "a.spz"), "a").gaussians("a")
    check_same(found, true, **_SPZ)


@pytest.mark.slow
def test_gsply_reads_ply(tmp_path: Path) -> None:
    import gsply

    true = some()
    (tmp_path / "a.ply").write_bytes(pack_ply(true))
    read = gsply.plyread(tmp_path / "a.ply")
    assert np.array_equal(read.means, true.means)
    assert np.array_equal(read.scales, true.log_scales)
    assert np.array_equal(np.array(read.opacities).ravel(), true.logit_opacities)
    assert np.array_equal(read.sh0, true.sh[:, 0])
    assert np.array_equal(read.shN, true.sh[:, 1:])


def test_pygltflib_and_4dgs_read_glb(tmp_path: Path) -> None:
    import fourdgs
    import pygltflib

    true = some()
    file = tmp_path / "a.glb"
    file.write_bytes(pack_glb(true))
    gltf = pygltflib.GLTF2().load(str(file))
    assert gltf is not None
    blob = gltf.binary_blob()
    assert blob is not None
    attributes = gltf.meshes[0].primitives[0].attributes.__dict__

    def values(name: str) -> np.ndarray:
        accessor = gltf.accessors[attributes[name]]
        view = gltf.bufferViews[accessor.bufferView]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor.type]
        return np.frombuffer(blob, "<f4", accessor.count * width, view.byteOffset).reshape(-1, width)

    prefix = "KHR_gaussian_splatting:"
    sh = [values(f"{prefix}SH_DEGREE_{d}_COEF_{k}") for d in range(4) for k in range(2 * d + 1)]
    opacities = values(f"{prefix}OPACITY")[:, 0]
    numbers = {
        "means": values("POSITION"),
        "quaternions": np.roll(values(f"{prefix}ROTATION"), 1, axis=1),
        "log_scales": np.log(values(f"{prefix}SCALE")),
        "logit_opacities": np.log(opacities / (1 - opacities)),
        "sh": np.stack(sh, axis=1),
    }
    check_same(up_and_back(numbers), true, place_m=0, size=1e-4, opacity=1e-5, colour=1e-5)
    read = fourdgs.from_gltf(str(file)).gaussians
    assert np.allclose(read.positions, numbers["means"])
    assert np.allclose(read.colors[:, 3], opacities)
    assert np.allclose(read.colors[:, :3], np.clip(numbers["sh"][:, 0] * SH_C0 + 0.5, 0, 1), atol=1e-6)


def test_trimesh_shows_glb_as_points(tmp_path: Path) -> None:
    import trimesh

    true = some()
    (tmp_path / "a.glb").write_bytes(pack_glb(true))
    read: Any = trimesh.load(tmp_path / "a.glb", force="scene")
    cloud = read.geometry.popitem()[1]
    assert np.allclose(cloud.vertices, true.means.numpy() * [1, -1, -1], atol=1e-5)
    rgb = np.clip(true.sh[:, 0].numpy() * SH_C0 + 0.5, 0, 1) * 255
    assert np.abs(cloud.colors[:, :3] - rgb).max() <= 0.51


@pytest.mark.parametrize("kind", ["spz", "glb", "sog"])
def test_a_folder_holds_all_times(kind: str, tmp_path: Path) -> None:
    scene = make_scene()
    export(scene, kind, tmp_path / "all")
    names = sorted(str(each.relative_to(tmp_path / "all")) for each in (tmp_path / "all").rglob(f"*.{kind}"))
    assert names == [f"frames/{i:04d}.{kind}" for i in range(3)] + [f"static.{kind}"]
    chosen = EXPORTS.choose(kind)
    export(scene, kind, tmp_path / f"a.{kind}")
    first = (tmp_path / "all" / "frames" / f"0000.{kind}").read_bytes()
    assert (tmp_path / f"a.{kind}").read_bytes() == first
    assert chosen.left_out is not None
    said = function(chosen.left_out)(scene, tmp_path / f"a.{kind}")
    assert (
        said
        == f"{kind.upper()} holds the scene at one time: no sky, no exposure of the recording, no motion."
    )


def test_times_can_be_chosen(tmp_path: Path) -> None:
    function(EXPORTS.choose("glb").scene)(make_scene(), tmp_path / "all", times_s=[0.4, 0.5])
    assert len(list((tmp_path / "all" / "frames").iterdir())) == 2
