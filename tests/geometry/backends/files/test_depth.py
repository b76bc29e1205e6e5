"""Depth files: every kind, its unit, and the pixel that it lands on."""

import os
import struct

import cv2
import numpy as np
import pytest

from dreamdrive.data.cameras.distortion import Distortion
from dreamdrive.data.cameras.lens import SourceLens
from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.files import attach
from dreamdrive.geometry.backends.files.attach import OntoClip
from dreamdrive.geometry.backends.files.depth import read_depth
from dreamdrive.geometry.backends.files.given import read_declared
from dreamdrive.scene.camera import Camera
from tests.geometry.backends.files import drives

DEPTH = np.linspace(2, 50, 6 * 10, dtype=np.float32).reshape(6, 10)


def test_every_kind_has_a_unit_and_says_when_it_took_one(tmp_path):
    np.savez(tmp_path / "a.npz", depth_m=DEPTH)
    np.savez(tmp_path / "b.npz", depth=DEPTH)
    np.save(tmp_path / "c.npy", DEPTH[..., None])
    cv2.imwrite(str(tmp_path / "d.png"), np.round(DEPTH * 1000).astype(np.uint16))
    expected = {"a.npz": None, "b.npz": "metres", "c.npy": "metres", "d.png": "millimetres"}
    cv2.imwrite(str(tmp_path / "k.png"), np.round(DEPTH * 256).astype(np.uint16))
    theirs, unit = read_depth(tmp_path / "k.png", None, kitti=True)
    np.testing.assert_allclose(theirs, DEPTH, atol=3e-3)
    assert unit == "1/256 m, as KITTI has it"
    for name, said in expected.items():
        depth, unit = read_depth(tmp_path / name, None)
        np.testing.assert_allclose(depth, DEPTH, atol=1e-3)
        assert unit == said
        half, unit = read_depth(tmp_path / name, 1 / 256)
        assert unit is None
        scale = {"a.npz": 1, "d.png": 1000 / 256}.get(name, 1 / 256)
        np.testing.assert_allclose(half, DEPTH * scale, rtol=1e-3)


@pytest.mark.parametrize("channel", ["Z", "V", "R", "RGB", "odd"])
def test_exr_is_read_by_its_package(tmp_path, channel):
    exr = pytest.importorskip("OpenEXR")
    pixels = np.dstack([DEPTH] * 3) if channel == "RGB" else DEPTH
    header = {"compression": exr.ZIP_COMPRESSION, "type": exr.scanlineimage}
    exr.File(header, {channel: pixels}).write(str(tmp_path / "a.exr"))
    depth, unit = read_depth(tmp_path / "a.exr", None)
    np.testing.assert_allclose(depth, DEPTH)
    assert unit == "metres"


def test_exr_without_its_package_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "OpenEXR", None)
    (tmp_path / "a.exr").write_bytes(b"v/1\x01")
    with pytest.raises(InputError, match=r"a.exr.*pip install -e '\.\[exr\]'"):
        read_depth(tmp_path / "a.exr", None)


def test_rubbish_exr_is_refused(tmp_path):
    pytest.importorskip("OpenEXR")
    (tmp_path / "a.exr").write_bytes(b"no picture")
    with pytest.raises(InputError, match="cannot be read as EXR"):
        read_depth(tmp_path / "a.exr", None)


def test_an_exr_is_judged_by_its_header(tmp_path):
    exr = pytest.importorskip("OpenEXR")
    path = tmp_path / "a.exr"
    header = {"compression": exr.ZIP_COMPRESSION, "type": exr.scanlineimage}
    exr.File(header, {"Z": DEPTH}).write(str(path))
    data = bytearray(path.read_bytes())
    path.write_bytes(data[:-20])
    with pytest.raises(InputError, match=r"a\.exr: cannot be read as EXR"):
        read_depth(path, None)
    at = data.index(b"dataWindow") + len("dataWindow\0box2i\0") + 4
    data[at : at + 16] = struct.pack("<4i", 0, 0, 99_999, 99_999)
    path.write_bytes(data)
    with pytest.raises(InputError) as caught:
        read_depth(path, None)
    assert str(caught.value) == f"{path}: states 10000 million numbers; expected at most 32 million"
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(InputError) as caught:
        read_depth(path, None)
    assert str(caught.value) == f"{path} cannot be read: it is not a regular file"


def test_whole_numbers_of_an_exr_need_a_unit(tmp_path):
    exr = pytest.importorskip("OpenEXR")
    header = {"compression": exr.ZIP_COMPRESSION, "type": exr.scanlineimage}
    exr.File(header, {"Z": DEPTH.astype(np.uint32)}).write(str(tmp_path / "a.exr"))
    with pytest.raises(InputError, match=r"holds whole numbers \(uint32\)"):
        read_depth(tmp_path / "a.exr", None)


