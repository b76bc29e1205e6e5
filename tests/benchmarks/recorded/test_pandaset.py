"""The truth of what moves in a recording: what counts, and what is neither right nor wrong."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dreamdrive_bench.recorded.pandaset import moving_masks

SIZE = (160, 90)


def box(x_m: float, y_m: float, label: str = "Car", motion: str | None = "Moving") -> dict[str, Any]:
    """x ahead, y to the left, at the height of the camera."""
    about = {"label": label, "motion": motion, "yaw": 0.0, "size_wlh": [2.0, 4.0, 1.6]}
    return {**about, "position": [x_m, y_m, 0.0]}


def masks(folder: Path, *boxes: dict[str, Any]) -> Any:
    pose = np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])
    cameras = {"front_camera": {"camera_to_world": [pose.tolist()]}}
    (folder / "cameras.json").write_text(json.dumps({"cameras": cameras}))
    lens = {"fx": 130, "fy": 130, "cx": 79.5, "cy": 44.5}
    (folder / "meta.json").write_text(json.dumps({"width": SIZE[0], "intrinsics": lens}))
    (folder / "cuboids.json").write_text(json.dumps({"frames": [list(boxes)]}))
    return moving_masks(folder, [0], SIZE)


def test_near_movers_count_and_parked_cars_are_street(tmp_path: Path) -> None:
    found = masks(tmp_path, box(12, 3), box(12, -3, motion="Parked"))
    assert found.counted[0, :, :80].sum() > 100
    assert not found.counted[0, :, 80:].any()
    assert not found.ignored.any()


@pytest.mark.parametrize(
    "other",
    [
        box(60, 0),  # farther than 50 m
        box(12, 0, label="Pedestrian", motion=None),
        box(12, 0, label="Bus"),
    ],
)
def test_other_movers_are_neither_right_nor_wrong(tmp_path: Path, other: dict[str, Any]) -> None:
    found = masks(tmp_path, other)
    assert not found.counted.any()
    assert found.ignored.any()


def test_what_a_nearer_box_hides_is_neither(tmp_path: Path) -> None:
    hidden = masks(tmp_path, box(60, 0), box(12, 0, motion="Parked"))
    assert not hidden.counted.any()
    assert not hidden.ignored.any()
