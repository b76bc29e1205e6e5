import contextlib
import os
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from dreamdrive.errors import InputError
from dreamdrive.export import export, read_ply, write_ply
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene


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
@settings(max_examples=25, deadline=None)
def test_round_trip(
    tmp_path_factory: pytest.TempPathFactory, count: int, coefficients: int, seed: int
) -> None:
    path = tmp_path_factory.mktemp("ply") / "a.ply"
    before = gaussians(count, coefficients, seed)
    write_ply(before, path)
    after = read_ply(path)
    for name, value in before.tensors().items():
        torch.testing.assert_close(getattr(after, name), value, atol=1e-6, rtol=1e-6)


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


def test_fields_in_another_order_are_read(tmp_path: Path) -> None:
    write_ply(gaussians(4, 1), tmp_path / "a.ply")
    header, body = (tmp_path / "a.ply").read_bytes().split(b"end_header\n", 1)
    lines = header.decode().splitlines()
    table = np.frombuffer(body, "<f4").reshape(4, -1)[:, ::-1]
    lines[3:] = lines[3:][::-1]
    (tmp_path / "b.ply").write_bytes("\n".join([*lines, "end_header\n"]).encode() + table.tobytes())
    assert torch.equal(read_ply(tmp_path / "b.ply").means, read_ply(tmp_path / "a.ply").means)


@given(st.integers(0, 2000), st.integers(1, 255))
@settings(max_examples=60, deadline=None)
def test_damaged_files_raise_only_input_errors(
    tmp_path_factory: pytest.TempPathFactory, at: int, change: int
) -> None:
    path = tmp_path_factory.mktemp("ply") / "a.ply"
    write_ply(gaussians(6), path)
    data = bytearray(path.read_bytes())
    data[at % len(data)] ^= change
    path.write_bytes(data[: max(at, 1)] if change < 30 else data)
    with contextlib.suppress(InputError):
        read_ply(path)


def test_bad_files_are_explained(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_ply(tmp_path / "none.ply")
    (tmp_path / "a.ply").write_text("hello")
    with pytest.raises(InputError, match="no PLY"):
        read_ply(tmp_path / "a.ply")
    write_ply(gaussians(6), tmp_path / "a.ply")
    (tmp_path / "a.ply").write_bytes((tmp_path / "a.ply").read_bytes()[:-5])
    with pytest.raises(InputError, match="cut off"):
        read_ply(tmp_path / "a.ply")


def test_what_is_no_plain_file_is_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.ply")
    with pytest.raises(InputError, match=r"a\.ply cannot be read: it is not a regular file"):
        read_ply(tmp_path / "a.ply")


def test_a_count_of_countless_digits_is_refused(tmp_path: Path) -> None:
    write_ply(gaussians(3), tmp_path / "a.ply")
    data = (tmp_path / "a.ply").read_bytes().replace(b"vertex 3\n", b"vertex " + b"9" * 5000 + b"\n")
    (tmp_path / "a.ply").write_bytes(data)
    with pytest.raises(InputError, match="expected one element vertex with float properties only"):
        read_ply(tmp_path / "a.ply")


def test_a_scene_becomes_one_file_or_a_sequence(tmp_path: Path) -> None:
    export(scene(), "ply", tmp_path / "one.ply")
    assert len(read_ply(tmp_path / "one.ply")) == 8
    export(scene(), "ply", tmp_path / "many")
    assert len(read_ply(tmp_path / "many" / "static.ply")) == 5
    names = sorted(p.name for p in (tmp_path / "many" / "frames").iterdir())
    assert names == ["0000.ply", "0001.ply"]
    assert len(read_ply(tmp_path / "many" / "frames" / "0001.ply")) == 8


def test_export_keeps_what_is_not_its_own(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("x")
    with pytest.raises(InputError, match="other files"):
        export(scene(), "ply", tmp_path / "mine")
    with pytest.raises(InputError, match="cannot write"):
        export(scene(), "ply", tmp_path / "mine" / "thesis.tex" / "a.ply")
    with pytest.raises(InputError, match="expected ply"):
        export(scene(), "gif", tmp_path / "a.gif")
