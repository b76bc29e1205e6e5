"""What the benchmark of the splat computes beside times."""

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from tests.conftest import ROOT

from dreamdrive.splat import rasterize

WIDTH, HEIGHT, COUNT = 96, 60, 1500


@pytest.fixture(autouse=True)
def benchmarks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "benchmarks")


@pytest.fixture
def programs() -> ModuleType:
    import _programs

    if _programs.compiler() is None:
        pytest.skip("no C++ compiler")
    return _programs


@pytest.fixture
def street() -> dict[str, np.ndarray]:
    from _street_scenes import stand_in

    return stand_in(WIDTH, HEIGHT, COUNT)


def test_the_float64_walk_renders_what_the_library_renders(programs, street):
    from _passes import view_of

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
    import _peer

    quarter = _peer.PEAKS | {"fma_gflops_per_core": _peer.PEAKS["fma_gflops_per_core"] / 4}
    assert _peer.slowdown(_peer.PEAKS) == pytest.approx(1)
    assert _peer.slowdown(quarter) == pytest.approx(2)
    row = _peer.compare("b", (30.8, 50.9), quarter)
    assert row["ratio"] == pytest.approx((10, 10))
    assert row["scaled_ratio"] == pytest.approx((20, 20))


def test_a_section_is_replaced_and_the_rest_kept(tmp_path: Path):
    from _markdown import replace_section

    file = tmp_path / "page.md"
    file.write_text("before\n<!-- x: begin -->\nold\n<!-- x: end -->\nafter\n")
    replace_section(file, "x", "new \\1\n")
    assert file.read_text() == "before\n<!-- x: begin -->\nnew \\1\n<!-- x: end -->\nafter\n"
    with pytest.raises(SystemExit, match="has no lines <!-- y: begin -->"):
        replace_section(file, "y", "new")
