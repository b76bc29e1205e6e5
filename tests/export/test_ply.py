from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings, strategies as st

from dreamdrive.errors import InputError
from dreamdrive.export import export, write_ply
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene
from tests.export.ply_file import columns, count


def gaussians(count: int, coefficients: int = 4, seed: int = 0) -> Gaussians:
    g = torch.Generator().manual_seed(seed)
    return Gaussians(
        means=torch.randn(count, 3, generator=g),
        quaternions=torch.nn.functional.normalize(torch.randn(count, 4, generator=g), dim=-1),
        log_scales=torch.randn(count, 3, generator=g),
        logit_opacities=torch.randn(count, generator=g),
        sh=torch.randn(count, coefficients, 3, generator=g),
        source_frame=torch.zeros(count, dtype=torch.int64),
    )


def scene(dynamic: int = 3) -> Scene:
    return Scene(
        static=gaussians(5),
        dynamic=gaussians(dynamic, seed=1),
        deformation=None,
        actors=(),
        sky=None,
        exposure=None,
        cameras=(Camera(10.0, 10.0, 8.0, 6.0, 16, 12),) * 2,
        times_s=np.array([0.0, 0.1]),
        held_out=np.zeros(2, dtype=bool),
    )


@given(st.integers(0, 40), st.sampled_from([1, 4, 9, 16]), st.integers(0, 1000))
@settings(max_examples=25)
def test_what_is_written_is_all_there(
    tmp_path_factory: pytest.TempPathFactory, number: int, coefficients: int, seed: int
) -> None:
    path = tmp_path_factory.mktemp("ply") / "a.ply"
    before = gaussians(number, coefficients, seed)
    write_ply(before, path)
    table = columns(path)

    def after(*names: str) -> np.ndarray:
        return np.stack([table[name] for name in names], axis=1)

    rest = [name for name in table if name.startswith("f_rest_")]
    higher = np.array([table[name] for name in rest]).reshape(3, coefficients - 1, number).transpose(2, 1, 0)
    found = {
        "means": after("x", "y", "z"),
        "quaternions": after("rot_0", "rot_1", "rot_2", "rot_3"),
        "log_scales": after("scale_0", "scale_1", "scale_2"),
        "logit_opacities": after("opacity")[:, 0],
        "sh": np.concatenate([after("f_dc_0", "f_dc_1", "f_dc_2")[:, None], higher], axis=1),
    }
    for name, values in found.items():
        np.testing.assert_allclose(values, getattr(before, name).numpy(), atol=1e-6, rtol=1e-6)


def test_the_layout_is_that_of_3dgs(tmp_path: Path) -> None:
    one = gaussians(1, 16)
    write_ply(one, tmp_path / "a.ply")
    data = (tmp_path / "a.ply").read_bytes()
    header, body = data.split(b"end_header\n", 1)
    names = [line.split()[-1] for line in header.decode().splitlines() if line.startswith("property")]
    assert names[:9] == ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"]
    assert names[9:54] == [f"f_rest_{i}" for i in range(45)]
    assert names[54:] == ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]
    values = np.frombuffer(body, "<f4")
    np.testing.assert_array_equal(values[9:24], one.sh[0, 1:, 0])  # all of red first
    np.testing.assert_array_equal(values[3:6], 0)


def test_a_scene_becomes_one_file_or_a_sequence(tmp_path: Path) -> None:
    export(scene(), "ply", tmp_path / "one.ply")
    assert count(tmp_path / "one.ply") == 8
    export(scene(), "ply", tmp_path / "many")
    assert count(tmp_path / "many" / "static.ply") == 5
    names = sorted(p.name for p in (tmp_path / "many" / "frames").iterdir())
    assert names == ["0000.ply", "0001.ply"]
    assert count(tmp_path / "many" / "frames" / "0001.ply") == 8


def test_export_keeps_what_is_not_its_own(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("x")
    with pytest.raises(InputError, match="other files"):
        export(scene(), "ply", tmp_path / "mine")
    with pytest.raises(InputError, match="cannot write"):
        export(scene(), "ply", tmp_path / "mine" / "thesis.tex" / "a.ply")
    with pytest.raises(InputError, match="available are ply"):
        export(scene(), "gif", tmp_path / "a.gif")
