"""The sweep on another device finds what the core finds, and brings it back at once."""

import numpy as np
import pytest
import torch

from dreamdrive.compute.device import CPU
from dreamdrive.geometry.depth import make_view, smoothing, sweep_frames, sweep_frames_on
from dreamdrive.geometry.depth.sweep_elsewhere import best_labels
from tests.fit.pretended import copies_to_the_cpu, pretending
from tests.streets import small_street, street_clip, true_geometry


@pytest.fixture(scope="module")
def view():
    street = small_street(size=(96, 64), frames=6)
    clip, geometry = street_clip(street, hold_out=4), true_geometry(street)
    usable = np.zeros(geometry.fixed_regions.shape[1:], np.int64)
    usable[-5:] = 1
    return make_view(clip, geometry.cameras, usable, geometry.ground)


def test_depth_is_that_of_the_core(view) -> None:
    sky = np.zeros(view.grey.shape, bool)
    sky[:, :10] = True
    here, there = sweep_frames(view, sky), sweep_frames_on(view, sky, CPU)
    assert here.keys() == there.keys()
    for frame, expected in here.items():
        found = there[frame]
        assert expected is not None
        assert found is not None
        # On a tie, or where a source ends, one label or another wins by rounding.
        same = np.abs(found.inverse_depth - expected.inverse_depth) < 1e-4
        assert same.mean() > 0.98
        assert (found.on_plane == expected.on_plane).mean() > 0.98
        assert np.abs(found.correlation - expected.correlation)[same].mean() < 2e-3


def test_one_copy_brings_the_depth_of_all_frames(view, monkeypatch: pytest.MonkeyPatch) -> None:
    sky = np.zeros(view.grey.shape, bool)
    here = sweep_frames_on(view, sky, CPU)
    copies = copies_to_the_cpu(monkeypatch)
    with pretending() as device:
        there = sweep_frames_on(view, sky, device)
    assert copies == [(len(view.frames), 3, *view.grey.shape[1:])]
    for frame, expected in here.items():
        assert np.array_equal(there[frame].inverse_depth, expected.inverse_depth)


def test_a_frame_without_sources_has_no_depth(view) -> None:
    used = np.zeros_like(view.used)
    used[2] = True
    alone = type(view)(**{**vars(view), "used": used})
    assert sweep_frames_on(alone, np.zeros(view.grey.shape, bool), CPU) == {2: None}


def test_labels_are_those_of_the_core() -> None:
    random = np.random.default_rng(0)
    grey = random.uniform(0, 255, (2, 13, 17)).astype(np.float32)
    cost = random.uniform(0, 1, (2, 9, 13, 17)).astype(np.float32)
    found = best_labels(torch.from_numpy(cost), torch.from_numpy(grey)).numpy()
    for k in range(2):
        work = smoothing.CostBuffers(13, 9, 17)
        work.cost[:] = cost[k].transpose(1, 0, 2)
        np.testing.assert_allclose(found[k], smoothing.best_label(work, grey[k]), atol=1e-3)
