"""Several drives from one first frame."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dreamdrive.data import read_trajectories
from dreamdrive.errors import InputError
from dreamdrive.prior import PRIORS
from dreamdrive.prior.rollouts import rollouts_of, together
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.control import Command, Control
from dreamdrive.scene.trajectory import Trajectory


def made(shade: int, aside_m: float, notes: tuple[str, ...] = ()) -> Clip:
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[:, 0, 3] = aside_m * np.arange(3)
    frames = np.full((3, 6, 8, 3), shade, np.uint8)
    return Clip(
        frames=frames,
        times_s=np.arange(3) / 10,
        camera=np.zeros(3, np.int64),
        rig=(Camera(8.0, 8.0, 4.0, 3.0, 8, 6),),
        valid=np.ones((3, 6, 8), bool),
        held_out=np.array([False, True, False]),
        source_index=np.arange(3),
        features={"appearance": np.full((3, 3, 4, 2), shade, np.float32)},
        known=Known(world_from_camera=poses, depth_m=np.full((3, 6, 8), float(shade)), generated=True),
        provenance={"notes": ["both", *notes]},
    )


def test_each_drive_is_a_camera_and_frames_come_in_the_order_of_time() -> None:
    clip = together([made(1, 0.0), made(2, 1.0, ("second",))])
    assert clip.camera.tolist() == [0, 1, 0, 1, 0, 1]
    np.testing.assert_allclose(clip.times_s, [0, 0, 0.1, 0.1, 0.2, 0.2])
    assert clip.frames[:, 0, 0, 0].tolist() == [1, 2, 1, 2, 1, 2]
    assert clip.held_out.tolist() == [False, False, True, True, False, False]
    assert clip.known.shared_first
    assert clip.known.world_from_camera is not None
    assert clip.known.world_from_camera[:, 0, 3].tolist() == [0, 0, 0, 1, 0, 2]
    assert clip.known.depth_m is not None
    assert clip.known.depth_m[3, 0, 0] == 2
    assert clip.features["appearance"].shape == (6, 3, 4, 2)
    assert len(clip.rig) == 2
    assert clip.provenance["notes"][1:] == ["both", "second"]
    one = made(1, 0.0)
    assert together([one]) is one


def test_actions_and_paths_become_drives_of_their_own(tmp_path: Path) -> None:
    actions = (Command("left"), Command("stop"))
    several = rollouts_of(Control(actions=actions, frames="0:5"))
    assert [each.action for each in several] == list(actions)
    assert all(each.actions is None for each in several)
    with pytest.raises(InputError, match="start at 0"):
        rollouts_of(Control(actions=actions, frames="2:5"))
    one = Control(action=actions[0], frames="2:5")
    assert rollouts_of(one) == [one]
    pose = np.eye(4).tolist()
    path = tmp_path / "paths.json"
    each = {"world_from_camera": [pose, pose], "times_s": [0.0, 1.0]}
    path.write_text(json.dumps([each, each]))
    read = rollouts_of(Control(trajectories=path))
    assert [type(each.trajectory) for each in read] == [Trajectory, Trajectory]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[]", "empty list"),
        ("{}", "a JSON list of Trajectory"),
        ('[{"world_from_camera": [[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]]}]', "number 1"),
        ("[1]", "a JSON list of Trajectory"),
    ],
)
def test_a_file_of_paths_that_cannot_be_used_is_a_sentence(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "paths.json"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_trajectories(path)


def test_only_one_way_of_asking_counts(tmp_path: Path) -> None:
    control = Control(path=tmp_path / "a.jpg", actions=(Command("left"), Command("right")))
    PRIORS.choose("photo").check(control)
    with pytest.raises(InputError, match="give one of them"):
        PRIORS.choose("photo").check(replace(control, trajectories=tmp_path / "paths.json"))
    with pytest.raises(InputError, match="takes no --action"):
        PRIORS.choose("street-world").check(control)
