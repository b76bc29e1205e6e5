"""Half a turn of what was recorded."""

import numpy as np
import pytest

from dreamdrive.data.cameras.distortion import Distortion
from dreamdrive.data.cameras.lens import SourceLens
from dreamdrive.data.photo import Photo
from dreamdrive.data.pictures.turned import turned_clip, turned_lens, turned_photo
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known, Recorded
from dreamdrive.scene.geometry import Ground
from dreamdrive.scene.trajectory import Trajectory

CAMERA = Camera(20.0, 22.0, 13.0, 9.0, 24, 20)


def clip() -> Clip:
    random = np.random.default_rng(0)
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[1, :3, 3] = 1, 2, 3
    lens = SourceLens(Distortion("opencv", (0.1, 0.01, 0.002, -0.003)), CAMERA).to_json()
    return Clip(
        frames=random.integers(0, 255, (2, 20, 24, 3)).astype(np.uint8),
        times_s=np.array([0.0, 0.1]),
        camera=np.zeros(2, np.int64),
        rig=(CAMERA,),
        valid=random.random((2, 20, 24)) > 0.1,
        held_out=np.zeros(2, bool),
        source_index=np.arange(2),
        features={"z": random.random((2, 10, 12, 2))},
        known=Known(
            world_from_camera=poses,
            depth_m=random.random((2, 20, 24)) + 1,
            points=np.array([[1.0, 2.0, 3.0]]),
            ground=Ground(np.array([0.1, -0.9, 0.0]), 1.5),
        ),
        requested=Trajectory(poses, np.array([0.0, 0.1])),
        recorded=Recorded("a", True, (52, 42), (26, 21), (1, 0), lens),
    )


def test_what_is_known_of_a_point_turns_with_its_pixel() -> None:
    before, after = clip(), turned_clip(clip())
    frame, row, column = 1, 4, 7
    there = 19 - row, 23 - column
    for name in ("frames", "valid"):
        assert np.array_equal(getattr(after, name)[frame][there], getattr(before, name)[frame, row, column])
    point = np.array([[0.5, 0.25, 9.0]])
    turn = np.diag([-1.0, -1.0, 1.0])

    def seen(made: Clip, world: np.ndarray) -> np.ndarray:
        assert made.known.world_from_camera is not None
        return made.rig[0].at(made.known.world_from_camera[frame]).project(world)[0, :2]

    assert np.allclose(seen(after, point @ turn), (24, 20) - seen(before, point))
    assert before.known.ground is not None
    assert after.known.ground is not None
    assert after.known.ground.height_m(point @ turn) == pytest.approx(before.known.ground.height_m(point))
    assert after.known.points is not None
    assert after.known.points.tolist() == [[-1, -2, 3]]
    assert after.requested is not None
    assert after.requested.positions_m[1].tolist() == [-1, -2, 3]
    assert np.array_equal(after.features["z"][0, 0, 0], before.features["z"][0, 9, 11])


def test_two_half_turns_are_none() -> None:
    before = clip()
    after = turned_clip(turned_clip(before))
    assert after.recorded is not None
    assert before.recorded is not None
    assert after.recorded.offset == before.recorded.offset == (1, 0)
    assert turned_clip(before).recorded.offset == (1, 1)  # pyright: ignore[reportOptionalMemberAccess]
    assert after.recorded.lens == before.recorded.lens
    assert np.array_equal(after.known.world_from_camera, before.known.world_from_camera)


@pytest.mark.parametrize(
    "distortion",
    [
        Distortion("fisheye", (0.1, 0.02, 0.0, 0.0)),
        Distortion("opencv", tuple(0.01 * k for k in range(1, 15))),
    ],
)
def test_a_turned_lens_bends_turned_points_alike(distortion: Distortion) -> None:
    points = np.random.default_rng(1).uniform(-0.5, 0.5, (30, 2))
    turned = turned_lens(SourceLens(distortion, CAMERA))
    assert np.allclose(turned.distortion.distort(-points), -distortion.distort(points))
    assert (turned.camera.cx_px, turned.camera.cy_px) == (11, 11)


def test_a_photo_turns_with_its_camera() -> None:
    rgb = np.arange(24 * 20 * 3, dtype=np.uint8).reshape(20, 24, 3)
    after = turned_photo(Photo(rgb, CAMERA, False, ("said",)))
    assert np.array_equal(after.rgb, rgb[::-1, ::-1])
    assert after.camera.cx_px == 11
    assert len(after.notes) == 2
