"""Frames of several cameras."""

import numpy as np

from tests.rigs import rig_clip


def test_frames_are_found_by_camera_and_step() -> None:
    clip = rig_clip()
    assert clip.step.tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5]
    assert clip.of_camera(1).tolist() == [1, 3, 5, 7, 9, 11]
    assert clip.held_out.nonzero()[0].tolist() == [4, 5]
    assert clip.seen_of(0) == [0, 2, 6, 8, 10]
    assert (np.diff(clip.times_s) >= 0).all()
