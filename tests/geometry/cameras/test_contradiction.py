from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.geometry.cameras.contradiction import check, explain
from dreamdrive.geometry.evidence import observe
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.geometry import Ground
from tests.geometry.toy_drive import make_clip, straight, turning

PATH = turning(8, 0.4, 2.0)


@pytest.fixture(scope="module")
def clip() -> Clip:
    return make_clip(PATH)


def share(clip: Clip, poses: np.ndarray) -> float:
    found = explain(observe(clip), poses)
    assert found.own > 0.8
    assert found.contradictory == (found.given < 0.5 * found.own)
    return found.given / found.own


def test_the_poses_of_the_frames_explain_what_moves(clip: Clip) -> None:
    assert share(clip, PATH) > 0.95


def test_the_world_and_its_unit_do_not_matter(clip: Clip) -> None:
    moved = np.linalg.inv(PATH[3]) @ PATH
    moved[:, :3, 3] *= 0.01
    assert share(clip, moved) > 0.95


@pytest.mark.parametrize(
    "wrong",
    [
        np.linalg.inv,
        lambda poses: poses[::-1].copy(),
        lambda poses: poses @ np.diag([1.0, -1.0, -1.0, 1.0]),
        lambda poses: poses[np.random.default_rng(1).permutation(len(poses))],
    ],
    ids=["camera-from-world", "last-first", "y-up", "shuffled"],
)
def test_wrong_poses_are_refused(clip: Clip, wrong) -> None:
    assert share(clip, wrong(PATH)) < 0.5
    given = replace(clip, known=Known(world_from_camera=wrong(PATH), intrinsics=True))
    with pytest.raises(InputError, match=r"contradict the frames.*world-from-camera") as refused:
        check(given, observe(given))
    assert "guess" not in str(refused.value)


def test_frames_that_a_model_drew_are_nobodys_mistake(clip: Clip) -> None:
    drawn = replace(clip, known=Known(np.linalg.inv(PATH), intrinsics=True, generated=True))
    check(drawn, observe(drawn))


def test_a_wrong_focal_length_is_thought_of(clip: Clip) -> None:
    narrow = replace(clip.rig[0], fx_px=4 * clip.rig[0].fx_px, fy_px=4 * clip.rig[0].fy_px)
    given = replace(clip, rig=(narrow,), known=Known(world_from_camera=PATH, intrinsics=False))
    with pytest.raises(InputError, match="the focal length is a guess"):
        check(given, observe(given))


def test_frames_that_show_nothing_contradict_nothing(clip: Clip) -> None:
    blank = replace(clip, frames=np.full_like(clip.frames, 90))
    evidence = observe(blank)
    assert explain(evidence, PATH).pairs == 0
    still = straight([0.0] * 7)
    evidence = observe(clip)
    assert explain(evidence, still).pairs == 0


def test_poses_that_stand_are_refused_where_the_camera_moves(clip: Clip) -> None:
    standing = np.tile(np.eye(4), (len(clip), 1, 1))
    given = replace(clip, known=Known(world_from_camera=standing, intrinsics=True))
    with pytest.raises(InputError) as refused:
        check(given, observe(given))
    assert str(refused.value) == (
        "the given poses are all the same, but the camera moves in the frames: with them nothing has a "
        "depth. Give the pose of each frame, or none to have them found"
    )
    still = replace(given, frames=np.repeat(clip.frames[:1], len(clip), axis=0))
    check(still, observe(still))


def test_beside_a_camera_that_is_borne_out_one_pair_that_agrees_is_enough(clip: Clip) -> None:
    road = Ground(np.array([0.0, -1.0, 0.0]), 1.5)
    wrong = PATH.copy()
    wrong[: len(wrong) - 4] = np.linalg.inv(PATH)[: len(wrong) - 4]  # only the last pair is right
    alone = replace(clip, known=Known(wrong, intrinsics=True))
    with pytest.raises(InputError, match="contradict the frames"):
        check(alone, observe(alone))
    check(replace(clip, known=replace(alone.known, ground=road)), observe(alone))
    inverted = replace(clip, known=Known(np.linalg.inv(PATH), intrinsics=True, ground=road))
    with pytest.raises(InputError, match="contradict the frames"):
        check(inverted, observe(inverted))


def test_traffic_before_a_standing_side_camera_contradicts_nothing(clip: Clip) -> None:
    road = Ground(np.array([0.0, -1.0, 0.0]), 1.5)
    standing = np.tile(np.eye(4), (len(clip), 1, 1))
    given = replace(clip, known=Known(standing, intrinsics=True, ground=road))
    check(given, observe(given))
