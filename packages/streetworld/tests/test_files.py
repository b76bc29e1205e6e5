import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive.data import read_clip
from dreamdrive.data.truth_folder import read_world
from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.files import attach
from dreamdrive.scene.street.truth import DriveTruth
from streetworld import make_street
from streetworld.files import write_world


@pytest.fixture(scope="module")
def street() -> DriveTruth:
    return make_street(1, 4, size=(64, 48))


def test_a_world_folder_is_read_back_as_a_clip(street: DriveTruth, tmp_path: Path) -> None:
    write_world({"front": street}, tmp_path / "w")
    clip = read_clip(
        tmp_path / "w" / "frames",
        intrinsics=tmp_path / "w" / "cameras.json",
        poses=tmp_path / "w" / "poses.json",
        size=(64, 48),
    )
    assert (clip.frames == street.frames).all()
    camera = clip.rig[0]
    assert (camera.fx_px, camera.cx_px, camera.cy_px) == pytest.approx((51.2, 32.0, 24.0))
    assert clip.known.world_from_camera is not None
    np.testing.assert_allclose(clip.known.world_from_camera, street.trajectory.world_from_camera, atol=1e-9)


def test_a_world_folder_is_geometry_that_can_be_given(street: DriveTruth, tmp_path: Path) -> None:
    write_world({"front": street}, tmp_path / "w")
    clip = attach(read_clip(tmp_path / "w" / "frames", size=(64, 48)), tmp_path / "w")
    assert clip.rig[0].fx_px == pytest.approx(51.2)
    np.testing.assert_allclose(clip.known.world_from_camera, street.trajectory.world_from_camera, atol=1e-9)
    assert (clip.known.depth_m == street.depth_m).all()


def test_depth_labels_and_boxes_are_all_there(street: DriveTruth, tmp_path: Path) -> None:
    write_world({"front": street}, tmp_path / "w")
    with np.load(tmp_path / "w" / "depth" / "0003.npz") as stored:
        assert (stored["depth_m"] == street.depth_m[3]).all()
    label = cv2.imread(str(tmp_path / "w" / "instances" / "0002.png"), cv2.IMREAD_UNCHANGED)
    assert (label == street.instance[2]).all()
    boxes = json.loads((tmp_path / "w" / "boxes.json").read_text())["boxes"]
    assert [b["moving"] for b in boxes] == [b.moving for b in street.boxes]


def test_writing_twice_gives_equal_bytes_and_replaces_only_when_told(
    street: DriveTruth, tmp_path: Path
) -> None:
    write_world({"front": street}, tmp_path / "a")
    write_world({"front": street}, tmp_path / "b")
    for path in sorted((tmp_path / "a").rglob("*.*")):
        assert path.read_bytes() == (tmp_path / "b" / path.relative_to(tmp_path / "a")).read_bytes()
    with pytest.raises(InputError, match="exists already"):
        write_world({"front": street}, tmp_path / "a")
    write_world({"front": street}, tmp_path / "a", replace=True)


def test_a_drive_is_read_back_whole(street: DriveTruth, tmp_path: Path) -> None:
    write_world({"front": street}, tmp_path / "w")
    found = read_world(tmp_path / "w")
    for name in (
        "frames",
        "times_s",
        "depth_m",
        "instance",
        "semantic",
        "moving",
        "flow_px",
        "world_from_map",
    ):
        assert (getattr(found, name) == getattr(street, name)).all(), name
    for mine, theirs in zip(found.cameras, street.cameras, strict=True):
        assert (mine.matrix == theirs.matrix).all()
        assert (mine.world_from_camera == theirs.world_from_camera).all()
    assert [box.id for box in found.boxes] == [box.id for box in street.boxes]
    assert (found.boxes[0].world_from_box == street.boxes[0].world_from_box).all()
    assert found.ground.offset_m == street.ground.offset_m
    assert found.layout == street.layout


def test_one_of_several_cameras_is_read(street: DriveTruth, tmp_path: Path) -> None:
    write_world({"front": street, "back": street}, tmp_path / "w")
    assert (read_world(tmp_path / "w", "back").depth_m == street.depth_m).all()
    with pytest.raises(InputError, match="neither frames nor a camera 'left'"):
        read_world(tmp_path / "w", "left")


def test_a_damaged_world_is_refused(street: DriveTruth, tmp_path: Path) -> None:
    write_world({"front": street}, tmp_path / "w")
    (tmp_path / "w" / "moving" / "0001.png").write_bytes(b"no picture")
    with pytest.raises(InputError, match=r"moving/0001\.png cannot be read as an image"):
        read_world(tmp_path / "w")
    (tmp_path / "w" / "moving" / "0001.png").unlink()
    with pytest.raises(InputError, match="is not a complete world"):
        read_world(tmp_path / "w")
    (tmp_path / "w" / "depth" / "0002.npz").write_bytes(b"PK")
    with pytest.raises(InputError, match="is not a complete world"):
        read_world(tmp_path / "w")
    (tmp_path / "w" / "layout.json").unlink()
    with pytest.raises(InputError, match=r"layout\.json is missing"):
        read_world(tmp_path / "w")
