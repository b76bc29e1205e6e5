"""Times in the names of images."""

from pathlib import Path, PurePath

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dreamdrive.data.clip_reader import read_clip
from dreamdrive.data.frames.name_times import times_of_names
from dreamdrive.data.pictures.picture_file import write_picture
from tests.data.textures import texture

START_NS = 1_557_539_924_049_981_119


def paths(*stems: object) -> list[PurePath]:
    return [PurePath(f"{stem}.png") for stem in stems]


@pytest.mark.parametrize(
    ("form", "exact_s"),
    [
        (lambda ns: f"{ns / 1e9:.6f}", 1e-6),
        (lambda ns: f"{ns // 10**9}_{ns % 10**9:09d}", 1e-9),
        (lambda ns: f"{ns}", 1e-9),
        (lambda ns: f"CAM_FRONT__{ns // 1000}", 1e-6),
        (lambda ns: f"frame-{ns // 10**6}", 1e-3),
    ],
)
def test_every_way_to_write_a_time_gives_seconds_since_the_first(form, exact_s: float) -> None:
    steps_ns = np.array([0, 99_000_001, 201_000_000, 299_999_999])
    found = times_of_names(paths(*(form(START_NS + int(step)) for step in steps_ns)))
    assert found is not None
    np.testing.assert_allclose(found, steps_ns / 1e9, atol=2 * exact_s)


@pytest.mark.parametrize(
    "stems",
    [
        ("0000", "0001"),
        ("1557539924.1", "b"),
        ("1557539924.2", "1557539924.1"),
        ("1557539924.1", "1557539924.10"),
        ("0000000001.1", "0000000002.1"),
        ("9999999999999", "9999999999999999"),
        ("1557539924.1",),
    ],
)
def test_other_numbers_are_no_times(stems: tuple[str, ...]) -> None:
    assert times_of_names(paths(*stems)) is None


@given(st.lists(st.text("0123456789._-a", max_size=24), max_size=6))
def test_any_names_are_read_or_left(stems: list[str]) -> None:
    found = times_of_names(paths(*stems))
    assert found is None or (len(found) == len(stems) and found[0] == 0 and (np.diff(found) > 0).all())


def test_a_folder_takes_its_times_from_its_names_unless_a_rate_is_told(tmp_path: Path) -> None:
    for step_s in (0, 0.5, 1.0, 3.0, 3.5):
        write_picture(tmp_path / f"{1557539924 + step_s:.6f}.png", texture(48, 64, int(10 * step_s)))
    clip = read_clip(tmp_path)
    np.testing.assert_allclose(clip.times_s, [0, 0.5, 1.0, 3.0, 3.5], atol=1e-6)
    notes = clip.provenance["notes"]
    assert "The images' names tell their times: 1.14 Hz in the mean." in notes
    assert any("times jump, by 2 s between frames 2 and 3" in note for note in notes)
    np.testing.assert_allclose(read_clip(tmp_path, frames="1:5:2").times_s, [0, 2.5], atol=1e-6)
    np.testing.assert_allclose(read_clip(tmp_path, fps=10).times_s, np.arange(5) / 10)
