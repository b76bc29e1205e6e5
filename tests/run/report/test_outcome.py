"""The lines at the end of a run, from its report."""

from pathlib import Path
from typing import Any

import pytest

from dreamdrive.errors import InputError
from dreamdrive.run.report.outcome import duration, lines_of, outcome_of, read_outcome

REPORT: dict[str, Any] = {
    "frames": {"count": 24, "size": [480, 270], "source_index": [0]},
    "gaussians": {"static": 119936, "dynamic": 21327},
    "actors": [{"name": "a"}, {"name": "b"}],
    "stages": {
        "prior": {"seconds": 0.7, "cached": False},
        "geometry": {"seconds": 22.6},
        "static": {"seconds": 19.5},
        "fit": {"seconds": 89.8},
        "videos": {"seconds": 7.9},
    },
    "held_out": {"4": {}, "12": {}, "20": {}},
    "held_out_mean": {"psnr": 28.92, "ssim": 0.9},
    "baselines": {"flow_interpolation": {"mean": {"psnr": 25.61, "ssim": 0.7}}},
    "rough": [],
    "limits": ["from the height of the camera, within 4 %", "views up to 2 m beside hold best"],
}


def lines(**changes: Any) -> tuple[str, ...]:
    return lines_of(outcome_of({**REPORT, **changes}, "report.json", already_finished=False))


def test_a_good_run_is_told_in_four_lines() -> None:
    assert lines() == (
        "made    a scene of 141,263 Gaussians with 2 moving things, from 24 frames of 480x270, in 2 min 20 s "
        "(fit 1 min 30 s, geometry 23 s, static 20 s, the rest 9 s)",
        "checked 3 held-out frames are predicted with 28.9 dB; blending the frames beside gives 25.6 dB "
        "(more is better)",
        "metres  from the height of the camera, within 4 %.",
        "aside   views up to 2 m beside hold best.",
    )


def test_the_whole_time_is_that_of_the_run_where_it_is_known() -> None:
    said = lines(seconds=150.0)[0]
    assert said.endswith("in 2 min 30 s (fit 1 min 30 s, geometry 23 s, static 20 s, the rest 18 s)")


def test_a_rough_run_says_why_in_a_fifth_line() -> None:
    said = lines(rough=["there are only 3 frames. Give 8 or more", "the camera stands"])
    assert len(said) == 5
    assert said[2] == "rough   because there are only 3 frames. Give 8 or more. Also, the camera stands."


def test_ids_and_what_is_known_of_the_drive_are_told() -> None:
    kinds = ["vehicle", "person", "vehicle"]
    limits = ["known", "near", "20 m in 2 s", "shift.mp4 is 2 m to the left"]
    said = lines(actors=[{"id": i + 3, "kind": kind} for i, kind in enumerate(kinds)], limits=limits)
    assert said[1] == "moving  vehicle 3 5, person 4: render --without ID leaves one out"
    assert said[-2:] == ("drive   20 m in 2 s.", "shift   shift.mp4 is 2 m to the left.")
    many = lines(actors=[{"id": i, "kind": "person"} for i in range(50)])[1]
    assert many.endswith(" 38 39, and 10 more in report.json: render --without ID leaves one out")


def test_what_was_not_measured_is_not_told() -> None:
    said = lines(held_out={}, held_out_mean=None, actors=[], gaussians={"static": 7, "dynamic": 0})
    assert [line.split()[0] for line in said] == ["made", "metres", "aside"]
    assert said[0].startswith("made    a scene of 7 Gaussians with nothing that moves, from 24 frames")


def test_what_moves_without_a_track_is_not_called_all_of_the_scene() -> None:
    parts = lines(actors=[], gaussians={"static": 7, "dynamic": 2})[0]
    assert parts.startswith("made    a scene of 9 Gaussians with parts that move and have no track, from 24")
    whole = lines(actors=[], gaussians={"static": 0, "dynamic": 9})[0]
    assert whole.startswith("made    a scene of 9 Gaussians with all of it free to move, from 24 frames")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"gaussians": 3}, "report.json: Expected `object`, got `int` - at `$.gaussians`"),
        ({"rough": ["\x1b[2J"]}, "`$.rough[0]`"),
        ({"stages": {"fit": {"seconds": -1}}}, "$.stages[...].seconds"),
        ({"stages": {"a": {"seconds": 1e308}, "b": {"seconds": 1e308}}}, "$.stages[...].seconds"),
    ],
)
def test_a_report_that_is_something_else_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError) as caught:
        lines(**changes)
    assert message in str(caught.value)


def test_a_report_that_is_no_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_outcome(tmp_path / "report.json", already_finished=True)


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.2, "1 s"), (59.4, "59 s"), (60, "1 min"), (125, "2 min 5 s"), (4800, "1 h 20 min")],
)
def test_times_are_told_for_people(seconds: float, words: str) -> None:
    assert duration(seconds) == words
