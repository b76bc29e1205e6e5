"""What the benchmark of the splat computes beside times."""

from types import ModuleType

import numpy as np
import pytest

from dreamdrive.splat import rasterize
from dreamdrive_bench.splat import peer, programs as splat_programs
from dreamdrive_bench.splat.passes import view_of
from dreamdrive_bench.splat.streets import stand_in

WIDTH, HEIGHT, COUNT = 96, 60, 1500


@pytest.fixture
def programs() -> ModuleType:
    if splat_programs.compiler() is None:
        pytest.skip("no C++ compiler")
    return splat_programs


@pytest.fixture
def street() -> dict[str, np.ndarray]:
    return stand_in(WIDTH, HEIGHT, COUNT)


def test_the_float64_walk_renders_what_the_library_renders(programs, street):
    view = view_of(street)
    ours = rasterize(**view.tensors, **view.camera).colour.numpy()
    _, image = programs.walk(street, 8)
    difference = np.abs(image - ours)
    assert difference.max() < 1 / 255  # what one Gaussian at the limit of alpha may add
    assert difference.mean() < 1e-6


def test_work_does_not_depend_on_lanes_but_rows_do(programs, street):
    counts = {lanes: programs.walk(street, lanes)[0] for lanes in (1, 4, 16)}
    for key in ("in_view", "entries", "reached", "pairs"):
        assert len({count[key] for count in counts.values()}) == 1
    assert 0 < counts[1]["in_view"] <= COUNT
    # Rows of one lane are pixels: all contribute but those at which a pixel stops.
    assert 0 <= counts[1]["rows"] - counts[1]["pairs"] <= WIDTH * HEIGHT
    assert counts[16]["rows"] < counts[4]["rows"] < counts[1]["rows"] < 16 * counts[16]["rows"]
    assert counts[4]["rows"] <= counts[4]["boxed_rows"]


def test_the_peer_is_scaled_by_the_mean_of_the_ratios_of_peaks():
    quarter = peer.PEAKS | {"fma_gflops_per_core": peer.PEAKS["fma_gflops_per_core"] / 4}
    assert peer.slowdown(peer.PEAKS) == pytest.approx(1)
    assert peer.slowdown(quarter) == pytest.approx(2)
    row = peer.compare("b", (30.8, 50.9), quarter)
    assert row["ratio"] == pytest.approx((10, 10))
    assert row["scaled_ratio"] == pytest.approx((20, 20))
