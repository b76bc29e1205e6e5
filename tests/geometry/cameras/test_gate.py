from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.geometry.cameras.gate import judge
from dreamdrive.geometry.cameras.sfm import Model
from dreamdrive.geometry.options import GateOptions

FRAMES = 12
MOVING = np.ones(FRAMES - 1, bool)


def drive(reprojection_px: float, sideways_m: float = 0.0) -> Model:
    """A drive straight ahead, 0.5 m a frame; one frame in the middle lies to the side."""
    poses = np.tile(np.eye(4), (FRAMES, 1, 1))
    poses[:, 2, 3] = 0.5 * np.arange(FRAMES)
    poses[FRAMES // 2, 0, 3] = sideways_m
    seen = np.ones((FRAMES, 700), bool)
    return Model(poses, np.zeros((700, 3)), seen, np.zeros(5), 0.0, reprojection_px, None)


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


def test_what_shows_little_of_the_street_needs_fewer_points_but_some_in_each_frame() -> None:
    seen = np.zeros((FRAMES, 200), bool)
    seen[:, :40] = True
    sparse = replace(drive(0.2), points=np.zeros((200, 3)), seen=seen)
    assert any("only 200 points, 40 in" in reason for reason in judge(sparse, MOVING).reasons)
    assert judge(sparse, MOVING, little=True).reasons == ()
    seen = seen.copy()
    seen[3, 10:] = False
    poorer = replace(sparse, seen=seen)
    assert any("10 in the poorest" in reason for reason in judge(poorer, MOVING, little=True).reasons)


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
