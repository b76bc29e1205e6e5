"""What is seen in a clip, and what it says of its cameras."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.street_network import look_at, with_looks
from streetworld import make_street


@pytest.fixture(scope="module")
def clip() -> Clip:
    made = make_street(1, 2, size=(96, 60))
    return Clip(
        frames=made.frames,
        times_s=made.times_s,
        camera=np.zeros(2, np.int64),
        rig=(Camera(90.0, 90.0, 48.0, 30.0, 96, 60),),
        valid=np.ones(made.frames.shape[:3], bool),
        held_out=np.zeros(2, bool),
        source_index=np.arange(2),
    )


def test_a_lens_of_which_nothing_is_told_is_the_one_that_is_seen(clip: Clip) -> None:
    looks = look_at(clip, "street")
    seen = with_looks(clip, looks)
    assert seen.rig[0].fx_px == looks[0].camera.focal_px != clip.rig[0].fx_px
    assert seen.looks is looks
    assert with_looks(clip, ()) == clip


@pytest.mark.parametrize("known", [Known(intrinsics=True), Known(hfov=True)])
def test_a_lens_that_is_told_is_kept(clip: Clip, known: Known) -> None:
    told = replace(clip, known=known)
    (look,) = looks = look_at(told, "street")
    assert look.camera.focal_px == 90
    assert with_looks(told, looks).rig == told.rig
