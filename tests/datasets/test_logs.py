"""Drives become clips."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from dreamdrive.data.frames.cuts import Cut, Found
from dreamdrive.datasets import logs
from dreamdrive.datasets.logs import CAR_FROM_EGO, choose_shots, clip_of_log, files_of
from dreamdrive.errors import InputError
from tests.logs import log


@pytest.fixture
def drive(tmp_path):
    return log(tmp_path / "made")


def test_one_camera_is_a_clip_with_known_poses(drive):
    clip = clip_of_log(drive, size=(32, 24), hold_out=4)
    assert len(clip) == 13
    assert len(clip.rig) == 1
    assert clip.size == (32, 24)
    np.testing.assert_array_equal(np.flatnonzero(clip.held_out), [2, 6, 10])
    np.testing.assert_allclose(clip.times_s, np.arange(13) / 10)
    poses = clip.known.world_from_camera
    camera = drive.cameras[0]
    np.testing.assert_array_equal(poses[0], np.eye(4))
    wanted = np.linalg.inv(camera.world_from_camera[0]) @ camera.world_from_camera[7]
    np.testing.assert_allclose(poses[7], wanted, atol=1e-9)
    assert clip.known.intrinsics
    np.testing.assert_allclose(clip.rig[0].fx_px, 25.0)
    np.testing.assert_array_equal(clip.rig[0].world_from_camera, np.eye(4))


def test_a_clip_lies_where_its_first_picture_was_taken(drive):
    clip = clip_of_log(drive, cameras="back_left,front", frames="2:5", size=(32, 24))
    back = drive.cameras[1]
    assert (clip.log.name, clip.log.start_s, clip.log.level_z_m) == ("scene-0001", back.times_s[2], None)
    np.testing.assert_array_equal(clip.log.log_from_world, back.world_from_camera[2])
    placed = np.array(clip.log.log_from_world) @ clip.known.world_from_camera[clip.of_camera(1)]
    np.testing.assert_allclose(placed, drive.cameras[0].world_from_camera[2:5], atol=1e-9)


def test_all_cameras_are_woven_in_the_order_of_time(drive):
    clip = clip_of_log(drive, cameras="all", frames="1:12:2", size=(32, 24))
    np.testing.assert_array_equal(clip.camera, [0, 1] * 6)
    np.testing.assert_allclose(clip.times_s, np.repeat(np.arange(6) * 0.2, 2), atol=1e-9)
    camera = drive.cameras[1]
    wanted = np.linalg.inv(drive.cameras[0].world_from_camera[1]) @ camera.world_from_camera[3]
    np.testing.assert_allclose(clip.known.world_from_camera[3], wanted, atol=1e-9)
    np.testing.assert_allclose(clip.rig[1].world_from_camera, CAR_FROM_EGO @ camera.ego_from_camera)
    # Ahead of the car is z, and the camera at the back looks there with a negative share.
    assert clip.rig[0].world_from_camera[2, 2] == pytest.approx(1.0)
    assert clip.rig[1].world_from_camera[2, 2] < 0


def test_cameras_with_fewer_pictures_are_said(drive):
    back = drive.cameras[1]
    fewer = replace(
        back,
        files=back.files[::5],
        times_s=back.times_s[::5],
        world_from_camera=back.world_from_camera[::5],
        key=back.key[::5],
    )
    clip = clip_of_log(replace(drive, cameras=(drive.cameras[0], fewer)), cameras="all", size=(32, 24))
    assert np.bincount(clip.camera).tolist() == [13, 3]
    assert "Of 13 times, pictures are there of CAM_BACK_LEFT at 3 only." in clip.provenance["notes"]
    np.testing.assert_array_equal(clip.step[clip.camera == 1], [0, 1, 2])


def test_cuts_are_told_by_the_numbers_of_the_source(drive, monkeypatch):
    """Not by those of the clip, in which two cameras alternate."""
    monkeypatch.setattr(logs, "find_cuts", lambda frames, valid: Found((Cut(1, 2),)))
    clip = clip_of_log(drive, cameras="all", frames="3:13:3", size=(32, 24))
    said = (
        "The picture cuts to another scene at frame 9 of the source; --frames 3:7:3 or 9:13:3 keeps to one."
    )
    assert said in clip.provenance["notes"]
    assert clip.cuts == (4, 5)


def test_each_camera_holds_out_its_own(drive):
    clip = clip_of_log(drive, cameras="all", size=(32, 24), hold_out=4)
    for camera in (0, 1):
        np.testing.assert_array_equal(np.flatnonzero(clip.held_out[clip.camera == camera]), [2, 6, 10])


def test_cameras_are_chosen_in_the_order_asked(drive):
    shots = choose_shots(drive, "back_left,front", "0:4")
    assert [each.camera.name for each in shots] == ["CAM_BACK_LEFT", "CAM_FRONT"]
    with pytest.raises(InputError, match="a camera is named twice"):
        choose_shots(drive, "front,CAM_FRONT")


def test_of_too_many_pictures_every_nth_is_taken(drive, monkeypatch):
    """Of all cameras together; a choice of frames is taken as it is."""
    monkeypatch.setattr(logs, "MAX_FRAMES", 14)
    said = "every second one is taken"
    clip = clip_of_log(drive, cameras="all", size=(32, 24))
    assert clip.source_index[clip.camera == 0].tolist() == [0, 2, 4, 6, 8, 10, 12]
    assert clip.source_index[clip.camera == 1].tolist() == [0, 2, 4, 6, 8, 10, 12]
    assert said in " ".join(clip.provenance["notes"])
    whole = clip_of_log(drive, size=(32, 24))
    assert len(whole) == 13
    assert said not in " ".join(whole.provenance["notes"])
    assert len(clip_of_log(drive, cameras="all", frames="0:13", size=(32, 24))) == 26


def test_a_single_picture_is_refused(drive):
    with pytest.raises(InputError, match="a single picture is chosen; expected at least two"):
        choose_shots(drive, None, "3:4")


def test_a_camera_of_other_times_is_refused(drive):
    back = drive.cameras[1]
    later = replace(drive, cameras=(drive.cameras[0], replace(back, times_s=back.times_s + 100)))
    with pytest.raises(InputError, match=r"CAM_BACK_LEFT of scene-0001 has no picture within 0\.06 s"):
        choose_shots(later, "all")


def test_too_few_to_hold_out_names_the_camera(drive):
    with pytest.raises(InputError, match="CAM_FRONT of scene-0001: --hold-out 8 withholds nothing of 3"):
        clip_of_log(drive, frames="0:3", hold_out=8)


def test_files_and_poses_decide(drive):
    files, told = files_of(choose_shots(drive, "all", "0:4"))
    assert len(files) == 8
    moved = replace(drive.cameras[0], world_from_camera=drive.cameras[0].world_from_camera @ np.eye(4))
    assert told == files_of(choose_shots(replace(drive, cameras=(moved, drive.cameras[1])), "all", "0:4"))[1]
    lens = replace(drive.cameras[0], pinhole=replace(drive.cameras[0].pinhole, fx_px=60.0))
    assert told != files_of(choose_shots(replace(drive, cameras=(lens, drive.cameras[1])), "all", "0:4"))[1]


def test_pictures_of_another_size_are_named(drive):
    wrong = replace(drive.cameras[0].pinhole, width_px=65)
    with pytest.raises(InputError, match=r"00.png is 64x48, but the tables of scene-0001 say 65x48"):
        clip_of_log(replace(drive, cameras=(replace(drive.cameras[0], pinhole=wrong),)))


def reshaped(drive, size):
    """The drive, whose second camera has pictures of another size."""
    back = drive.cameras[1]
    for file in back.files:
        cv2.imwrite(str(file), cv2.resize(cv2.imread(str(file)), size))
    pinhole = replace(back.pinhole, width_px=size[0], height_px=size[1], cx_px=size[0] / 2, cy_px=size[1] / 2)
    return replace(drive, cameras=(drive.cameras[0], replace(back, pinhole=pinhole)))


def test_a_camera_of_another_shape_is_cut_to_that_of_the_first_and_that_is_said(drive):
    clip = clip_of_log(reshaped(drive, (64, 36)), cameras="all", frames="0:3", size=(32, 24))
    assert clip.size == (32, 24)
    # Of the 64 columns 48 are left, at two thirds of their size.
    assert clip.rig[1].fx_px == pytest.approx(drive.cameras[1].pinhole.fx_px * 43 / 64)
    assert clip.rig[1].cx_px == pytest.approx(21.5 - 5)
    assert (
        "CAM_BACK_LEFT: 25 % of its pictures is cut away to the shape of CAM_FRONT."
        in clip.provenance["notes"]
    )


def test_a_portrait_beside_landscapes_is_refused_by_name(drive):
    with pytest.raises(
        InputError, match=r"CAM_FRONT has pictures of 64x48, CAM_BACK_LEFT of 48x64: of these 44 %"
    ):
        clip_of_log(reshaped(drive, (48, 64)), cameras="all", frames="0:3")
