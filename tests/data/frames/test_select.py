import numpy as np
import pytest
from hypothesis import given, strategies as st

from dreamdrive.data.frames.select import Selection, held_out_mask
from dreamdrive.errors import InputError

maybe = st.none() | st.integers(-30, 30)


def text_of(*parts: int | None) -> str:
    return ":".join("" if p is None else str(p) for p in parts)


@given(maybe, maybe, st.none() | st.integers(1, 9), st.integers(1, 25))
def test_a_selection_is_a_python_slice_or_a_clear_refusal(start, stop, step, count):
    expected = list(range(count)[start:stop:step])
    selection = Selection.parse(text_of(start, stop, step))
    beyond = (
        stop is not None and (start or 0) >= 0 and set(range(start or 0, stop, step or 1)) - set(range(count))
    )
    if expected and not beyond:
        assert list(selection.resolve(count, "clip.mp4")) == expected
    else:
        with pytest.raises(InputError, match=r"clip\.mp4|START"):
            selection.resolve(count, "clip.mp4")


@given(st.integers(0, 30), st.integers(1, 60), st.integers(1, 9), st.integers(1, 60))
def test_without_the_count_the_same_frames_are_wanted(start, stop, step, count):
    selection = Selection(start, stop, step)
    try:
        known = selection.resolve(count, "x")
    except InputError:
        return
    assert known == selection.resolve(None, "x")


def test_asking_beyond_the_end_names_the_frame_and_the_count():
    with pytest.raises(InputError, match=r"frame 66, but clip has only 40 frames \(0 to 39\)"):
        Selection.parse("20:68:2").resolve(40, "clip")


def test_a_stop_beyond_the_end_is_fine_when_the_step_jumps_over_it():
    assert list(Selection.parse("0:48:2").resolve(47, "clip"))[-1] == 46


@pytest.mark.parametrize("text", ["", "5", "a:b", "1:2:3:4", "1.5:3", ":::", "0-10"])
def test_only_slices_are_understood(text):
    with pytest.raises(InputError, match="expected START:STOP or START:STOP:STEP"):
        Selection.parse(text)


@pytest.mark.parametrize("text", [":", "::", "0:", "0::1", " 0 : : 1 "])
def test_parts_may_be_left_out(text):
    assert Selection.parse(text) == Selection.parse(None)


@pytest.mark.parametrize("text", ["0:10:0", "10:0:-1"])
def test_the_step_must_be_positive(text):
    with pytest.raises(InputError, match="step is"):
        Selection.parse(text)


@pytest.mark.parametrize(("text", "count"), [("4:4", 9), ("9:", 9), ("5:2", 9), ("-1:-3", 9)])
def test_selecting_nothing_is_refused(text, count):
    with pytest.raises(InputError, match="selects no frame"):
        Selection.parse(text).resolve(count, "clip")


def test_the_held_out_frames_of_24_by_8():
    assert np.flatnonzero(held_out_mask(24, 8)).tolist() == [4, 12, 20]


@given(st.integers(2, 60), st.integers(2, 20))
def test_held_out_frames_follow_the_rule(count, every):
    rule = [i for i in range(1, count - 1) if i % every == every // 2]
    if rule:
        assert np.flatnonzero(held_out_mask(count, every)).tolist() == rule
    else:
        with pytest.raises(InputError, match="withholds nothing"):
            held_out_mask(count, every)


@pytest.mark.parametrize("every", [1, 0, -3])
def test_a_hold_out_below_two_is_refused(every):
    with pytest.raises(InputError, match="expected 2 or more"):
        held_out_mask(9, every)


def test_no_hold_out_withholds_nothing():
    assert not held_out_mask(5, None).any()
