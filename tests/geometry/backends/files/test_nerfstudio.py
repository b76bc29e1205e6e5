"""``transforms.json``: axes, cameras, depth, and what is said about bad ones."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.files import attach, bent_model, companions
from tests.geometry.backends.files import drives

NAMES = [f"images/{i:04d}.png" for i in range(6)]  # other endings than the clip's
TRUTH = np.array([drives.pose((0, 0.02 * i, 0), (0.1 * i, 0, 1.0 * i)) for i in range(6)])


@settings(max_examples=25)
@given(truth=drives.drives(3))
def test_points_land_where_opengl_axes_have_them(tmp_path_factory, truth):
    folder = tmp_path_factory.mktemp("nerfstudio")
    content = drives.transforms(truth, NAMES[:3])
    drives.write_json(folder / "transforms.json", content)
    got = attach(drives.make_clip(folder / "clip", [0, 1, 2], 3), folder)
    np.testing.assert_allclose(got.known.world_from_camera, drives.relative(truth), atol=1e-8)
    for row, frame in enumerate(content["frames"]):
        world, pixels = drives.seen_points(got, truth, row)
        x, y, z, _ = np.linalg.solve(
            np.array(frame["transform_matrix"]), np.column_stack([world, np.ones(7)]).T
        )
        column = content["cx"] + content["fl_x"] * x / -z
        line = content["cy"] - content["fl_y"] * y / -z
        np.testing.assert_allclose(pixels * 4, np.column_stack([column, line]), atol=1e-5)
    assert not got.known.metric


def test_cameras_may_be_each_frames_own_and_short(tmp_path):
    content = drives.transforms(TRUTH, NAMES)
    for key in ("fl_x", "fl_y", "cx", "cy", "camera_model"):
        del content[key]
    content["camera_angle_x"] = 2 * np.arctan(80 / 130)
    content["frames"][1] |= {"fl_x": 100.0, "cx": 70.0, "cy": 40.0}
    path = drives.write_json(tmp_path / "transforms.json", content)
    got = attach(drives.make_clip(tmp_path / "clip", [0, 1, 2]), path)
    assert got.camera.tolist() == [0, 1, 0]
    first, second = got.rig
    assert (first.fx_px, first.fy_px, first.cx_px) == (pytest.approx(32.5), pytest.approx(32.5), 20.0)
    assert (second.fx_px, second.fy_px, second.cx_px, second.cy_px) == (25.0, 25.0, 17.5, 10.0)


def test_a_bent_lens_asks_to_be_taken_out(tmp_path):
    content = drives.transforms(TRUTH, NAMES, camera_model="OPENCV", k1=-0.1)
    path = drives.write_json(tmp_path / "transforms.json", content)
    assert bent_model(tmp_path) == path
    with pytest.raises(InputError, match=r"lens distortion opencv -0.1 0 0 0.*--intrinsics"):
        attach(drives.make_clip(tmp_path / "clip", [0, 1]), path)


def test_depth_counts_in_the_unit_of_the_poses(tmp_path):
    content = drives.transforms(TRUTH, NAMES)
    content["frames"][1]["depth_file_path"] = "deep/b.npy"
    path = drives.write_json(tmp_path / "transforms.json", content)
    (tmp_path / "deep").mkdir()
    np.save(tmp_path / "deep" / "b.npy", np.full((96, 160), 4000, np.int32))
    clip = drives.make_clip(tmp_path / "clip", [0, 1])
    got = attach(clip, path)
    assert got.known.depth_m is not None
    assert np.unique(got.known.depth_m[1]).tolist() == [4.0]
    assert not got.known.depth_m[0].any()
    assert not got.known.metric
    assert any("depth_unit_scale_factor" in note for note in got.provenance["notes"])
    assert companions(tmp_path) == [tmp_path / "deep" / "b.npy"]

    drives.write_json(path, {**content, "depth_unit_scale_factor": 0.01})
    drives.write_json(tmp_path / "geometry.json", {"metric": True})
    got = attach(clip, path)
    assert np.unique(got.known.depth_m[1]).tolist() == [40.0]
    assert got.known.metric
    assert not any("depth_unit_scale_factor" in note for note in got.provenance["notes"])


def change_frame(**changes: object) -> dict:
    content = drives.transforms(TRUTH, NAMES)
    content["frames"][1] |= changes
    return content


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (drives.transforms(TRUTH, NAMES, camera_model="EQUIRECTANGULAR"), "EQUIRECTANGULAR.*not known"),
        (drives.transforms(TRUTH, NAMES, w=96), "another aspect"),
        (drives.transforms(TRUTH, NAMES, fl_x=None), "number for fl_x"),
        (drives.transforms(TRUTH, NAMES, fl_x=-3), "positive"),
        (drives.transforms(TRUTH, NAMES, cx=float("nan")), "NaN or Infinity, which JSON has not"),
        (drives.transforms(TRUTH, NAMES, w=12.5), "whole pixels"),
        (drives.transforms(TRUTH, NAMES, k4=0.1), "k4 0.1 belongs to OPENCV_FISHEYE"),
        (drives.transforms(TRUTH, NAMES, frames=[]), "expected frames"),
        (drives.transforms(TRUTH, NAMES, depth_unit_scale_factor=0), "depth_unit_scale_factor"),
        (drives.transforms(TRUTH[:1], NAMES[:1]), "1 of the 2 selected frames: 0001.jpg"),
        (change_frame(transform_matrix=(2 * np.eye(4)).tolist()), "images/0001.png is not rigid"),
        (
            change_frame(transform_matrix=np.full((4, 4), np.nan).tolist()),
            "NaN or Infinity, which JSON has not",
        ),
        (change_frame(transform_matrix=[[1, 2], [3]]), "no 4x4 matrix"),
        (change_frame(transform_matrix=None), "no 4x4 matrix"),
        (change_frame(file_path=3), "frame 1 .* has no file_path"),
        (change_frame(depth_file_path="none.png"), "none.png of images/0001.png is no file"),
    ],
)
def test_bad_files_are_refused(tmp_path, content, words):
    path = drives.write_json(tmp_path / "transforms.json", content)
    with pytest.raises(InputError, match=words) as caught:
        attach(drives.make_clip(tmp_path / "clip", [0, 1]), path)
    assert str(path) in str(caught.value)


@settings(max_examples=40)
@given(
    key=st.sampled_from(
        ["w", "h", "fl_x", "cx", "camera_model", "k1", "frames", "transform_matrix", "file_path"]
    ),
    value=st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=3),
        lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=2), inner, max_size=2),
        max_leaves=6,
    ),
)
def test_any_damage_is_an_input_error_or_no_damage(tmp_path_factory, key, value):
    folder = tmp_path_factory.mktemp("damage")
    content = drives.transforms(TRUTH[:2], NAMES[:2])
    (content if key in content else content["frames"][0])[key] = value
    drives.write_json(folder / "transforms.json", content)
    try:
        got = attach(drives.make_clip(folder / "clip", [0, 1], 2), folder)
    except InputError:
        return
    assert got.known.world_from_camera is not None
    assert np.isfinite(got.known.world_from_camera).all()
