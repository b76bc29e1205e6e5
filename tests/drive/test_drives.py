"""Which drives are made, and which are refused because the scene shows nothing there."""

import logging
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from dreamdrive.data import write_trajectory
from dreamdrive.drive.drives import along, distance_m, drives_of, share_seen
from dreamdrive.errors import InputError
from dreamdrive.scene.control import check_numbers
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.trajectory import Trajectory
from tests.scene.scenes import make_scene


def ahead(frames: int, right_m: float = 0.0) -> np.ndarray:
    """Poses that drive 1 m ahead a frame."""
    poses = np.tile(np.eye(4), (frames, 1, 1))
    poses[:, 0, 3], poses[:, 2, 3] = right_m, np.arange(frames)
    return poses


@pytest.fixture(scope="module")
def wall() -> Scene:
    """A wall 10 m high and 12 m wide, 15 m ahead of a drive of 5 frames; a sky all around."""
    x, y = np.meshgrid(np.arange(-6, 6.1), np.arange(-5, 5.1))
    means = torch.tensor(np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 15.0)]), dtype=torch.float32)
    count = len(means)
    static = Gaussians(
        means=means,
        quaternions=torch.tensor([[1.0, 0, 0, 0]]).repeat(count, 1),
        log_scales=torch.full((count, 3), math.log(0.5)),
        logit_opacities=torch.full((count,), 6.0),
        sh=torch.ones(count, 1, 3),
        source_frame=torch.zeros(count, dtype=torch.int64),
    )
    made = make_scene(dynamic=0)
    cameras = tuple(made.cameras[0].at(pose) for pose in ahead(5))
    return replace(
        made,
        static=static,
        deformation=None,
        actors=(),
        exposure=None,
        cameras=cameras,
        times_s=np.arange(5) / 10,
        held_out=np.zeros(5, dtype=bool),
    )


@pytest.mark.parametrize("fps", [math.nan, 0.0, -1.0, 1e9, math.inf])
def test_rates_that_no_video_has_are_refused(fps: float) -> None:
    with pytest.raises(InputError) as error:
        check_numbers(2.0, fps)
    assert str(error.value) == f"--fps {fps:g}: expected 0.1 to 240 frames a second"


@pytest.mark.parametrize("shift_m", [math.nan, math.inf, -math.inf])
def test_shifts_that_are_no_numbers_are_refused(shift_m: float) -> None:
    with pytest.raises(InputError) as error:
        check_numbers(shift_m, None)
    assert str(error.value) == f"--shift-m {shift_m:g}: expected metres to the right, such as 2 or -2"


def test_drives_come_at_the_wanted_rate_or_their_own(wall: Scene, tmp_path: Path) -> None:
    write_trajectory(Trajectory(ahead(5), np.arange(5) / 4), tmp_path / "mine.json")
    wanted = ["stop", str(tmp_path / "mine.json")]
    assert [(d.name, len(d.path)) for d in drives_of(wall, wanted, 2.0, None)] == [("stop", 9), ("mine", 5)]
    assert [(d.name, len(d.path)) for d in drives_of(wall, wanted, 2.0, 5.0)] == [("stop", 3), ("mine", 6)]


def test_two_drives_of_one_name_are_refused(wall: Scene, tmp_path: Path) -> None:
    write_trajectory(Trajectory(ahead(5), np.arange(5) / 4), tmp_path / "stop.json")
    with pytest.raises(InputError) as error:
        drives_of(wall, ["stop", str(tmp_path / "stop.json")], 2.0, None)
    assert str(error.value) == (
        "--trajectory: two drives are called stop; rename a file, or render them one by one"
    )


def test_a_drive_of_too_many_frames_is_refused(wall: Scene, tmp_path: Path) -> None:
    file = tmp_path / "years.json"
    write_trajectory(Trajectory(ahead(2), np.array([0.0, 1.7e9])), file)
    assert len(drives_of(wall, [str(file)], 2.0, None)[0].path) == 2
    with pytest.raises(InputError) as error:
        drives_of(wall, [str(file)], 2.0, 20.0)
    assert str(error.value) == (
        f"--trajectory {file} lasts 1.7e+09 s, 3.4e+10 frames at --fps 20; expected 100000 at most: check "
        "the times of the file, or choose a lower rate"
    )


def test_the_distance_is_that_to_the_nearest_recorded_place() -> None:
    recorded = Trajectory(ahead(5), np.arange(5) / 10)
    assert distance_m(recorded, recorded) == 0
    assert distance_m(Trajectory(ahead(5, 3.0), np.arange(5) / 10), recorded) == 3
    assert distance_m(Trajectory(ahead(8), np.arange(8) / 10), recorded) == 3


