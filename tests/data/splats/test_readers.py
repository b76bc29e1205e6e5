"""Readers of splat files: what they give back, and what they refuse."""

import gzip
import json
import struct
from collections.abc import Callable

import numpy as np
import pytest
import torch
import zstandard
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from dreamdrive.data.splats.glb import pack_glb, unpack_glb
from dreamdrive.data.splats.ply import pack_ply, unpack_ply
from dreamdrive.data.splats.splats import UP_AND_BACK, Splats, turned
from dreamdrive.data.splats.spz import pack_spz, unpack_spz
from dreamdrive.errors import InputError
from dreamdrive.scene.gaussians import Gaussians
from tests.data.splats.some import check_same, colours, covariances, some

Pack = Callable[[Gaussians], bytes]
Unpack = Callable[[bytes, str], Splats]
_EXACT = {"place_m": 0.0, "size": 1e-4, "opacity": 1e-5, "colour": 1e-5}
_QUANTISED = {"place_m": 2e-4, "size": 0.09, "opacity": 0.0021, "colour": 0.09}
FORMATS: dict[str, tuple[Pack, Unpack, bool, dict[str, float]]] = {
    "ply": (pack_ply, unpack_ply, False, _EXACT),
    "spz": (pack_spz, unpack_spz, True, _QUANTISED),
    "glb": (pack_glb, unpack_glb, True, _EXACT),
}


@given(st.sampled_from(list(FORMATS)), st.integers(1, 30), st.sampled_from([1, 4, 9, 16]), st.integers(0, 99))
@settings(max_examples=40)
def test_what_is_written_is_read(name: str, count: int, coefficients: int, seed: int) -> None:
    pack, unpack, back, precision = FORMATS[name]
    true = some(count, coefficients, seed)
    found, dropped = unpack(pack(true), "a").gaussians("a")
    assert dropped == 0
    check_same(turned(found, UP_AND_BACK) if back else found, true, **precision)


@given(st.sampled_from(list(FORMATS)), st.data())
@settings(max_examples=150)
def test_a_spoilt_file_is_read_or_refused(name: str, data: st.DataObject) -> None:
    pack, unpack, *_ = FORMATS[name]
    file = bytearray(pack(some(5, 4)))
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(file) - 1))
        file[place] = data.draw(st.integers(0, 255))
    try:
        found, _ = unpack(bytes(file), "a.x").gaussians("a.x")
    except InputError:
        return
    assert found.problem() is None


@given(st.sampled_from(list(FORMATS)), st.floats(0, 1, exclude_max=True))
def test_what_is_cut_short_is_refused(name: str, share: float) -> None:
    pack, unpack, *_ = FORMATS[name]
    file = pack(some(20, 4))
    with pytest.raises(InputError, match=r"a\.x"):
        unpack(file[: int(share * len(file))], "a.x")


@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_all_of_a_gaussian_turns(quaternion: list[float]) -> None:
    rotation = Rotation.from_quat(quaternion).as_matrix()
    true = some(10)
    found = turned(true, rotation)
    assert np.allclose(found.means, true.means.numpy() @ rotation.T, atol=1e-4)
    assert np.allclose(covariances(found), rotation @ covariances(true) @ rotation.T, rtol=1e-3, atol=1e-4)
    for direction in np.random.default_rng(0).normal(size=(5, 3)):
        assert np.allclose(colours(found, rotation @ direction), colours(true, direction), atol=1e-4)


@pytest.mark.parametrize("name", list(FORMATS))
def test_files_that_claim_too_much_are_refused_before_memory_is_taken(name: str) -> None:
    pack, unpack, *_ = FORMATS[name]
    file = pack(some(5, 1))
    huge = {
        "ply": file.replace(b"vertex 5\n", b"vertex 19000000\n"),
        "spz": file[:8] + struct.pack("<I", 19_000_000) + file[12:],
        "glb": file.replace(b'"count": 5', b'"count": 9'),
    }
    with pytest.raises(InputError, match=r"damaged|cut short"):
        unpack(huge[name], "a")


