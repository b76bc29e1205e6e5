"""The street as a prior."""

from pathlib import Path

import numpy as np
import pytest

from dreamdrive.data.layout_file import write_layout
from dreamdrive.errors import InputError
from dreamdrive.scene.control import Control
from streetworld import draw_street
from streetworld.prior import STREET_WORLD

SMALL = (64, 48)


def test_only_the_intrinsics_are_given() -> None:
    clip = STREET_WORLD(Control(frames="0:3", size=SMALL, seed=2))
    assert len(clip) == 3
    assert clip.known.intrinsics
    assert clip.known.world_from_camera is None
    assert clip.known.depth_m is None
    assert clip.features["appearance"].shape[:3] == (3, 24, 32)


def test_the_selected_frames_are_handed_over() -> None:
    clip = STREET_WORLD(Control(frames="2:9:3", size=SMALL, hold_out=2))
    assert clip.source_index.tolist() == [2, 5, 8]
    np.testing.assert_allclose(clip.times_s, [0, 0.3, 0.6])
    assert clip.held_out.tolist() == [False, True, False]
    whole = STREET_WORLD(Control(frames="0:9", size=SMALL))
    np.testing.assert_array_equal(clip.frames, whole.frames[[2, 5, 8]])


def test_a_layout_is_drawn_and_said_to_be_simulated(tmp_path: Path) -> None:
    path = tmp_path / "street.json"
    write_layout(draw_street(7), path)
    clip = STREET_WORLD(Control(path=path, frames="0:2", size=SMALL, seed=3))
    drawn = STREET_WORLD(Control(frames="0:24", size=SMALL, seed=7))
    assert (clip.frames == drawn.frames[:2]).all()
    assert "simulated: frames of the layout street.json" in clip.provenance["notes"][0]


def test_what_it_cannot_use_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="street-world takes no --poses; it takes --cameras, --dataset, "):
        STREET_WORLD(Control(poses=Path("poses.json")))
    with pytest.raises(InputError, match="expected a layout as JSON"):
        STREET_WORLD(Control(path=tmp_path / "video.mp4"))
    with pytest.raises(InputError, match="even width"):
        STREET_WORLD(Control(size=(63, 48)))
