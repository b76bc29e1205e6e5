"""Reading nuScenes, whole and broken: what is wrong is named, and the rest works."""

import json

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dreamdrive.datasets.lidar_file import read_points
from dreamdrive.datasets.nuscenes import NUSCENES, is_nuscenes, read_nuscenes
from dreamdrive.errors import InputError
from dreamdrive.export.nuscenes.writer import write_nuscenes
from tests.logs import log as made_up


def said(log) -> str:
    return "\n".join(log.problems)


def test_a_folder_is_known_by_its_tables(folder, tmp_path):
    assert is_nuscenes(folder)
    assert is_nuscenes(folder / "v1.0-mini")
    assert not is_nuscenes(tmp_path)
    assert not is_nuscenes(tmp_path / "nothing")


def test_attributes_tell_what_moves(folder):
    moves = {box.category: box.moves.tolist() for box in read_nuscenes(folder, "scene-0001").boxes}
    assert moves["vehicle.car"] == [1, 1, 1]
    assert moves["vehicle.truck"] == [0, 0]


def test_two_versions_in_a_folder_have_to_be_told_apart(folder):
    (folder / "v1.0-test").mkdir()
    for name in ("scene", "sample"):
        (folder / "v1.0-test" / f"{name}.json").write_text("[]")
    with pytest.raises(InputError, match=r"found .*v1.0-mini, .*v1.0-test: give the folder of one version"):
        read_nuscenes(folder, "scene-0001")
    assert read_nuscenes(folder / "v1.0-mini", "scene-0001").problems == ()


@pytest.mark.parametrize("table", ["sample", "sample_data", "ego_pose", "calibrated_sensor", "sensor"])
def test_a_needed_table_that_is_cut_off_is_named(folder, table):
    path = folder / "v1.0-mini" / f"{table}.json"
    path.write_text(path.read_text()[:-40])
    with pytest.raises(InputError, match=rf"{table}.json is damaged or cut off"):
        read_nuscenes(folder, "scene-0001")


def test_missing_tables_are_named(folder):
    (folder / "v1.0-mini/ego_pose.json").unlink()
    with pytest.raises(InputError, match=r"lacks ego_pose.json, without which nothing"):
        read_nuscenes(folder, "scene-0001")


@pytest.mark.parametrize("broken", ["missing", "cut off", "empty"])
@pytest.mark.parametrize("table", ["sample_annotation", "instance", "category"])
def test_without_labels_pictures_work(folder, table, broken):
    path = folder / "v1.0-mini" / f"{table}.json"
    if broken == "missing":
        path.unlink()
    else:
        path.write_text(path.read_text()[:-40] if broken == "cut off" else "")
    log = read_nuscenes(folder, "scene-0001")
    assert log.boxes == ()
    assert f"{table}.json" in said(log)
    assert "there are no boxes" in said(log)
    assert len(log.cameras) == 2


def test_tokens_that_point_nowhere_are_named(folder, change):
    change("sample_data", lambda rows: rows[3].update(ego_pose_token="nowhere"))
    log = read_nuscenes(folder, "scene-0001")
    assert [len(camera) for camera in log.cameras] == [12, 13]
    assert "sample_data.json: rows point to no usable row of ego_pose.json" in said(log)
    assert "to 'nowhere'" in said(log)


def test_annotations_of_no_instance_are_named(folder, change):
    change("sample_annotation", lambda rows: rows[0].update(instance_token="gone"))
    log = read_nuscenes(folder, "scene-0001")
    assert sum(len(box.times_s) for box in log.boxes) == 7
    assert "sample_annotation.json: rows point to no usable row of instance.json" in said(log)


def test_a_camera_without_calibration_is_left_out(folder, change):
    change("calibrated_sensor", lambda rows: rows[1].update(camera_intrinsic=[]))
    log = read_nuscenes(folder, "scene-0001")
    assert [camera.name for camera in log.cameras] == ["CAM_FRONT"]
    assert "CAM_BACK_LEFT: no usable calibration" in said(log)


def test_missing_pictures_are_counted(folder):
    camera = read_nuscenes(folder, "scene-0001").cameras[1]
    for file in camera.files[:4]:
        file.unlink()
    (folder / "v1.0-mini/log.json").touch()
    log = read_nuscenes(folder, "scene-0001")
    assert len(log.cameras[1]) == 9
    assert "CAM_BACK_LEFT: files of sample_data.json are missing (4, the first: sw" in said(log)


def test_a_partial_download_works_with_what_is_there(folder):
    for file in read_nuscenes(folder, "scene-0001").cameras[1].files:
        file.unlink()
    (folder / "v1.0-mini/log.json").touch()
    log = read_nuscenes(folder, "scene-0001")
    assert [camera.name for camera in log.cameras] == ["CAM_FRONT"]
    assert "none of its 13 pictures is there; the camera is left out" in said(log)


