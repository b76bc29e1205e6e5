import numpy as np
import pytest

from dreamdrive.data.clip_reader import read_clip
from dreamdrive.data.frames.cuts import Cut, Found, find_cuts
from tests.data.textures import approach

A, B = approach(0), approach(1)
BLACK = np.zeros_like(A[:1])


def find(*pieces: np.ndarray) -> Found:
    frames = np.concatenate(pieces)
    return find_cuts(frames, np.ones(frames.shape[:3], dtype=bool))


def mixed(count: int) -> np.ndarray:
    weights = ((np.arange(count) + 1) / (count + 1))[:, None, None, None]
    return ((1 - weights) * A[-1:] + weights * B[:1]).astype(np.uint8)


def test_one_drive_has_no_cut():
    assert find(A) == Found()


def test_frames_that_are_all_equal_have_no_cut():
    assert find(np.repeat(A[:1], 8, axis=0)) == Found()


def test_a_hard_cut_is_named_by_its_first_frame():
    assert find(A, B).cuts == (Cut(5, 6),)


def test_every_cut_is_named():
    assert [cut.first for cut in find(A, B, approach(2)).cuts] == [6, 12]


@pytest.mark.parametrize(("before", "after", "first"), [(1, 6, 1), (6, 1, 6)])
def test_a_cut_beside_an_end_is_found(before, after, first):
    assert [cut.first for cut in find(A[:before], B[:after]).cuts] == [first]


def test_two_frames_tell_no_cut():
    assert find(A[:1], B[:1]) == Found(apart=True)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_mixed_frames_belong_to_neither_scene(count):
    assert find(A, mixed(count), B).cuts == (Cut(5, 6 + count),)


def test_a_cut_by_way_of_black_is_found():
    assert find(A, BLACK, BLACK, B) == Found(cuts=(Cut(5, 8),), blank=(6, 7))


def test_a_black_frame_inside_a_scene_is_no_cut():
    assert find(A[:3], BLACK, A[3:]) == Found(blank=(3,))


def test_a_frame_of_something_else_inside_a_scene_is_no_cut():
    assert find(A[:3], B[:1], A[3:]) == Found(strange=(3,))


def test_what_hides_the_scene_for_two_frames_is_no_cut():
    assert find(A[:3], B[:2], A[3:]).cuts == ()


def test_light_is_no_cut():
    gains = np.array([1, 1, 0.4, 0.4, 1.5, 1])[:, None, None, None]
    assert find(np.clip(A * gains, 0, 255).astype(np.uint8)) == Found()


def test_frames_that_have_little_in_common_throughout_tell_nothing():
    found = find(*(approach(seed, 1) for seed in range(8)))
    assert found.cuts == ()
    assert found.apart


def test_what_is_fixed_to_the_camera_does_not_hide_a_cut():
    bonnet = approach(7, 1, (160, 30))[0]
    pieces = [approach(0, 8), approach(1, 8)]
    for piece in pieces:
        piece[:, -30:] = bonnet
    assert [cut.first for cut in find(*pieces).cuts] == [8]


@pytest.mark.parametrize("size", [(16, 16), (16, 64), (480, 16)])
def test_frames_of_any_shape_are_taken(size):
    assert find(approach(0, 4, size)).cuts == ()


def test_a_clip_knows_its_cuts_and_says_what_to_select(make_folder):
    clip = read_clip(make_folder(list(np.concatenate([A, B[:4]]))), fps=10)
    assert clip.cuts == (6,)
    assert (
        "The picture cuts to another scene at frame 6 of the source; --frames 0:6:1 or 6:10:1 keeps to one."
        in clip.provenance["notes"]
    )


def test_the_advice_counts_in_frames_of_the_source_and_in_the_step(make_folder):
    frames = np.concatenate([np.repeat(A, 2, axis=0), np.repeat(B, 2, axis=0)])
    folder = make_folder(list(frames))
    clip = read_clip(folder, fps=10, frames="4::2")
    assert clip.cuts == (4,)
    assert (
        "The picture cuts to another scene at frame 12 of the source; --frames 12:23:2 or 4:11:2 keeps to "
        "one." in clip.provenance["notes"]
    )
    assert read_clip(folder, fps=10, frames="12:23:2").cuts == ()


def test_a_recorded_drive_has_no_cut_and_two_have_one(data_dir):
    street = read_clip(
        data_dir / "clips/kitti_odom07_left_turn/frames", fps=10, frames="0:100:5", size=(320, 96)
    )
    avenue = read_clip(data_dir / "clips/kitti_odom06_avenue/frames", fps=10, frames="0:40:4", size=(320, 96))
    assert find(street.frames) == find(avenue.frames) == Found()
    assert find(street.frames, avenue.frames).cuts == (Cut(19, 20),)
