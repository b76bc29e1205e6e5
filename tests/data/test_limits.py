"""Numbers that no camera, path or street has are refused by file and field, in whole sentences."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dreamdrive.data.cameras.intrinsics import read_intrinsics
from dreamdrive.data.cameras.poses import read_trajectory
from dreamdrive.data.layout_file import read_layout
from dreamdrive.data.rig import read_rig
from dreamdrive.errors import InputError

LENS = {"fx": 50, "fy": 50, "cx": 31, "cy": 23}
FAR = np.eye(4)
FAR[0, 3] = 1e8
PATH = {"world_from_camera": [np.eye(4).tolist()] * 2, "times_s": [0, 0.1]}
TRACK = [{"t_s": 0, "x_m": 1e300, "y_m": 0, "yaw_rad": 0}]


def calibration(path: Path) -> object:
    return read_intrinsics(path, (64, 48))


def rig(path: Path) -> object:
    path.rename(path.with_name("rig.json"))
    return read_rig(path.parent)


@pytest.mark.parametrize(
    ("read", "content", "said"),
    [
        (
            calibration,
            {"width": 64, "height": 48, "intrinsics": {**LENS, "fx": 1e300}},
            "--intrinsics FILE: focal lengths must be positive, 0.01 to 1e+07 px, got fx 1e+300, fy 50",
        ),
        (
            calibration,
            {"camera_model": "PINHOLE", "w": 10**7, "h": 10**7, "fl_x": 50, "frames": [{}]},
            "--intrinsics FILE: image size must be positive, 65535 px a side at most, got 10000000x10000000",
        ),
        (
            calibration,
            {
                "width": 64,
                "height": 48,
                "intrinsics": LENS,
                "distortion": {"model": "opencv", "coefficients": [1e9, 0, 0, 0]},
            },
            "--intrinsics FILE: the distortion coefficient 1e+09 is that of no lens; expected numbers "
            "of OpenCV's models, at most 10000",
        ),
        (
            read_trajectory,
            {**PATH, "world_from_camera": [np.eye(4).tolist(), FAR.tolist()]},
            "trajectory FILE: pose 1 (counted from 0) holds 1e+08; expected places within 1e+07 m of the "
            "origin: take the same offset from all of them",
        ),
        (
            read_trajectory,
            {**PATH, "times_s": [0.1, 0]},
            "trajectory FILE: pose 1 (counted from 0): time 0; expected finite, increasing times in seconds",
        ),
        (
            read_layout,
            {"ego": {"track": TRACK}},
            "FILE: Expected `float` <= 100000.0 - at `$.ego.track[0].x_m`; "
            "expected a layout as JSON, see docs/layout.md",
        ),
        (
            read_layout,
            {"ego": {"track": [{**TRACK[0], "x_m": 0}] * 10_001}},
            "FILE: Expected `array` of length <= 10000 - at `$.ego.track`; "
            "expected a layout as JSON, see docs/layout.md",
        ),
        (
            rig,
            {"cameras": [{"frames": "a", "car_from_camera": np.eye(4).tolist()}] * 33},
            "PLACE/rig.json lists 33 cameras; expected at most 32 on one car",
        ),
        (
            rig,
            {"cameras": [{"frames": "a" * 300, "car_from_camera": np.eye(4).tolist()}]},
            f"PLACE/rig.json: camera 0 names '{'a' * 300}', which is no file name; "
            'expected {"cameras": [{"frames": folder, "intrinsics": file, "car_from_camera": 4x4 in metres}, '
            "...]}",
        ),
    ],
)
def test_impossible_numbers_are_refused(
    tmp_path: Path, read: Callable[[Path], object], content: dict[str, Any], said: str
) -> None:
    path = tmp_path / "a.json"
    path.write_text(json.dumps(content))
    with pytest.raises(InputError) as caught:
        read(path)
    assert str(caught.value).replace(str(path), "FILE").replace(str(tmp_path), "PLACE") == said


def test_a_message_is_short_and_cannot_move_the_cursor() -> None:
    said = str(InputError("a\x1b[2J\n" + "b" * 3000 + "end"))
    assert said.startswith("a\\x1b[2J\\nbbb")
    assert said.endswith("bbbend")
    assert len(said) < 1000
