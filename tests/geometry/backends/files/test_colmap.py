"""COLMAP's models: conventions, matching, lenses, and what is said about bad ones."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pycolmap
import pytest
from hypothesis import given, settings

from dreamdrive.data.cameras.lens import SourceLens
from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.files import attach, bent_model
from dreamdrive.scene.camera import Camera
from tests.geometry.backends.files import drives

NAMES = [f"{i:04d}.jpg" for i in range(6)]
TRUTH = np.array([drives.pose((0, 0.02 * i, 0), (0.1 * i, 0, 1.0 * i)) for i in range(6)])


@settings(max_examples=25)
@given(truth=drives.drives(3))
def test_poses_survive_and_points_land_where_colmap_has_them(tmp_path_factory, truth):
    folder = tmp_path_factory.mktemp("colmap")
    clip = drives.make_clip(folder / "clip", [0, 1, 2], 3)
    drives.write_colmap_text(folder / "model", truth, NAMES[:3])
    got = attach(clip, folder / "model")
    assert got.known.world_from_camera is not None
    np.testing.assert_allclose(got.known.world_from_camera, drives.relative(truth), atol=1e-8)
    # COLMAP's own projection, at the picture's size, a quarter of it being the clip's.
    native = pycolmap.Reconstruction(str(folder / "model"))
    for row in range(3):
        world, pixels = drives.seen_points(got, truth, row)
        image = native.images[row + 1]
        theirs = native.cameras[1].img_from_cam(
            (world @ image.cam_from_world().rotation.matrix().T) + image.cam_from_world().translation
        )
        np.testing.assert_allclose(pixels * 4, theirs, atol=1e-5)


@pytest.mark.parametrize("binary", [True, False])
def test_what_pycolmap_writes_is_read_and_names_decide(tmp_path, binary):
    drives.write_colmap_text(tmp_path / "text", TRUTH, [f"front/{name}" for name in reversed(NAMES)])
    native = pycolmap.Reconstruction(str(tmp_path / "text"))
    (tmp_path / "model" / "sparse" / "0").mkdir(parents=True)
    (native.write_binary if binary else native.write_text)(str(tmp_path / "model" / "sparse" / "0"))
    got = attach(drives.make_clip(tmp_path / "clip", [1, 3]), tmp_path / "model")
    np.testing.assert_allclose(got.known.world_from_camera, drives.relative(TRUTH[[4, 2]]), atol=1e-9)
    assert not got.known.metric
    assert got.known.intrinsics
    camera = got.rig[0]
    assert (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px) == (32.5, 31.25, 77.25 / 4, 50.5 / 4)


def test_a_cropped_clip_keeps_the_principal_point_exactly(tmp_path):
    drives.write_colmap_text(tmp_path / "model", TRUTH, NAMES)
    clip = drives.make_clip(tmp_path / "clip", [0, 1], scaled=(42, 25), offset=(1, 0))
    camera = attach(clip, tmp_path / "model").rig[0]
    assert camera.fx_px == pytest.approx(130 * 42 / 160)
    assert camera.cx_px == pytest.approx(77.25 * 42 / 160 - 1)
    assert camera.cy_px == pytest.approx(50.5 * 25 / 96)


def test_other_names_count_in_order(tmp_path):
    names = [f"shot{i}.png" for i in range(8, 14)]  # 8, 9, 10: natural order, not that of letters
    drives.write_colmap_text(tmp_path / "model", TRUTH, names)
    got = attach(drives.make_clip(tmp_path / "clip", [1, 4]), tmp_path / "model")
    np.testing.assert_allclose(got.known.world_from_camera, drives.relative(TRUTH[[1, 4]]), atol=1e-9)
    assert any("order of their names" in note for note in got.provenance["notes"])
    got = attach(drives.make_clip(tmp_path / "clip", [0, 1, 2, 3, 4, 5]), tmp_path / "model")
    assert len(got.known.world_from_camera) == 6


def test_pictures_that_were_not_registered_are_left_out_and_named(tmp_path):
    rows = [0, 1, 3, 5]
    drives.write_colmap_text(tmp_path / "model", TRUTH[rows], [NAMES[row] for row in rows])
    clip = drives.make_clip(tmp_path / "clip", [0, 1, 2, 3, 4, 5])
    got = attach(replace(clip, held_out=np.arange(6) == 1), tmp_path / "model")
    assert got.source_index.tolist() == rows
    np.testing.assert_array_equal(got.frames, clip.frames[rows])
    np.testing.assert_allclose(got.times_s, clip.times_s[rows] - clip.times_s[0])
    np.testing.assert_allclose(got.known.world_from_camera, drives.relative(TRUTH[rows]), atol=1e-9)
    assert got.held_out.tolist() == [False, True, False, False]
    assert any(
        "2 of the 6 selected frames: 0002.jpg, 0004.jpg: these frames" in n for n in got.provenance["notes"]
    )


def test_a_clip_that_loses_its_start_begins_at_time_0_and_sees_its_ends(tmp_path):
    drives.write_colmap_text(tmp_path / "model", TRUTH[2:], NAMES[2:])
    clip = drives.make_clip(tmp_path / "clip", [0, 1, 2, 3, 4, 5])
    got = attach(replace(clip, held_out=np.arange(6) == 2), tmp_path / "model")
    assert got.times_s[0] == 0
    assert not got.held_out.any()
    np.testing.assert_array_equal(got.known.world_from_camera[0], np.eye(4))


def test_missing_pictures_are_named(tmp_path):
    drives.write_colmap_text(tmp_path / "model", TRUTH[:2], NAMES[:2])
    with pytest.raises(
        InputError, match=r"3 of the 4 selected frames: 0002.jpg, 0003.jpg, 0004.jpg; expected"
    ):
        attach(drives.make_clip(tmp_path / "clip", [1, 2, 3, 4]), tmp_path / "model")
    drives.write_colmap_text(tmp_path / "model", TRUTH[:3], ["a.jpg", "b.jpg", "c.jpg"])
    with pytest.raises(InputError, match=r"poses for 3 pictures.*6 frames of the input or of the 2 selected"):
        attach(drives.make_clip(tmp_path / "clip", [1, 2]), tmp_path / "model")


def test_one_name_in_two_folders_needs_the_input_folders_name(tmp_path):
    names = ["left/0000.jpg", "left/0001.jpg", "front/0000.jpg", "front/0001.jpg"]
    drives.write_colmap_text(tmp_path / "model", TRUTH[:4], names)
    got = attach(drives.make_clip(tmp_path / "front", [0, 1]), tmp_path / "model")
    np.testing.assert_allclose(got.known.world_from_camera, drives.relative(TRUTH[2:4]), atol=1e-9)
    with pytest.raises(InputError, match=r"several pictures called 0000.jpg: left/0000.jpg, front/0000.jpg"):
        attach(drives.make_clip(tmp_path / "clip", [0, 1]), tmp_path / "model")


MODELS = [
    ("SIMPLE_RADIAL", [130.0, 77.25, 50.5, -0.1], (-0.1, 0, 0, 0)),
    ("RADIAL", [130.0, 77.25, 50.5, -0.1, 0.02], (-0.1, 0.02, 0, 0)),
    ("OPENCV", [130.0, 125.0, 77.25, 50.5, -0.1, 0.02, 0.001, -0.002], (-0.1, 0.02, 0.001, -0.002)),
    ("OPENCV_FISHEYE", [130.0, 125.0, 77.25, 50.5, 0.1, 0.02, 0.01, -0.02], (0.1, 0.02, 0.01, -0.02)),
]


@pytest.mark.parametrize(("model", "numbers", "bend"), MODELS)
def test_a_bent_lens_needs_frames_without_it(tmp_path, model, numbers, bend):
    folder = drives.write_colmap_text(tmp_path / "model", TRUTH, NAMES, model, numbers)
    assert bent_model(folder) == folder
    with pytest.raises(InputError, match=r"lens distortion .*--intrinsics"):
        attach(drives.make_clip(tmp_path / "clip", [0, 1]), folder)
    about = {"model": "fisheye" if "FISHEYE" in model else "opencv", "coefficients": list(bend)}
    pinhole = {"fx": 32.5, "fy": 31.25, "cx": 19.0, "cy": 12.5}
    lens = {"width": 40, "height": 24, "pinhole": pinhole, "distortion": about}
    clip = drives.make_clip(tmp_path / "clip", [0, 1], lens=lens)
    got = attach(clip, folder)
    assert got.rig == clip.rig
    np.testing.assert_allclose(got.known.world_from_camera, drives.relative(TRUTH[:2]), atol=1e-9)
    # The same bend as COLMAP's own.
    ray = np.array([[0.2, -0.15, 1.0]])
    bent = SourceLens.from_json(lens).distortion.distort(ray[:, :2])[0]
    camera = pycolmap.Reconstruction(str(folder)).cameras[1]
    focal = (camera.focal_length_x, camera.focal_length_y)
    np.testing.assert_allclose(bent * focal + (77.25, 50.5), camera.img_from_cam(ray)[0], atol=1e-9)


def test_pinholes_ask_for_no_lens(tmp_path):
    folder = drives.write_colmap_text(tmp_path / "m", TRUTH, NAMES, "SIMPLE_PINHOLE", [130.0, 77.25, 50.5])
    assert bent_model(folder) is None
    assert bent_model(tmp_path / "none") is None


def test_a_lens_of_another_kind_is_named(tmp_path):
    drives.write_colmap_text(tmp_path / "model", TRUTH, NAMES, "FOV", [130.0, 125.0, 77.25, 50.5, 0.9])
    with pytest.raises(InputError, match=r"camera model FOV is not known.*image_undistorter"):
        attach(drives.make_clip(tmp_path / "clip", [0, 1]), tmp_path / "model")


def test_a_pinhole_unlike_the_undistorted_frames_is_refused(tmp_path):
    drives.write_colmap_text(tmp_path / "model", TRUTH, NAMES)
    lens = SourceLens(bent_lens(), Camera(40.0, 40.0, 20.0, 12.0, 40, 24)).to_json()
    with pytest.raises(InputError, match="undistorted to one of 40"):
        attach(drives.make_clip(tmp_path / "clip", [0, 1], lens=lens), tmp_path / "model")


def bent_lens():
    from dreamdrive.data.cameras.distortion import Distortion

    return Distortion("opencv", (-0.1, 0.0, 0.0, 0.0))


def test_each_frame_may_have_a_camera_of_its_own(tmp_path):
    folder = drives.write_colmap_text(tmp_path / "model", TRUTH[:3], NAMES[:3])
    second = "2 PINHOLE 160 96 140.0 135.0 80.0 48.0\n"
    (folder / "cameras.txt").write_text((folder / "cameras.txt").read_text() + second)
    text = (folder / "images.txt").read_text()
    (folder / "images.txt").write_text(text.replace(" 1 0001.jpg", " 2 0001.jpg"))
    got = attach(drives.make_clip(tmp_path / "clip", [0, 1, 2]), folder)
    assert got.camera.tolist() == [0, 1, 0]
    assert [camera.fx_px for camera in got.rig] == [32.5, 35.0]


def test_metres_may_be_declared(tmp_path):
    folder = drives.write_colmap_text(tmp_path / "model", TRUTH, NAMES)
    drives.write_json(folder / "geometry.json", {"metric": True})
    assert attach(drives.make_clip(tmp_path / "clip", [0, 1]), folder).known.metric


def test_sparse_points_come_along_in_the_world_of_the_first_frame(tmp_path):
    points = TRUTH[2, :3, 3] + np.random.default_rng(0).uniform((-2, -1, 4), (2, 1, 9), (80, 3))
    folder = drives.write_colmap_text(tmp_path / "model", TRUTH, NAMES, points=points)
    got = attach(drives.make_clip(tmp_path / "clip", [2, 3]), folder).known.points
    assert got is not None
    expected = (points - TRUTH[2, :3, 3]) @ TRUTH[2, :3, :3]
    np.testing.assert_allclose(got[np.argsort(got[:, 0])], expected[np.argsort(expected[:, 0])], atol=1e-9)


def test_depth_in_metres_scales_the_model_by_its_points(tmp_path):
    local = np.random.default_rng(0).uniform((-0.4, -0.3, 1), (0.4, 0.3, 1), (200, 3)) * 5
    truth = TRUTH[:2].copy()
    truth[1] = truth[0]
    truth[1, 0, 3] = 0.01
    folder = drives.write_colmap_text(tmp_path / "model", truth, NAMES[:2], points=local)
    (folder / "depth").mkdir()
    np.save(folder / "depth" / "0000.npy", np.full((96, 160), 15.0, np.float32))
    got = attach(drives.make_clip(tmp_path / "clip", [0, 1], 2), folder)
    assert got.known.metric
    assert got.known.world_from_camera is not None
    assert got.known.world_from_camera[1, 0, 3] == pytest.approx(0.03)
    words = " ".join(got.provenance["notes"])
    assert "3 m a unit" in words
    assert "npy as metres is taken" in words
    assert "1 of 2 frames have a depth file" in words


def test_depth_in_metres_and_no_points_is_refused_unless_declared(tmp_path):
    folder = drives.write_colmap_text(tmp_path / "model", TRUTH, NAMES)
    (folder / "depth").mkdir()
    np.save(folder / "depth" / "0000.npy", np.full((96, 160), 15.0, np.float32))
    clip = drives.make_clip(tmp_path / "clip", [0, 1])
    with pytest.raises(InputError, match=r'"metric": true.*"depth_unit": "poses"'):
        attach(clip, folder)
    drives.write_json(folder / "geometry.json", {"depth_unit": "poses"})
    known = attach(clip, folder).known
    assert not known.metric
    assert known.depth_m is not None
    assert known.depth_m[0].max() == 15


@pytest.mark.parametrize(
    ("file", "change", "words"),
    [
        ("points3D.txt", None, "points3D.txt is missing"),
        ("images.txt", "1 nan 0 0 0 1 2 3 1 0000.jpg\n\n", "damaged|NaN"),
        ("images.txt", "1 1 0 0 0 1 2 inf 1 0000.jpg\n\n", "damaged|NaN"),
        ("images.txt", "1 1 0 0 0 1 2 x 1 0000.jpg\n\n", "damaged"),
        ("images.txt", "1 1 0 0 0 1 2 3 9 0000.jpg\n\n", "damaged"),
        ("images.txt", "", "no picture with a pose"),
        ("cameras.txt", "1 PINHOLE 160 96 130\n", "damaged"),
        ("cameras.txt", "1 PINHOLE 160 96 -130 125 80 48\n", "positive|damaged"),
        ("cameras.txt", "1 PINHOLE 160 96 nan 125 80 48\n", "NaN|damaged"),
        ("cameras.txt", "1 PINHOLE 160 160 130 125 80 48\n", "another aspect"),
        ("cameras.txt", "nothing\n", "damaged"),
    ],
)
def test_a_damaged_model_is_refused(tmp_path, file, change, words):
    folder = drives.write_colmap_text(tmp_path / "model", TRUTH[:2], NAMES[:2])
    if change is None:
        (folder / file).unlink()
    else:
        (folder / file).write_text(change)
    with pytest.raises(InputError, match=words) as caught:
        attach(drives.make_clip(tmp_path / "clip", [0], 2), folder)
    assert str(folder) in str(caught.value)


@pytest.mark.parametrize("file", ["cameras.bin", "images.bin", "points3D.bin"])
@pytest.mark.parametrize("rubbish", ["empty", "ones", "cut short"])
def test_damaged_binary_files_are_refused(tmp_path: Path, file, rubbish):
    drives.write_colmap_text(tmp_path / "text", TRUTH[:2], NAMES[:2], points=np.ones((3, 3)))
    folder = tmp_path / "model"
    folder.mkdir()
    pycolmap.Reconstruction(str(tmp_path / "text")).write_binary(str(folder))
    whole = (folder / file).read_bytes()
    damage = {"empty": b"", "ones": b"\xff" * 80, "cut short": whole[:-9]}
    (folder / file).write_bytes(damage[rubbish])
    with pytest.raises(InputError, match="damaged"):
        attach(drives.make_clip(tmp_path / "clip", [0, 1], 2), folder)
