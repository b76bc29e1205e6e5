"""What ``plan`` leaves and says."""

import json
from dataclasses import replace
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from dreamdrive.data.cameras.poses import read_trajectory
from dreamdrive.scene.scene import Provenance
from dreamdrive.stored import save_scene
from tests.cli.conftest import Run
from tests.drive.test_occupancy import block, dots, scene_of

NAMES = ["drive.mp4", "plan.json", "plan.png", "trajectory.json"]


def saved(tmp_path: Path, z_m: tuple[float, float]) -> Path:
    """A scene of a second in which the car drives 10 m ahead, with a wall across the street."""
    save_scene(scene_of(dots(block((-4, 4), z_m, (0, 2.0)))), tmp_path / "out" / "scene")
    return tmp_path / "out"


def test_a_car_brakes_before_a_wall(run: Run, tmp_path: Path) -> None:
    out = saved(tmp_path, (30.0, 30.5))
    result = run("plan", out)
    assert result.code == 0, result
    assert "was in the way" in result.out
    folder = out / "video" / "plan_current"
    assert sorted(file.name for file in folder.glob("[!.]*")) == NAMES
    found = json.loads((folder / "plan.json").read_text())
    assert found["changed"]
    assert found["clear_before_m"] < 0 < found["clear_after_m"]
    np.testing.assert_allclose(found["planned_m"], [[0, 5.0 * k] for k in range(1, 7)], atol=1e-6)
    assert found["waypoints_m"][-1][1] < 19
    path = read_trajectory(folder / "trajectory.json")
    assert path.times_s[[0, -1]].tolist() == pytest.approx([1.0, 4.0])
    np.testing.assert_allclose(path.positions_m[0], [0, 0, 10], atol=1e-6)
    np.testing.assert_allclose(path.positions_m[:, 1], 0, atol=1e-9)
    assert path.positions_m[-1, 2] < 29
    picture = cv2.imread(str(folder / "plan.png"))
    assert picture is not None
    assert (picture[..., 1].astype(int) - picture[..., 2] > 100).sum() > 200  # the drive as written
    with av.open(str(folder / "drive.mp4")) as video:
        assert sum(1 for _ in video.decode(video=0)) == 61


def test_what_is_clear_stays_as_planned(run: Run, tmp_path: Path) -> None:
    out = saved(tmp_path, (70.0, 70.5))
    result = run("plan", out, "-o", tmp_path / "plan")
    assert result.code == 0, result
    assert "stays as planned" in result.out
    found = json.loads((tmp_path / "plan" / "plan.json").read_text())
    assert found["planned_m"] == found["waypoints_m"]
    assert run("plan", out, "-o", tmp_path / "plan").code == 2
    assert run("plan", out, "-o", tmp_path / "plan", "--force", "--method", "uniad").code == 0


def test_a_drive_of_a_file_is_planned_from_its_middle(run: Run, tmp_path: Path) -> None:
    out = saved(tmp_path, (25.0, 25.5))
    poses = np.tile(np.eye(4), (5, 1, 1))
    poses[:, 2, 3] = 5.0 * np.arange(5)
    file = tmp_path / "mine.json"
    file.write_text(json.dumps({"world_from_camera": poses.tolist(), "times_s": [0, 0.5, 1, 1.5, 2]}))
    result = run("plan", out, "--trajectory", file)
    assert result.code == 0, result
    found = json.loads((out / "video" / "plan_mine" / "plan.json").read_text())
    assert found["now_s"] == 1.0
    np.testing.assert_allclose(found["planned_m"], [[0, 5], [0, 10]], atol=1e-6)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--at", "7"), "lies outside"),
        (("--at", "0"), "first moment"),
        (("--at", "nan"), "expected seconds"),
        (("--trajectory", "nowhere.json"), "no such file"),
        (("--trajectory", "lane-left", "--at", "0.9"), "needs 0.5 s"),
    ],
)
def test_what_cannot_be_planned_is_told(
    run: Run, tmp_path: Path, options: tuple[str, ...], said: str
) -> None:
    result = run("plan", saved(tmp_path, (30.0, 30.5)), *options)
    assert result.code == 2
    assert said in result.err


def test_a_path_far_outside_and_a_scene_without_a_road_are_told(run: Run, tmp_path: Path) -> None:
    out = saved(tmp_path, (30.0, 30.5))
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[:, 0, 3], poses[:, 2, 3] = 500.0, np.arange(3)
    file = tmp_path / "far.json"
    file.write_text(json.dumps({"world_from_camera": poses.tolist(), "times_s": [0, 0.5, 1]}))
    result = run("plan", out, "--trajectory", file)
    assert result.code == 2
    assert "from the recorded path" in result.err
    blind = replace(scene_of(dots(block((-4, 4), (30, 31), (0, 2)))), provenance=Provenance())
    save_scene(blind, tmp_path / "blind")
    result = run("plan", tmp_path / "blind")
    assert result.code == 2
    assert "does not know its road" in result.err
