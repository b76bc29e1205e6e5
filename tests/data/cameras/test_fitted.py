"""Calibrations of data sets whose pictures were scaled, and of several shapes."""

import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive.data.cameras.fitted import check_middle, fitted
from dreamdrive.data.formats.pose_lists import parts_of_projection
from dreamdrive.datasets.logs import clip_of_log
from dreamdrive.datasets.nuscenes import read_nuscenes
from dreamdrive.scene.camera import Camera

WHOLE = Camera(700.0, 700.0, 600.5, 180.5, 1226, 370)


def test_a_calibration_follows_the_size_of_the_pictures_and_that_is_said() -> None:
    problems: list[str] = []
    assert fitted(WHOLE, (1226, 370), problems, "CAM") is WHOLE
    assert not problems
    half = fitted(WHOLE, (613, 185), problems, "CAM")
    assert (half.fx_px, half.cx_px, half.width_px) == (350, 300.25, 613)
    assert problems == ["CAM: pictures are 613x185, not 1226x370 as told: the calibration is scaled"]


def test_pictures_of_another_shape_are_refused() -> None:
    with pytest.raises(ValueError, match="it is for 1226x370, but pictures are 613x370, another shape"):
        fitted(WHOLE, (613, 370), [], "CAM")


def test_a_calibration_without_a_size_has_its_middle_in_the_pictures() -> None:
    check_middle(WHOLE)
    matrix = np.hstack([WHOLE.index_matrix, np.zeros((3, 1))])
    assert parts_of_projection(matrix, (1226, 370))[0].cx_px == 600.5
    for size in ((613, 185), (2452, 740)):
        with pytest.raises(ValueError, match="is not that of pictures of"):
            parts_of_projection(matrix, size)


def halved(folder: Path) -> None:
    """Scale all pictures of a folder, as who saves room on a disk does."""
    for file in (each for each in folder.rglob("*") if each.suffix in (".jpg", ".png")):
        picture = cv2.imread(str(file))
        assert picture is not None
        cv2.imwrite(str(file), cv2.resize(picture, (picture.shape[1] // 2, picture.shape[0] // 2)))


def test_halved_nuscenes(one_drive: Path, tmp_path: Path) -> None:
    shutil.copytree(one_drive, tmp_path / "set")
    before = read_nuscenes(tmp_path / "set", "scene-0001").cameras[0].pinhole
    halved(tmp_path / "set" / "samples")
    halved(tmp_path / "set" / "sweeps")
    (tmp_path / "set" / "v1.0-mini" / "log.json").touch()  # else the drive that was read is kept
    after = read_nuscenes(tmp_path / "set", "scene-0001")
    assert after.cameras[0].pinhole.matrix.tolist() == before.resized(32, 24).matrix.tolist()
    assert any("CAM_FRONT: pictures are 32x24, not 64x48" in each for each in after.problems)
    assert clip_of_log(after, frames="0:3", size=(32, 24)).rig[0].fx_px == before.fx_px / 2
