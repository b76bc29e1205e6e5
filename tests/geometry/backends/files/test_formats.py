"""The one door: what is recognised, and what is said where nothing is."""

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.files.formats import companions, recognise
from dreamdrive.geometry.backends.files.readers import (
    read_colmap_model,
    read_pandaset,
    read_plain,
    read_pose_list,
    read_transforms,
)
from tests.geometry.backends.files import drives

POSE = np.eye(4).tolist()


@pytest.mark.parametrize(
    ("name", "content", "reader"),
    [
        ("cameras.json", {"intrinsics": {}, "world_from_camera": [POSE], "frames": [0]}, read_plain),
        ("cameras.json", {"cameras": {}}, read_pandaset),
        ("any.json", {"frames": []}, read_transforms),
        ("any.json", {"world_from_camera": [POSE], "times_s": [0]}, read_pose_list),
        ("poses.txt", {"world_from_camera": [POSE], "times_s": [0]}, read_pose_list),
        ("any.json", {"cameras": {}}, read_pandaset),
    ],
)
def test_content_decides(tmp_path, name, content, reader):
    path = drives.write_json(tmp_path / name, content)
    assert recognise(path) == (reader, path)
    if not name.startswith("any"):
        assert recognise(tmp_path) == (reader, path)


def test_a_model_may_lie_inside_a_project(tmp_path):
    assert recognise(drives.write_colmap_text(tmp_path / "a", np.eye(4)[None], ["x"]))[0] is read_colmap_model
    drives.write_colmap_text(tmp_path / "b" / "sparse" / "0", np.eye(4)[None], ["x"])
    assert recognise(tmp_path / "b") == (read_colmap_model, tmp_path / "b")
    # nerfstudio keeps COLMAP's files below its own.
    path = drives.write_json(tmp_path / "b" / "transforms.json", {"frames": []})
    assert recognise(tmp_path / "b") == (read_transforms, path)


def test_nothing_or_too_much_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"cannot be read: expected in it cameras\.json"):
        recognise(tmp_path)
    with pytest.raises(InputError, match="does not exist"):
        recognise(tmp_path / "none")
    folder = drives.write_colmap_text(tmp_path / "two", np.eye(4)[None], ["x"])
    with pytest.raises(InputError, match="give its folder"):
        recognise(folder / "images.txt")
    drives.write_json(folder / "transforms.json", {})
    with pytest.raises(InputError, match=r"holds transforms\.json and a COLMAP model"):
        recognise(folder)


def test_what_lies_beside_a_file_decides_with_it(tmp_path):
    (tmp_path / "poses.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n")
    (tmp_path / "depth").mkdir()
    drives.write_json(tmp_path / "geometry.json", {})
    assert companions(tmp_path / "poses.txt") == [tmp_path / "depth", tmp_path / "geometry.json"]
    assert companions(tmp_path) == []
