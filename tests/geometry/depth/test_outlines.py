"""Outlines of depth follow those of the picture."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dreamdrive.geometry.depth import make_view, with_outlines
from dreamdrive.geometry.depth.outlines import redrawn, weighted_median
from tests.geometry import toy

HEIGHT, WIDTH = 48, 80
NEAR, FAR = 1 / 5, 1 / 30


class Post:
    """A dark board 5 m away before a bright wall 30 m away; its depth is two pixels too wide."""

    def __init__(self) -> None:
        board = np.zeros((HEIGHT, WIDTH), bool)
        board[10:40, 30:50] = True
        self.rgb = np.where(board[..., None], np.uint8(40), np.uint8(200)) + np.zeros(3, np.uint8)
        self.true = np.where(board, NEAR, FAR).astype(np.float32)
        wide = np.zeros_like(board)
        wide[8:42, 28:52] = True
        self.blurred = np.where(wide, NEAR, FAR).astype(np.float32)
        self.free = np.ones_like(board)


def test_an_outline_that_is_too_wide_is_drawn_where_the_colour_changes() -> None:
    post = Post()
    found = redrawn(post.blurred, post.rgb, post.free)
    assert (np.abs(post.blurred / post.true - 1) > 0.1).sum() > 200
    assert (np.abs(found / post.true - 1) > 0.1).sum() < 20


def test_what_is_not_free_keeps_its_depth() -> None:
    post = Post()
    post.free[:, :40] = False
    found = redrawn(post.blurred, post.rgb, post.free)
    assert (found[:, :40] == post.blurred[:, :40]).all()
    assert (found[:, 40:] != post.blurred[:, 40:]).any()


def test_without_jumps_nothing_changes() -> None:
    post = Post()
    slope = np.repeat(np.linspace(1 / 40, 1 / 30, WIDTH, dtype=np.float32)[None], HEIGHT, axis=0)
    assert (redrawn(slope, post.rgb, post.free) == slope).all()


def test_pixels_without_depth_keep_none_and_tell_nothing() -> None:
    post = Post()
    sky = np.zeros_like(post.free)
    sky[:10] = True
    post.blurred[sky] = 0
    found = redrawn(post.blurred, post.rgb, post.free)
    assert (found[sky] == 0).all()
    assert found[~sky].min() == pytest.approx(FAR)


def test_held_out_frames_stay_empty() -> None:
    drive = toy.drive([], count=3)
    clip = drive.clip
    view = make_view(clip, drive.posed.cameras, drive.posed.fixed_regions, drive.posed.ground)
    inverse = np.zeros(drive.depth_m.shape, np.float32)
    assert (with_outlines(view, inverse, np.ones(inverse.shape, bool)) == 0).all()


@given(st.lists(st.tuples(st.floats(-5, 5, width=32), st.integers(1, 4)), min_size=1, max_size=9))
def test_the_median_of_whole_weights_is_that_of_repeated_values(pairs: list[tuple[float, int]]) -> None:
    values = np.array([[value] for value, _ in pairs], np.float32)
    weight = np.array([[count] for _, count in pairs], np.float32)
    repeated = np.sort(np.repeat(values[:, 0], [count for _, count in pairs]))
    assert weighted_median(values, weight)[0] == repeated[(len(repeated) - 1) // 2]