def test_depth_too_large_for_single_precision_is_refused(tmp_path):
    np.save(tmp_path / "a.npy", np.full((6, 10), 1e300))
    with pytest.raises(InputError, match="holds negative, NaN or infinite depth"):
        read_depth(tmp_path / "a.npy", None)


def test_whole_numbers_need_a_unit(tmp_path):
    np.save(tmp_path / "a.npy", np.full((6, 10), 512, np.uint16))
    with pytest.raises(InputError, match=r"uint16.*depth_unit.*geometry.json"):
        read_depth(tmp_path / "a.npy", None)
    assert read_depth(tmp_path / "a.npy", 1 / 256)[0].max() == 2


@pytest.mark.parametrize(
    "bad", [DEPTH[0], -DEPTH, DEPTH * np.nan, DEPTH > 3, DEPTH * 1j, np.dstack([DEPTH] * 2)]
)
def test_what_is_no_depth_is_refused(tmp_path, bad):
    np.save(tmp_path / "a.npy", bad)
    with pytest.raises(InputError, match=r"a\.npy"):
        read_depth(tmp_path / "a.npy", None)
    (tmp_path / "a.npy").write_bytes(b"rubbish")
    with pytest.raises(InputError, match=r"a\.npy"):
        read_depth(tmp_path / "a.npy", None)


@pytest.mark.parametrize(
    ("content", "unit", "in_poses"),
    [
        ({"depth_unit": "mm"}, 0.001, False),
        ({"depth_unit": "1/256 m"}, 1 / 256, False),
        ({"depth_unit": 0.25}, 0.25, False),
        ({"depth_unit": "poses"}, 1.0, True),
        ({}, None, False),
    ],
)
def test_units_are_declared(tmp_path, content, unit, in_poses):
    drives.write_json(tmp_path / "geometry.json", content)
    declared = read_declared(tmp_path)
    assert (declared.depth_unit, declared.depth_in_poses_unit) == (unit, in_poses)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"depth_unit": "inch"}, "'inch'; expected \"m\""),
        ({"depth_unit": -1}, "depth_unit"),
        ({"depth_unit": True}, "depth_unit"),
        ({"metric": "yes"}, "metric is 'yes'"),
        ({"camera": 3}, "camera is 3"),
        ({"metrc": True}, "metrc is not known; expected metric, depth_unit, camera"),
        ([1], "JSON object"),
    ],
)
def test_wrong_declarations_are_refused(tmp_path, content, words):
    drives.write_json(tmp_path / "geometry.json", content)
    with pytest.raises(InputError, match=words):
        read_declared(tmp_path)


def test_each_pixel_gets_the_depth_under_its_centre():
    picture = np.arange(96 * 160, dtype=np.float32).reshape(96, 160)
    onto = OntoClip((40, 24), (160, 96), (42, 26), (1, 2), None)
    got = onto.depth(picture, False, "depth")
    row, column = 11, 17
    x, y = (column + 0.5 + 1) * 160 / 42, (row + 0.5 + 2) * 96 / 26
    assert got[row, column] == picture[int(y), int(x)]
    # The same picture at half its size, and a picture of the clip's own size.
    assert (
        onto.depth(picture[::2, ::2], False, "depth")[row, column]
        == picture[::2, ::2][int(y / 2), int(x / 2)]
    )
    assert (onto.depth(picture[:24, :40], False, "depth") == picture[:24, :40]).all()


def test_depth_of_a_bent_picture_follows_the_lens():
    camera = Camera(32.5, 32.5, 19.0, 12.5, 40, 24)
    onto = OntoClip(
        (40, 24), (160, 96), (40, 24), (0, 0), SourceLens(Distortion("opencv", (-0.2, 0, 0, 0)), camera)
    )
    columns = np.tile(np.arange(160, dtype=np.float32) + 1, (96, 1))
    got = onto.depth(columns, True, "depth")
    x, y = (2.5 - 19.0) / 32.5, (3.5 - 12.5) / 32.5
    spot = (x * (1 - 0.2 * (x * x + y * y)) * 32.5 + 19.0) * 4
    assert got[3, 2] == int(spot) + 1
    assert onto.depth(columns, False, "depth")[3, 2] == 11


def test_depth_beside_poses_is_called_like_the_images(tmp_path):
    truth = np.array([drives.pose((0, 0, 0), (0, 0, float(i))) for i in range(6)])
    text = "\n".join(" ".join(repr(float(n)) for n in pose[:3].ravel()) for pose in truth)
    (tmp_path / "poses.txt").write_text(text)
    (tmp_path / "depth").mkdir()
    cv2.imwrite(str(tmp_path / "depth" / "frame3.png"), np.full((96, 160), 512, np.uint16))
    drives.write_json(tmp_path / "geometry.json", {"depth_unit": "1/256 m"})
    known = attach(drives.make_clip(tmp_path / "clip", [1, 3], name="frame{}.png"), tmp_path).known
    assert known.depth_m is not None
    assert known.depth_m.max(axis=(1, 2)).tolist() == [0, 2]
