"""What is seen, as files."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive.data.cameras.intrinsics import read_intrinsics
from dreamdrive.errors import InputError
from dreamdrive.street_network import write_look
from dreamdrive.street_network.files import depth_steps
from tests.scene.street.test_look import small_look

PICTURES = [np.zeros((4, 4, 3), np.uint8)] * 2
FRAMES = [{"source_index": 0}, {"source_index": 5}]


def read(path: Path) -> np.ndarray:
    return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)


@pytest.mark.parametrize(("height_m", "unit", "times"), [(None, "camera height", 1.0), (1.5, "m", 1.5)])
def test_files_hold_what_is_seen(tmp_path: Path, height_m: float | None, unit: str, times: float) -> None:
    seen = small_look(camera_height_m=height_m)
    write_look(seen, tmp_path / "out", PICTURES, FRAMES, {"source": "a.jpg"})
    about = json.loads((tmp_path / "out/look.json").read_text())
    assert about["depth_unit"] == f"1/256 {unit}"
    assert about["source"] == "a.jpg"
    assert about["frames"][1]["source_index"] == 5
    (user,) = about["frames"][0]["road_users"]
    assert user == {"kind": "VEHICLE", "score": 0.8, "box_px": [0, 3, 6, 6], "pixels": 18}
    for index in range(2):
        name = f"{index:04d}"
        assert np.array_equal(
            read(tmp_path / f"out/depth/{name}.png"), (seen.depth[index] * 256 * times).round()
        )
        assert np.array_equal(read(tmp_path / f"out/classes/{name}.png"), seen.classes[index])
        assert np.array_equal(read(tmp_path / f"out/instances/{name}.png"), seen.instances[index])
        assert (read(tmp_path / f"out/confidence/{name}.png") == 191).all()
        assert read(tmp_path / f"out/overview/{name}.png").shape == (4, 4, 3)
        with np.load(tmp_path / f"out/arrays/{name}.npz") as arrays:
            assert np.array_equal(arrays["depth"], seen.depth[index] * np.float32(times))
            assert np.array_equal(arrays["spread"], seen.spread[index])
            assert set(arrays) == {"depth", "spread", "classes", "confidence", "instances"}


def test_the_camera_is_taken_as_a_calibration(tmp_path: Path) -> None:
    write_look(small_look(), tmp_path / "out", PICTURES, FRAMES, {})
    camera = read_intrinsics(tmp_path / "out/look.json", (24, 16)).camera
    assert (camera.fx_px, camera.cx_px, camera.cy_px) == (20, 12, 8)


def test_an_older_look_is_replaced_if_that_is_asked_for(tmp_path: Path) -> None:
    write_look(small_look(), tmp_path / "out", PICTURES, FRAMES, {})
    with pytest.raises(InputError, match="--force"):
        write_look(small_look(), tmp_path / "out", PICTURES, FRAMES, {})
    write_look(small_look(1), tmp_path / "out", PICTURES[:1], FRAMES[:1], {}, replace=True)
    assert len(list((tmp_path / "out/depth").iterdir())) == 1


def test_nothing_is_left_of_what_failed(tmp_path: Path) -> None:
    def failing():
        yield PICTURES[0]
        raise RuntimeError

    with pytest.raises(RuntimeError):
        write_look(small_look(), tmp_path / "out", failing(), FRAMES, {})
    assert list(tmp_path.iterdir()) == []


def test_depth_in_steps_keeps_the_far_and_the_near_apart_from_nothing() -> None:
    steps = depth_steps(np.array([[0.0, 1e-4, 1.0, 255.0, 1e6]], np.float32))
    assert steps.tolist() == [[0, 1, 256, 65280, 65535]]