def test_a_bomb_is_refused() -> None:
    count = 1_000_000
    header = struct.pack("<4sIIBBBB", b"NGSP", 3, count, 0, 12, 0, 0)
    with pytest.raises(InputError, match=r"in 19\d+ bytes"):
        unpack_spz(gzip.compress(header + bytes(20 * count)), "a")
    sizes = [9 * count, count, 3 * count, 3 * count, 4 * count]
    streams = [zstandard.compress(bytes(size)) for size in sizes]
    table = b"".join(struct.pack("<QQ", len(s), size) for s, size in zip(streams, sizes, strict=True))
    head = struct.pack("<4sIIBBBBI12x", b"NGSP", 4, count, 0, 12, 0, 5, 32)
    with pytest.raises(InputError, match="it is damaged"):
        unpack_spz(head + table + b"".join(streams), "a")


def test_older_spz_is_read() -> None:
    true = some(7, 4)
    file = pack_spz(true)
    place = 32 + 6 * 16
    body = b""
    for i in range(6):
        packed, size = struct.unpack_from("<QQ", file, 32 + 16 * i)
        body += zstandard.decompress(file[place : place + packed], size)
        place += packed
    bits = file[13]
    third = gzip.compress(struct.pack("<4sIIBBBB", b"NGSP", 3, 7, 1, bits, 0, 0) + body)
    for found, now in zip(
        vars(unpack_spz(third, "a")).values(), vars(unpack_spz(file, "a")).values(), strict=True
    ):
        assert np.array_equal(found, now)
    with pytest.raises(InputError, match="version 1"):
        unpack_spz(gzip.compress(struct.pack("<4sIIBBBB", b"NGSP", 1, 7, 1, bits, 0, 0) + body), "a")


def test_numbers_that_cannot_be_drawn_are_left_out() -> None:
    numbers = vars(unpack_ply(pack_ply(some(9, 1)), "a"))
    numbers = {name: values.copy() for name, values in numbers.items()}
    numbers["means"][0, 1] = np.nan
    numbers["means"][1, 1] = 1e9
    numbers["quaternions"][2] = 0
    numbers["log_scales"][3, 0] = np.inf
    numbers["sh"][4, 0, 0] = -np.inf
    numbers["logit_opacities"][5] = np.nan
    numbers["logit_opacities"][6] = np.inf
    numbers["log_scales"][7] = -np.inf
    found, dropped = Splats(**numbers).gaussians("a")
    assert (len(found), dropped) == (3, 6)
    assert found.problem() is None
    assert torch.sigmoid(found.logit_opacities[0]) > 0.999
    with pytest.raises(InputError, match="none of its 1"):
        Splats(**{name: values[:1] for name, values in numbers.items()}).gaussians("a")


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("format ascii 1.0\nelement vertex 1\nproperty float x\n", "not binary and little endian"),
        ("format binary_little_endian 1.0\nelement vertex 1\nproperty float x\n", "has no y, z"),
        ("format binary_little_endian 1.0\nelement vertex 1\nproperty list uchar int x\n", "lists"),
        (
            "format binary_little_endian 1.0\nelement chunk 1\nproperty float min_x\n",
            "begin with its Gaussians",
        ),
    ],
)
def test_other_plys_are_refused(header: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        unpack_ply(f"ply\n{header}end_header\n".encode() + bytes(100), "a")


def test_a_mesh_is_no_splats_and_a_turned_node_is_refused() -> None:
    def changed(change: Callable[[dict], None]) -> bytes:
        file = pack_glb(some(3, 1))
        size = struct.unpack_from("<I", file, 12)[0]
        document = json.loads(file[20 : 20 + size])
        change(document)
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        rest = file[20 + size :]
        return (
            struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON") + text + rest
        )

    same = unpack_glb(changed(lambda d: d["nodes"][0].update(translation=[1, 2, 3])), "a")
    assert np.allclose(same.means - unpack_glb(pack_glb(some(3, 1)), "a").means, [1, 2, 3], atol=1e-5)
    for change, message in (
        (lambda d: d["meshes"][0]["primitives"][0].pop("extensions"), "no Gaussians"),
        (lambda d: d["nodes"][0].update(rotation=[0, 1, 0, 0]), "turns or scales"),
        (lambda d: d["buffers"][0].update(uri="../secret"), "outside the file"),
        (lambda d: d["nodes"][0].update(children=[0]), "no tree"),
        (lambda d: d.update(extensionsRequired=["KHR_draco"]), "needs KHR_draco"),
    ):
        with pytest.raises(InputError, match=message):
            unpack_glb(changed(change), "a")
