"""KITTI and TUM: poses alone, and KITTI's calibration."""

import numpy as np
import pytest
from hypothesis import given, settings

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.files import attach, companions
from tests.geometry.backends.files import drives

TRUTH = np.array([drives.pose((0, 0.05 * i, 0), (0.1 * i, 0, 1.0 * i)) for i in range(6)])
CALIBRATION = (
    "P0: 130 0 77 0 0 125 50 0 0 0 1 0\n"
    "P1: 130 0 77 -65 0 125 50 0 0 0 1 0\n"
    "P2: 131 0 76 26.2 0 125 50 12.5 0 0 1 0\n"
)


def kitti(truth: np.ndarray) -> str:
    return "\n".join(" ".join(repr(float(n)) for n in pose[:3].ravel()) for pose in truth) + "\n"


def tum(truth: np.ndarray, times: np.ndarray) -> str:
    lines = ["# time x y z qx qy qz qw"]
    for pose, time in zip(truth, times, strict=True):
        w, x, y, z = drives.quaternion_wxyz(pose[:3, :3])
        lines.append(" ".join(repr(float(n)) for n in (time, *pose[:3, 3], x, y, z, w)))
    return "\n".join(lines)


@settings(max_examples=20)
@given(truth=drives.drives(3))
def test_poses_survive_both_formats(tmp_path_factory, truth):
    folder = tmp_path_factory.mktemp("lists")
    clip = drives.make_clip(folder / "clip", [0, 1, 2], 3)
    path = folder / "poses.txt"
    for text in (kitti(truth), tum(truth, 0.1 * np.arange(3))):
        path.write_text(text)
        got = attach(clip, path)
        np.testing.assert_allclose(got.known.world_from_camera, drives.relative(truth), atol=1e-8)
        assert got.rig == clip.rig
        assert not got.known.intrinsics
        assert got.known.metric


def test_times_choose_among_more_poses(tmp_path):
    truth = np.repeat(TRUTH, 2, axis=0)[:11]
    (tmp_path / "traj.txt").write_text(tum(truth, 0.05 * np.arange(11)))
    got = attach(drives.make_clip(tmp_path / "clip", [2, 4]), tmp_path / "traj.txt")
    np.testing.assert_allclose(got.known.world_from_camera, drives.relative(TRUTH[[2, 4]]), atol=1e-9)


@pytest.mark.parametrize(("name", "row"), [("image_2", 2), ("image_0", 0), ("clip", 0), ("image_1", 1)])
def test_kittis_calibration_gives_the_pinhole_and_the_place_of_the_camera(tmp_path, name, row):
    (tmp_path / "poses.txt").write_text(kitti(TRUTH))
    (tmp_path / "calib.txt").write_text(CALIBRATION)
    got = attach(drives.make_clip(tmp_path / name, [1, 3]), tmp_path)
    matrix = np.array([float(n) for n in CALIBRATION.splitlines()[row].split()[1:]]).reshape(3, 4)
    # A point's pixel by KITTI's own formula, in the frame of camera 0; its pixels count from 0.
    point = np.array([0.7, -0.4, 9.0, 1.0])
    theirs = matrix @ point
    camera = np.array([-np.linalg.solve(matrix[:, :3], matrix[:, 3])])[0]
    own = point[:3] - camera
    seen = got.rig[0].project(own[None])[0, :2] * 4
    np.testing.assert_allclose(seen, theirs[:2] / theirs[2] + 0.5, atol=1e-9)
    placed = TRUTH.copy()
    placed[:, :3, 3] += TRUTH[:, :3, :3] @ camera
    np.testing.assert_allclose(got.known.world_from_camera, drives.relative(placed[[1, 3]]), atol=1e-9)
    assert any(f"the clip as camera {row}" in note for note in got.provenance["notes"])
    assert companions(tmp_path / "poses.txt") == [tmp_path / "calib.txt"]


def test_geometry_json_names_the_camera_and_the_unit(tmp_path):
    (tmp_path / "poses.txt").write_text(kitti(TRUTH))
    (tmp_path / "calib.txt").write_text(CALIBRATION)
    drives.write_json(tmp_path / "geometry.json", {"camera": "P2", "metric": False})
    got = attach(drives.make_clip(tmp_path / "clip", [1, 3]), tmp_path)
    assert got.rig[0].fx_px == 131 / 4
    assert not got.known.metric


@pytest.mark.parametrize(
    ("poses", "calibration", "words"),
    [
        (kitti(TRUTH[:4]), None, "has 4 poses, but the input has 6 frames, 2 of them selected"),
        (kitti(2 * TRUTH), None, "line 1 is not rigid"),
        (kitti(TRUTH * np.nan), None, "line 1 holds NaN"),
        ("1 2 3\n", None, "3 numbers a line"),
        (tum(TRUTH, 100 + 7.0 * np.arange(6))[:-400], None, "numbers|poses"),
        (kitti(TRUTH), "P1: 1 2 3\n", "a line P0: with 12 numbers, got P1"),
        (kitti(TRUTH), "P0: a b\n", "cannot be read as KITTI's calibration"),
        (kitti(TRUTH), "P0: " + "0 " * 12, "positive"),
    ],
)
def test_bad_files_are_refused(tmp_path, poses, calibration, words):
    (tmp_path / "poses.txt").write_text(poses)
    if calibration:
        (tmp_path / "calib.txt").write_text(calibration)
    with pytest.raises(InputError, match=words):
        attach(drives.make_clip(tmp_path / "clip", [0, 1]), tmp_path)
