"""Pictures for the network and answers back on pixels."""

import numpy as np
import pytest
import torch
from hypothesis import given, strategies as st

from dreamdrive.street_network.resize import ResizePad, within_regions


@given(st.integers(16, 2000), st.integers(16, 2000), st.sampled_from([32, 256, 480, 512]))
def test_every_size_fits(width: int, height: int, across: int) -> None:
    resize = ResizePad.choose(width, height, across)
    whole = resize.down_px + resize.above_px + resize.below_px
    assert whole % 32 == 0
    assert whole - resize.down_px < 32
    assert resize.above_px % 8 == 0
    assert abs(resize.down_px - across * height / width) <= 2 or resize.down_px == 4


@pytest.mark.parametrize("size", [(480, 270), (512, 288), (640, 193)])
def test_answers_lie_on_their_pixels(size: tuple[int, int]) -> None:
    resize = ResizePad.choose(*size, 512)
    rows = np.linspace(0, 255, size[1]).round().astype(np.uint8)
    frame = np.broadcast_to(rows[:, None, None], (size[1], size[0], 3))
    taken = resize.taken(frame[None])
    assert taken.shape[2] % 32 == 0
    for stride in (2, 4):
        answers = torch.nn.functional.avg_pool2d(taken[0], stride)
        back = resize.on_pixels(answers)[0, :, 5] * 255
        assert np.abs(back.numpy()[4:-4] - rows[4:-4]).max() < 2


def test_within_a_region_no_other_counts() -> None:
    region = torch.zeros(8, 8, dtype=torch.int64)
    region[:, 3:] = 1  # the border lies inside a coarse cell
    values = torch.tensor([[1.0, 9.0, 5.0, 5.0]]).expand(4, 4)[None]
    weight = torch.ones(4, 4)
    weight[:, 1] = 1e-3  # a mixed cell, which says so itself
    found = within_regions(values, weight, region)[0]
    assert torch.allclose(found[:, :3], torch.tensor(1.0))
    assert torch.allclose(found[:, 4:], torch.tensor(5.0), atol=0.02)


def test_smooth_values_stay_smooth() -> None:
    values = torch.arange(6.0)[None, None].expand(1, 4, 6)
    found = within_regions(values, torch.ones(4, 6), torch.zeros(8, 12, dtype=torch.int64))[0]
    bilinear = torch.nn.functional.interpolate(values[None], (8, 12), mode="bilinear")[0, 0]
    assert torch.allclose(found, bilinear, atol=1e-5)


def test_what_is_thinner_than_a_cell_takes_the_nearest() -> None:
    region = torch.zeros(8, 8, dtype=torch.int64)
    region[:, 4] = 1  # no cell's middle lies on it
    region[:, 5] = 0
    values = torch.tensor([[1.0, 2.0, 3.0, 4.0]]).expand(4, 4)[None]
    found = within_regions(values, torch.ones(4, 4), region)[0]
    assert set(found[:, 4].tolist()) == {3.0}
