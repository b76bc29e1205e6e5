"""Fields of the kinds of input, and how they are called at the command line."""

from dataclasses import fields, replace
from pathlib import Path

import pytest

from dreamdrive.errors import InputError
from dreamdrive.scene.control import (
    Control,
    Driving,
    PhotoInput,
    RecordingInput,
    StreetInput,
    VideoModelInput,
    fields_of,
    flag_of,
)

KINDS = (RecordingInput, PhotoInput, StreetInput, VideoModelInput)


def test_a_control_has_what_its_kinds_have_and_nothing_else() -> None:
    assert fields_of(Control) == fields_of(*KINDS)
    declared = [
        name for kind in Control.__mro__ for name in vars(kind).get("__annotations__", {}) if name != "_"
    ]
    assert sorted(declared) == sorted(each.name for each in fields(Control))


def test_controls_are_made_read_and_changed_by_flat_names() -> None:
    control = Control(Path("clip.mp4"), frames="0:24", poses=Path("poses.json"))
    assert (control.path, control.frames, control.poses) == (Path("clip.mp4"), "0:24", Path("poses.json"))
    assert replace(control, frames="0:8").frames == "0:8"
    with pytest.raises(TypeError):
        Control(Path("clip.mp4"), "0:24")  # type: ignore[misc]


@pytest.mark.parametrize(
    ("name", "flag"),
    [
        ("hfov_deg", "--hfov"),
        ("traffic_speed_m_s", "--traffic-speed"),
        ("hold_out", "--hold-out"),
        ("actions", "--action"),
        ("trajectories", "--trajectories"),
    ],
)
def test_flags_leave_units_out(name: str, flag: str) -> None:
    assert flag_of(name) == flag


def test_a_refusal_names_flags() -> None:
    takes = fields_of(PhotoInput) - fields_of(Driving)
    with pytest.raises(InputError, match="a photo takes no --fps and no --poses; it takes --fill, --hfov, "):
        Control(fps=3.0, poses=Path("p"), seed=7).check_taken(takes - {"fps", "frames"}, "a photo")
