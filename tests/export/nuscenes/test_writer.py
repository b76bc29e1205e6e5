"""What is written in the format of nuScenes comes back the same."""

import json

import numpy as np
import pytest

from dreamdrive.datasets.lidar_file import read_points
from dreamdrive.datasets.nuscenes import NUSCENES, read_nuscenes
from dreamdrive.errors import InputError
from dreamdrive.export.nuscenes.writer import write_nuscenes
from tests.logs import log


def same_logs(one, other, ids: bool = True) -> None:
    assert (one.name, one.about, one.location) == (other.name, other.about, other.location)
    assert one.start_us == other.start_us
    np.testing.assert_array_equal(one.times_s, other.times_s)
    np.testing.assert_allclose(one.world_from_ego, other.world_from_ego, atol=1e-9)
    assert [c.name for c in one.cameras] == [c.name for c in other.cameras]
    for a, b in zip(one.cameras, other.cameras, strict=True):
        np.testing.assert_array_equal(a.times_s, b.times_s)
        np.testing.assert_array_equal(a.key, b.key)
        np.testing.assert_allclose(a.world_from_camera, b.world_from_camera, atol=1e-9)
        np.testing.assert_allclose(a.ego_from_camera, b.ego_from_camera, atol=1e-9)
        np.testing.assert_allclose(a.pinhole.matrix, b.pinhole.matrix, atol=1e-12)
        assert [f.read_bytes() for f in a.files] == [f.read_bytes() for f in b.files]
    assert len(one.boxes) == len(other.boxes)
    for a, b in zip(one.boxes, other.boxes, strict=True):
        assert (a.category, a.attributes) == (b.category, b.attributes)
        assert not ids or a.id == b.id
        for name in ("times_s", "size_lwh_m", "visibility", "lidar_points"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
        np.testing.assert_allclose(a.world_from_box, b.world_from_box, atol=1e-9)
    for a, b in zip(one.sweeps, other.sweeps, strict=True):
        assert a.time_s == b.time_s
        np.testing.assert_allclose(a.world_from_points, b.world_from_points, atol=1e-9)
        np.testing.assert_array_equal(read_points(a.file), read_points(b.file))
    for name in ("drivable_area", "walkway"):
        for a, b in zip(one.map.areas[name], other.map.areas[name], strict=True):
            np.testing.assert_array_equal(a.outline, b.outline)
            assert len(a.holes) == len(b.holes)
            for c, d in zip(a.holes, b.holes, strict=True):
                np.testing.assert_array_equal(c, d)
    for a, b in zip(one.map.lines["lane_divider"], other.map.lines["lane_divider"], strict=True):
        np.testing.assert_array_equal(a, b)


def test_what_is_written_is_read_again(tmp_path, folder):
    made = log(tmp_path / "again")
    read = read_nuscenes(folder, "scene-0001")
    same_logs(made, read)
    assert read.problems == read.notes == ()


def test_what_is_read_is_written_again(tmp_path, folder):
    read = read_nuscenes(folder, "scene-0001")
    write_nuscenes([read], tmp_path / "second", read_points)
    same_logs(read, read_nuscenes(tmp_path / "second", "scene-0001"))


def test_real_tables_come_back(tmp_path, data_dir):
    read = read_nuscenes(data_dir / "nuscenes_format/pandaset_002", "scene-0002")
    assert [len(c) for c in read.cameras] == [80, 16, 16, 16, 16, 16]
    assert sum(len(box.times_s) for box in read.boxes) == 1504
    write_nuscenes([read], tmp_path / "second", read_points)
    again = read_nuscenes(tmp_path / "second", "scene-0002")
    assert again.problems == ()
    np.testing.assert_allclose(again.boxes[5].world_from_box, read.boxes[5].world_from_box, atol=1e-12)
    np.testing.assert_allclose(
        again.cameras[2].world_from_camera, read.cameras[2].world_from_camera, atol=1e-12
    )


def test_two_drives_share_a_data_set(tmp_path):
    logs = [log(tmp_path / name, name) for name in ("scene-0001", "scene-0002")]
    write_nuscenes(logs, tmp_path / "set", read_points)
    assert NUSCENES.logs is not None
    assert NUSCENES.logs.names(tmp_path / "set") == ("scene-0001", "scene-0002")
    read = [read_nuscenes(tmp_path / "set", made.name) for made in logs]
    same_logs(logs[0], read[0])
    same_logs(logs[1], read[1], ids=False)
    assert not {box.id for box in read[0].boxes} & {box.id for box in read[1].boxes}


def test_drives_of_one_name_are_refused(tmp_path):
    made = log(tmp_path / "made")
    with pytest.raises(ValueError, match="two drives of one name"):
        write_nuscenes([made, made], tmp_path / "set", read_points)


def test_an_older_folder_is_kept_unless_told(tmp_path, folder):
    with pytest.raises(InputError, match="already"):
        write_nuscenes([log(tmp_path / "other")], folder, read_points)
    write_nuscenes([log(tmp_path / "others")], folder, read_points, replace=True)


def test_chains_lead_through_a_drive(folder):
    rows = json.loads((folder / "v1.0-mini/sample.json").read_text())
    assert [row["prev"] for row in rows] == ["", rows[0]["token"], rows[1]["token"]]
    assert [row["next"] for row in rows] == [rows[1]["token"], rows[2]["token"], ""]
