from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dreamdrive.geometry.cameras.gate import judge
from dreamdrive.geometry.cameras.sfm import SparseModel
from dreamdrive.geometry.options import GateOptions

FRAMES = 12
MOVING = np.ones(FRAMES - 1, bool)


def drive(reprojection_px: float, sideways_m: float = 0.0) -> SparseModel:
    """A drive straight ahead, 0.5 m a frame; one frame in the middle lies to the side."""
    poses = np.tile(np.eye(4), (FRAMES, 1, 1))
    poses[:, 2, 3] = 0.5 * np.arange(FRAMES)
    poses[FRAMES // 2, 0, 3] = sideways_m
    seen = np.ones((FRAMES, 700), bool)
    return SparseModel(poses, np.zeros((700, 3)), seen, np.zeros(5), 0.0, reprojection_px, None)


def test_an_exact_drive_is_accepted() -> None:
    verdict = judge(drive(0.2), MOVING)
    assert verdict.reasons == ()
    assert not verdict.wobbling


def test_frames_of_generated_video_wobble_and_are_accepted_all_the_same() -> None:
    verdict = judge(drive(0.75), MOVING)
    assert verdict.reasons == ()
    assert verdict.wobbling


def test_what_misses_by_more_is_refused() -> None:
    assert any("miss their pixels" in reason for reason in judge(drive(1.1), MOVING).reasons)
    assert judge(drive(1.1), MOVING, GateOptions(reprojection_px=1.2)).reasons == ()


@pytest.mark.parametrize(("sideways_m", "jumps"), [(0.4, False), (2.0, True)])
def test_a_wobbling_path_is_judged_over_stretches(sideways_m: float, jumps: bool) -> None:
    exact, wobbling = (judge(drive(px, sideways_m), MOVING) for px in (0.2, 0.7))
    assert any("jumps" in reason for reason in exact.reasons)
    assert any("jumps" in reason for reason in wobbling.reasons) == jumps


def sparse(points: int, in_each: int, in_one: int | None = None) -> SparseModel:
    """The drive with fewer points, of which each frame sees some."""
    seen = np.zeros((FRAMES, points), bool)
    seen[:, :in_each] = True
    if in_one is not None:
        seen[3] = np.arange(points) < in_one
    return replace(drive(0.2), points=np.zeros((points, 3)), seen=seen)


def test_few_points_are_told_of_and_refused_only_where_they_are_next_to_none() -> None:
    few = judge(sparse(200, 40), MOVING)
    assert few.reasons == ()
    assert few.few == "only 200 points, 40 in the poorest frame"
    assert judge(sparse(700, 100), MOVING).few is None
    assert judge(sparse(90, 40), MOVING).reasons == ("only 90 points, 40 in the poorest frame",)
    assert judge(sparse(200, 40, 5), MOVING).reasons == ("only 200 points, 5 in the poorest frame",)


def test_what_shows_little_of_the_street_needs_fewer_points_but_some_in_each_frame() -> None:
    assert judge(sparse(200, 40), MOVING, little=True).few is None
    assert judge(sparse(200, 40, 10), MOVING, little=True).few is not None


@pytest.mark.parametrize("aside_deg", [0.0, 60.0, 90.0])
def test_a_camera_may_look_aside(aside_deg: float) -> None:
    model = drive(0.2)
    turned = model.world_from_camera.copy()
    turned[:, :3, :3] = Rotation.from_euler("y", aside_deg, degrees=True).as_matrix()
    verdict = judge(replace(model, world_from_camera=turned), MOVING)
    assert verdict.reasons == ()
    assert verdict.aside_deg == pytest.approx(aside_deg, abs=1e-3)


def test_a_drive_backwards_is_one() -> None:
    model = drive(0.7)
    back = replace(model, world_from_camera=model.world_from_camera[::-1].copy())
    verdict = judge(back, MOVING)
    assert verdict.backwards
    assert verdict.reasons == ()


def test_a_camera_that_never_moves_is_not_held_to_a_direction() -> None:
    still = replace(drive(0.7), world_from_camera=np.tile(np.eye(4), (FRAMES, 1, 1)))
    assert judge(still, ~MOVING).reasons == ()


def test_no_frame_placed_is_said() -> None:
    lost = replace(drive(0.2), world_from_camera=np.full((FRAMES, 4, 4), np.nan))
    assert judge(lost, MOVING).reasons == ("structure from motion placed no frame",)
