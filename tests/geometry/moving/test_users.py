"""Road users move as a whole, in all their frames."""

from dataclasses import replace

import numpy as np
from tests.geometry import toy
from tests.scene.test_look import small_look

from dreamdrive.geometry.depth import make_view
from dreamdrive.geometry.moving import FLAGGED, whole_users
from dreamdrive.scene.look import Look

FRAMES = 6


class Scene:
    """An empty road of the toy street with one block in the picture, in the same place in every frame."""

    def __init__(self) -> None:
        self.drive = toy.drive([], count=FRAMES)
        posed = self.drive.posed
        self.view = make_view(self.drive.clip, posed.cameras, posed.fixed_regions, posed.ground)
        shape = self.drive.depth_m.shape
        self.block = np.zeros(shape, bool)
        middle = shape[2] // 2
        self.block[:, shape[1] // 2 : shape[1] // 2 + 20, middle - 10 : middle + 10] = True
        small = small_look(FRAMES)
        zeros = np.zeros(shape, np.float32)
        self.look: Look = replace(
            small,
            depth=zeros,
            spread=zeros.astype(np.float16),
            classes=zeros.astype(np.uint8),
            confidence=np.ones(shape, np.float16),
            instances=self.block.astype(np.uint16),
        )
        self.inverse = np.full(shape, 0.1, np.float32)
        self.spread = np.full(shape, 0.05, np.float32)

    def found(self, evidence: np.ndarray) -> np.ndarray:
        """What is flagged in the end."""
        times = np.arange(FRAMES) / 10
        whole, _ = whole_users(self.view, self.look, {}, evidence, self.inverse, self.spread, times)
        return whole >= FLAGGED


def test_a_user_of_which_enough_is_flagged_moves_in_all_frames() -> None:
    scene = Scene()
    evidence = np.zeros(scene.block.shape, np.float32)
    evidence[2:5][scene.block[2:5]] = 0.8  # half of the frames
    flagged = scene.found(evidence)
    used = list(scene.view.frames)
    assert (flagged[used] == scene.block[used]).all()


def test_a_user_of_which_little_is_flagged_stands() -> None:
    scene = Scene()
    evidence = np.zeros(scene.block.shape, np.float32)
    evidence[3][scene.block[3]] = 0.8
    scene.inverse[:] = 0  # no depth, and so no place
    assert not scene.found(evidence).any()


def test_what_is_surely_street_does_not_move() -> None:
    scene = Scene()
    scene.inverse[:] = 0
    assert not scene.found(np.where(scene.block, 0, 0.9).astype(np.float32)).any()
    doubtful = replace(scene.look, confidence=np.full(scene.block.shape, 0.4, np.float16))
    scene.look = doubtful
    assert scene.found(np.where(scene.block, 0, 0.9).astype(np.float32))[scene.view.frames[0]].any()


def test_a_foot_that_goes_with_the_camera_moves() -> None:
    scene = Scene()
    steps = np.diff([camera.world_from_camera[2, 3] for camera in scene.view.cameras])
    assert (steps > 0.6).all()  # 10 Hz: faster than 6 m/s
    flagged = scene.found(np.zeros(scene.block.shape, np.float32))
    assert (flagged[list(scene.view.frames)] == scene.block[list(scene.view.frames)]).all()
