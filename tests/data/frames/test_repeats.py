"""Frames that show the one before them again."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.data.frames.repeats import without_repeats
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known

SIZE = 96, 64


def drive(places: list[float], noise: float = 0.0) -> np.ndarray:
    """A textured wall, seen from places beside one another in pixels."""
    random = np.random.default_rng(0)
    wall = np.kron(random.integers(0, 255, (16, 100)), np.ones((4, 8)))
    seen = np.array([wall[:, round(x) : round(x) + SIZE[0]] for x in places])
    seen = np.repeat(seen[..., None], 3, axis=3)
    return np.clip(seen + random.normal(0, noise, seen.shape), 0, 255).round().astype(np.uint8)


def clip_of(*cameras: np.ndarray) -> Clip:
    count, rig = len(cameras[0]), len(cameras)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, 2, 3] = np.arange(count)
    return Clip(
        frames=np.stack(cameras, axis=1).reshape(-1, SIZE[1], SIZE[0], 3),
        times_s=np.repeat(0.1 * np.arange(count), rig),
        camera=np.tile(np.arange(rig), count),
        rig=(Camera(90.0, 90.0, 48.0, 32.0, *SIZE),) * rig,
        valid=np.ones((count * rig, SIZE[1], SIZE[0]), bool),
        held_out=np.zeros(count * rig, bool),
        source_index=np.repeat(np.arange(count), rig),
        known=Known(world_from_camera=np.repeat(poses, rig, axis=0)),
        cuts=(4 * rig,),
    )


@pytest.mark.parametrize("noise", [0.0, 2.0])
def test_a_slow_camera_stored_at_twice_its_rate_keeps_every_other_frame_and_its_times(noise: float) -> None:
    clip = clip_of(drive([x for k in range(8) for x in (9 * k, 9 * k)], noise))
    rest = without_repeats(clip, hold_out=4)
    assert rest.source_index.tolist() == list(range(0, 16, 2))
    assert rest.times_s == pytest.approx(0.2 * np.arange(8))
    assert np.flatnonzero(rest.held_out).tolist() == [2, 6]
    assert rest.known.world_from_camera is not None
    assert rest.known.world_from_camera[:, 2, 3].tolist() == list(range(0, 16, 2))
    assert rest.cuts == (2,)
    (said,) = rest.provenance["notes"]
    assert said == "8 of 16 frames repeat the one before and are left out; the times of the others stay."


def test_a_frozen_stretch_is_left_out_where_frames_are_equal() -> None:
    rest = without_repeats(clip_of(drive([0, 9, 18, 27, 27, 27, 27, 27, 72, 81, 90])), None)
    assert rest.source_index.tolist() == [0, 1, 2, 3, 8, 9, 10]


@pytest.mark.parametrize(
    "places",
    [
        [9 * k for k in range(12)],  # a drive
        [0, 9, 18, 26, 32, 36, 38, 39, 39, 39, 39, 39, 39],  # that comes to stand
        [0, 9, 18, 27, 27, 27, 27, 27, 36, 45, 54],  # all at once, for longer: it may be a red light
        [0] * 10,
    ],
)
def test_noise_tells_a_camera_that_drives_or_stands_from_one_that_hung(places: list[float]) -> None:
    clip = clip_of(drive(places, noise=2.0))
    assert without_repeats(clip, None) is clip


def test_what_is_all_alike_is_for_others_to_judge() -> None:
    clip = clip_of(drive([0] * 10))
    assert without_repeats(clip, None) is clip


def test_a_time_of_a_rig_stays_while_one_of_its_cameras_sees_something_new() -> None:
    moving, hung = drive([9 * k for k in range(8)]), drive([0, 0, 0, 0, 36, 45, 54, 63])
    clip = clip_of(moving, hung)
    assert without_repeats(clip, None) is clip
    rest = without_repeats(clip_of(hung, hung), None)
    assert rest.source_index.tolist() == [k for k in (0, 4, 5, 6, 7) for _ in range(2)]
    assert rest.camera.tolist() == [0, 1] * 5


def test_features_and_what_the_clip_says_already_are_kept() -> None:
    clip = clip_of(drive([x for k in range(6) for x in (9 * k, 9 * k)]))
    clip = replace(
        clip, features={"z": np.arange(12.0).reshape(12, 1, 1, 1)}, provenance={"notes": ["said before"]}
    )
    rest = without_repeats(clip, None)
    assert rest.features["z"].ravel().tolist() == [0, 2, 4, 6, 8, 10]
    assert rest.provenance["notes"][0] == "said before"