def test_without_lidar_the_fallback_is_said(folder, change):
    change("sample_data", lambda rows: [rows.remove(r) for r in list(rows) if "LIDAR" in r["filename"]])
    log = read_nuscenes(folder, "scene-0001")
    assert log.sweeps == ()
    assert "There are no LIDAR_TOP records" in log.notes[0]
    assert "CAM_FRONT" in log.notes[0]


def test_damaged_rows_are_left_out(folder, change):
    change("ego_pose", lambda rows: rows[0].update(rotation=[9, 0, 0, 0]))
    change("sample_annotation", lambda rows: rows[1].update(size=[1, -1, 1]))
    log = read_nuscenes(folder, "scene-0001")
    assert "ego_pose.json: rows are damaged and left out" in said(log)
    assert "sample_annotation.json: rows are damaged and left out" in said(log)


def test_quaternions_of_another_length_are_left_out(folder, change):
    change("sample_annotation", lambda rows: rows[1].update(rotation=[0.5, 0, 0, 0]))
    assert "quaternions are not of length 1" in said(read_nuscenes(folder, "scene-0001"))


def test_tokens_that_stand_twice_are_named(folder, change):
    change("sample", lambda rows: rows.append(dict(rows[0])))
    assert "sample.json: tokens stand twice" in said(read_nuscenes(folder, "scene-0001"))


def test_scenes_are_chosen_by_name_or_number(folder):
    assert NUSCENES.logs is not None
    assert NUSCENES.logs.open(folder, None).name == "scene-0001"
    assert NUSCENES.logs.open(folder, "0").name == "scene-0001"
    with pytest.raises(
        InputError, match="--scene 7 is none of them; expected a name, or a number from 0 to 0"
    ):
        NUSCENES.logs.open(folder, "7")


def test_cameras_are_found_however_they_are_written(folder):
    log = read_nuscenes(folder, "scene-0001")
    assert log.camera("back_left") is log.camera("CAM_BACK_LEFT") is log.cameras[1]
    with pytest.raises(InputError, match="has no camera side; it has front, back_left"):
        log.camera("side")


def test_real_partial_tables_name_what_is_missing(data_dir):
    with pytest.raises(InputError, match=r"no camera of scene-0061 has pictures: CAM_FRONT: files"):
        read_nuscenes(data_dir / "nuscenes_format/nuscenes_scene0061_first_sample", "scene-0061")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    place = tmp_path_factory.mktemp("nuscenes")
    write_nuscenes([made_up(place / "made")], place / "set", read_points)
    return place / "set"


@given(cut=st.integers(0, 400), table=st.sampled_from(["scene", "sample_data", "sample_annotation"]))
def test_no_damage_is_a_traceback(whole, cut, table):
    path = whole / "v1.0-mini" / f"{table}.json"
    text = path.read_text()
    try:
        path.write_text(text[:cut] + text[cut + 7 :])
        read_nuscenes(whole, "scene-0001")
    except InputError:
        pass
    finally:
        path.write_text(text)


def test_golden_places_of_a_real_drive(data_dir):
    log = read_nuscenes(data_dir / "nuscenes_format/pandaset_002", "scene-0002")
    tables = data_dir / "nuscenes_format/pandaset_002/v1.0-mini"
    first = json.loads((tables / "sample_annotation.json").read_text())[0]
    box = next(b for b in log.boxes if b.id == first["instance_token"])
    np.testing.assert_allclose(box.world_from_box[0, :3, 3], first["translation"])
    np.testing.assert_allclose(box.size_lwh_m[0], np.array(first["size"])[[1, 0, 2]])


def test_rows_that_are_no_text_and_links_that_lead_nowhere_are_said(folder):
    path = folder / "v1.0-mini" / "attribute.json"
    path.write_bytes(path.read_bytes().replace(b"vehicle", b"v\xffhicle"))
    (folder / "v1.0-mini" / "visibility.json").unlink()
    (folder / "v1.0-mini" / "visibility.json").symlink_to("visibility.json")
    log = read_nuscenes(folder, "scene-0001")
    assert "attribute.json: rows are damaged and left out" in said(log)
    assert "visibility.json" in said(log)


def test_a_camera_beyond_all_places_is_left_out(folder, change):
    change("ego_pose", lambda rows: rows[1].update(translation=[1e7, 0, 0]))
    log = read_nuscenes(folder, "scene-0001")
    assert "no usable calibration or poses" in said(log)
    assert len(log.cameras) == 1