def test_less_is_seen_the_farther_aside_and_nothing_far_away(wall: Scene) -> None:
    shares = [share_seen(wall, Trajectory(ahead(5, x), np.arange(5) / 10)) for x in (0, 2, 5, 9, 30)]
    assert shares[0] == 1
    assert shares == sorted(shares, reverse=True)
    assert shares[2] > 0.3
    assert shares[-1] == 0


def test_a_scene_of_sky_alone_has_nothing_to_compare(wall: Scene) -> None:
    empty = replace(wall, static=wall.static.select(torch.arange(0)))
    assert share_seen(empty, wall.trajectory) == 1


def test_a_lane_aside_nothing_is_said(wall: Scene, caplog: pytest.LogCaptureFixture) -> None:
    drives_of(wall, ["shift"], 3.5, None)
    assert caplog.messages == []


def test_farther_aside_the_share_is_said(wall: Scene, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING)
    share = share_seen(wall, drives_of(wall, ["shift"], 5.0, None)[0].path)
    assert caplog.messages == [
        f"--shift-m 5 goes 5 m from the recorded path and sees {share:.0%} of what is seen there; beyond "
        "about a lane's width (3.5 m) expect gaps and torn shapes"
    ]


NOTHING_SEEN = (
    "from the recorded path and sees 0% of what is seen there; expected a drive up to about a lane's width "
    "(3.5 m) aside, looking the same way; a file's poses are in the world of the first recorded camera: x "
    "right, y down, z forward, metres"
)


@pytest.mark.parametrize("right_m", [50.0, -1e6])
def test_where_nothing_is_seen_a_drive_is_refused(wall: Scene, tmp_path: Path, right_m: float) -> None:
    said = f"goes {abs(right_m):.3g} m {NOTHING_SEEN}"
    with pytest.raises(InputError) as error:
        drives_of(wall, ["stop", "shift"], right_m, None)
    assert str(error.value) == f"--shift-m {right_m:g} {said}"
    file = tmp_path / "far.json"
    write_trajectory(Trajectory(ahead(5, right_m), np.arange(5) / 10), file)
    with pytest.raises(InputError) as error:
        drives_of(wall, [str(file)], 2.0, None)
    assert str(error.value) == f"--trajectory {file} {said}"


def test_a_file_that_looks_elsewhere_is_refused(wall: Scene, tmp_path: Path) -> None:
    back, file = ahead(5), tmp_path / "back.json"
    back[:, :3, :3] = np.diag([-1.0, 1.0, -1.0])
    write_trajectory(Trajectory(back, np.arange(5) / 10), file)
    with pytest.raises(InputError) as error:
        drives_of(wall, [str(file)], 2.0, None)
    assert str(error.value) == f"--trajectory {file} goes 0 m {NOTHING_SEEN}"


def test_the_cameras_of_a_rig_are_carried_along(wall: Scene) -> None:
    aside = np.eye(4)
    aside[0, 3] = 0.5
    front = wall.cameras[:2]
    rig = replace(
        wall,
        cameras=(front[0], front[0].at(front[0].world_from_camera @ aside), front[1]),
        times_s=wall.times_s[[0, 0, 1]],
        held_out=np.zeros(3, bool),
        camera=np.array([2, 5, 2]),
        provenance=replace(wall.provenance, up=(0.0, -1.0, 0.0), camera_height_m=1.5),
    )
    path = Trajectory(ahead(3) @ _up(0.25), np.array([0.0, 0.4, 0.8]))
    found = along(rig, path)
    assert found.camera is not None
    assert found.camera.tolist() == [2, 5] * 3
    np.testing.assert_allclose(found.trajectory.world_from_camera, path.world_from_camera)
    np.testing.assert_array_equal(found.trajectory.times_s, path.times_s)
    others = np.stack([found.cameras[view].world_from_camera for view in (1, 3, 5)])
    np.testing.assert_allclose(others, path.world_from_camera @ aside)
    assert found.provenance.camera_height_m == pytest.approx(1.75)


def test_drives_that_begin_as_the_first_are_no_cameras(wall: Scene) -> None:
    """A photo with several actions has a drive for each."""
    count = len(wall.cameras)
    two = replace(
        wall,
        cameras=wall.cameras * 2,
        times_s=np.tile(wall.times_s, 2),
        held_out=np.zeros(2 * count, bool),
        camera=np.repeat([0, 1], count),
    )
    assert len(along(two, wall.trajectory).cameras) == count


def _up(metres: float) -> np.ndarray:
    pose = np.eye(4)
    pose[1, 3] = -metres
    return pose
