from pathlib import PurePath

import numpy as np
import pytest

from dreamdrive.data.frames.cuts import Cut, Found
from dreamdrive.data.frames.remarks import of_cuts, of_damage, of_missing_images, of_time_jumps, runs


@pytest.mark.parametrize(
    ("numbers", "words"),
    [
        ([3], "3"),
        ([3, 4], "3 and 4"),
        ([3, 4, 5], "3 to 5"),
        ([3, 5, 6, 9], "3, 5 to 6 and 9"),
        ([1, 3, 5, 7, 9, 10, 20], "1, 3, 5, 7 and 3 more"),
    ],
)
def test_numbers_in_words(numbers, words):
    assert runs(numbers) == words


def test_damaged_frames_are_one_sentence():
    assert of_damage([]) == []
    assert of_damage([7]) == [
        "Frame 7 of the video is damaged, or built upon a damaged one, and patched up by the decoder."
    ]
    assert of_damage([12, 13, 14]) == [
        "Frames 12 to 14 of the video are damaged, or built upon damaged ones, and patched up by the decoder."
    ]


def test_pieces_of_one_frame_are_no_advice():
    index = np.arange(10, 20, 2)
    assert of_cuts(Found((Cut(0, 1),)), index) == [
        "The picture cuts to another scene at frame 12 of the source; --frames 12:19:2 keeps to one."
    ]


def test_the_longest_pieces_come_first():
    found = Found((Cut(1, 2), Cut(11, 14), Cut(16, 17)))
    assert of_cuts(found, np.arange(22)) == [
        "The picture cuts to another scene at frames 2, 14 and 17 of the source; "
        "--frames 2:12:1, 17:22:1 or 14:17:1 keeps to one."
    ]


def test_blank_and_strange_frames_are_named():
    assert of_cuts(Found(blank=(1, 2), strange=(4,)), np.arange(0, 20, 2)) == [
        "Frames 2 and 4 of the source show nothing that could be recognised.",
        "Frame 8 of the source has nothing in common with the frames before and after.",
    ]


def test_frames_without_any_motion_between_them_are_named():
    assert of_cuts(Found(apart=True, blank=(0, 1, 2)), np.arange(3)) == [
        "Most frames have nothing in common with the next one, and no motion can be seen between them; "
        "choose a smaller step with --frames if this is one drive.",
        "No frame shows anything that could be recognised.",
    ]


def names(numbers, form="{:04d}.png"):
    return [PurePath(form.format(number)) for number in numbers]


def test_missing_numbers_of_images_are_named():
    assert of_missing_images(names([1, 2, 5, 6])) == [
        "The images are numbered in steps of 1, and leave out 3 and 4: they count as evenly spaced in time "
        "all the same."
    ]
    assert of_missing_images(names([0, 5, 10, 25, 30], "cam1_{:d}.jpg")) == [
        "The images are numbered in steps of 5, and leave out those between 10 and 25: they count as evenly "
        "spaced in time all the same."
    ]


@pytest.mark.parametrize(
    "files",
    [
        names([0, 5, 10, 15]),
        names([1, 2]),
        names([1, 2, 3, 3, 9]),
        names([1000, 1099, 1201, 1300]),
        [PurePath("a.png"), PurePath("b.png"), PurePath("d.png")],
    ],
)
def test_regular_steps_times_and_other_names_leave_out_nothing(files):
    assert of_missing_images(files) == []


def test_very_large_gaps_are_told_in_few_words():
    assert of_missing_images(names([1, 2, 3, 10**17])) == [
        f"The images are numbered in steps of 1, and leave out those between 3 and {10**17}: they count as "
        "evenly spaced in time all the same."
    ]


def test_a_jump_of_the_clock_is_named():
    index = np.arange(0, 12, 2)
    even = np.arange(6) * 0.1
    assert of_time_jumps(index, even) == []
    assert of_time_jumps(index, np.array([0.0, 0.1, 0.2, 0.5, 0.6, 0.7])) == [
        "The recording's times jump, by 0.3 s between frames 4 and 6; elsewhere a step takes 0.1 s."
    ]
