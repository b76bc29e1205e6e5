"""Depth of a clip against lidar points."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from dreamdrive_bench.recorded import lidar

CAR, ROAD = 3, 7


@pytest.fixture(autouse=True)
def classes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lidar, "labels", lambda _: {CAR})


def test_shares_are_of_points_that_count_after_one_scale(tmp_path: Path) -> None:
    """Of frame 4 of the source, the second is held out; pictures of the points are twice as wide."""
    clip = SimpleNamespace(held_out=np.array([False, True]), source_index=np.array([4, 5]), size=(8, 4))
    depth = np.full((2, 4, 8), 5.0)
    depth[0, 0, 0] = 8.0
    geometry = SimpleNamespace(depth_m=depth, spread=np.full((2, 4, 8), 0.05))
    points = {
        "u": np.array([0, 4, 8, 12, 14]),
        "v": np.array([0, 2, 4, 6, 7]),
        "depth": np.array([10.0, 10.0, 10.0, 10.0, 90.0]),
        "sem": np.array([CAR, CAR, ROAD, ROAD, ROAD]),
    }
    for frame in (4, 5):
        np.savez(tmp_path / f"{frame}.npz", **points)
    found = lidar.point_shares(geometry, clip, lambda frame: tmp_path / f"{frame}.npz", 16)
    assert found == {
        "points": 4,
        "off": 0.25,
        "vehicles_off": 0.5,
        "abs_rel": pytest.approx(0.15),
        "held_by_68": 0.75,
        "scale": 2.0,
    }


def test_without_points_there_is_no_figure(tmp_path: Path) -> None:
    clip = SimpleNamespace(held_out=np.array([False]), source_index=np.array([0]), size=(8, 4))
    geometry = SimpleNamespace(depth_m=np.ones((1, 4, 8)), spread=None)
    assert lidar.point_shares(geometry, clip, lambda frame: tmp_path / f"{frame}.npz", 16) is None
