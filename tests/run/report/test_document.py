"""The path that was asked for against the one that was found."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.run.report.document import against_request
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.geometry import Focal, Geometry, Scale
from dreamdrive.scene.trajectory import Trajectory
from tests.prior.paths import circle


@pytest.fixture(scope="module")
def clip() -> Clip:
    shape = 12, 4, 4
    return Clip(
        frames=np.zeros((*shape, 3), np.uint8),
        times_s=np.arange(12) / 10,
        camera=np.zeros(12, np.int64),
        rig=(Camera(4.0, 4.0, 2.0, 2.0, 4, 4),),
        valid=np.ones(shape, bool),
        held_out=np.zeros(12, bool),
        source_index=np.arange(12),
    )


def geometry(clip: Clip, path: Trajectory) -> Geometry:
    empty = np.zeros(clip.frames.shape[:3])
    return Geometry(
        cameras=tuple(clip.rig[0].at(pose) for pose in path.world_from_camera),
        depth_m=empty,
        confidence=empty,
        sky=empty > 0,
        moving=empty,
        fixed_regions=np.zeros((1, *empty.shape[1:]), dtype=np.int64),
        region_names=(),
        ground=None,
        scale=Scale("poses", 0.0),
        focal=Focal(30.0, True),
    )


def test_without_a_request_there_is_nothing_to_compare(clip: Clip) -> None:
    assert against_request(clip, geometry(clip, circle(5.0, seconds=1.1))) is None


def test_the_path_in_the_frames_is_compared_with_the_one_asked_for(clip: Clip) -> None:
    asked = circle(5.0, 0.03, seconds=1.1)
    same = against_request(replace(clip, requested=asked), geometry(clip, asked))
    assert same is not None
    assert same["length_m"] == pytest.approx(5.5, abs=0.01)
    assert same["error"]["translation_percent"] == pytest.approx(0, abs=1e-6)
    straight = against_request(replace(clip, requested=asked), geometry(clip, circle(10.0, seconds=1.1)))
    assert straight is not None
    assert straight["error"]["scale"] == pytest.approx(0.5, abs=0.01)
    assert straight["error"]["rotation_deg_per_m"] == pytest.approx(np.rad2deg(0.03), rel=0.01)


def test_poses_that_were_taken_as_asked_are_not_compared(clip: Clip) -> None:
    asked = circle(5.0, 0.03, seconds=1.1)
    known = Known(asked.world_from_camera, generated=True)
    made = against_request(replace(clip, requested=asked, known=known), geometry(clip, asked))
    assert made is not None
    assert made["error"] is None
    assert made["reason"].startswith("the poses are those asked for")


def test_a_path_of_another_rate_is_compared_at_the_times_of_the_frames(clip: Clip) -> None:
    asked = replace(clip, requested=circle(5.0, seconds=2.0, rate_hz=50))
    made = against_request(asked, geometry(clip, circle(5.0, seconds=1.1)))
    assert made is not None
    assert made["error"]["ate_m"] == pytest.approx(0, abs=1e-6)


def test_a_request_to_stand_has_no_errors_over_its_length(clip: Clip) -> None:
    stands = replace(clip, requested=circle(0.0, seconds=1.1))
    assert against_request(stands, geometry(clip, circle(5.0, seconds=1.1))) == {
        "length_m": 0,
        "error": None,
    }
