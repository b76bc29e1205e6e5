"""PandaSet's ``cameras.json``: the camera, its pixels, and the real folder."""

import json

import numpy as np
import pytest

from dreamdrive.data import read_clip
from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.files import attach
from tests.geometry.backends.files import drives

TRUTH = np.array([drives.pose((0.3, 0.05 * i, 0), (0.1 * i, 0, 1.0 * i)) for i in range(6)])
ENTRY = {
    "width": 160,
    "height": 96,
    "K": [[130.0, 0, 77.0], [0, 125.0, 50.0], [0, 0, 1]],
    "frames": list(range(6)),
    "camera_to_world": TRUTH.tolist(),
}


def write(folder, **cameras):
    return drives.write_json(folder / "cameras.json", {"cameras": cameras}).parent


def test_the_input_or_the_declaration_names_the_camera(tmp_path):
    folder = write(
        tmp_path / "geometry", front=ENTRY, left={**ENTRY, "K": [[99, 0, 1], [0, 99, 1], [0, 0, 1]]}
    )
    got = attach(drives.make_clip(tmp_path / "front", [1, 3]), folder)
    np.testing.assert_allclose(got.known.world_from_camera, drives.relative(TRUTH[[1, 3]]), atol=1e-9)
    camera = got.rig[0]
    assert (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px) == (32.5, 31.25, 77.5 / 4, 50.5 / 4)
    assert got.known.metric
    with pytest.raises(InputError, match=r"the cameras front, left, none called 'clip'.*geometry.json"):
        attach(drives.make_clip(tmp_path / "clip", [1, 3]), folder)
    drives.write_json(folder / "geometry.json", {"camera": "left"})
    assert attach(drives.make_clip(tmp_path / "clip", [1, 3]), folder).rig[0].fx_px == 99 / 4


def test_a_single_camera_needs_no_name(tmp_path):
    folder = write(tmp_path / "geometry", front=ENTRY)
    assert len(attach(drives.make_clip(tmp_path / "clip", [1, 3]), folder)) == 2


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"K": [[1, 2], [3]]}, "front has no usable width, height and K"),
        ({"K": np.full((3, 3), np.nan).tolist()}, "NaN or Infinity, which JSON has not"),
        ({"K": None}, "front has no usable width, height and K"),
        ({"width": "wide"}, "front has no usable width, height and K"),
        ({"width": 96}, "another aspect"),
        ({"camera_to_world": (2 * TRUTH).tolist()}, "not rigid"),
        ({"camera_to_world": TRUTH[:3].tolist(), "frames": [0, 1, 2]}, "has 3 poses, but the input has 6"),
    ],
)
def test_bad_entries_are_refused(tmp_path, change, words):
    folder = write(tmp_path / "geometry", front={**ENTRY, **change})
    with pytest.raises(InputError, match=words):
        attach(drives.make_clip(tmp_path / "front", [1, 3]), folder)
    drives.write_json(folder / "cameras.json", {"cameras": {"front": 3}})
    with pytest.raises(InputError, match="front"):
        attach(drives.make_clip(tmp_path / "front", [1, 3]), folder)


def test_the_real_folder(data_dir):
    folder = data_dir / "clips" / "pandaset_002"
    clip = read_clip(folder / "front_camera", frames="20:40:5")
    got = attach(clip, folder)
    truth = json.loads((folder / "cameras.json").read_text())["cameras"]["front_camera"]
    matrix, poses = np.array(truth["K"]), np.array(truth["camera_to_world"])[20:40:5]
    assert got.known.world_from_camera is not None
    assert got.known.world_from_camera[-1, 2, 3] > 1
    # A point ahead of the last camera, seen by all: its pixel by K as it stands, whose pixels count from 0.
    point = (poses[-1] @ [1.0, -0.5, 20.0, 1.0])[:3]
    in_clip = np.linalg.inv(poses[0]) @ [*point, 1]
    for pose, own in zip(poses, got.known.world_from_camera, strict=True):
        x, y, z = matrix @ (np.linalg.inv(pose) @ [*point, 1])[:3]
        column, row, _ = got.rig[0].at(own).project(in_clip[None, :3])[0]
        np.testing.assert_allclose((column * 4 - 0.5, row * 4 - 0.5), (x / z, y / z), atol=0.01)
