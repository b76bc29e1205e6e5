"""The published metrics against the published programs, sample by sample and table by table."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.tasks.plan import STP3_METRIC, UNIAD_METRIC, Convention, StepScores, raster_scores, summarise
from tests.golden.reading import arrays, values
from tests.tasks.plan.golden import METRIC, TABLES, known, rasters

PUBLISHED = {"uniad": UNIAD_METRIC, "stp3": STP3_METRIC}


def golden_scores(convention: Convention) -> StepScores:
    given = arrays(METRIC)
    return raster_scores(given["pred"], given["gt"], known(), rasters(convention.columns), convention)


@pytest.mark.parametrize("name", PUBLISHED)
def test_golden_samples(name: str) -> None:
    given, scores = arrays(METRIC), golden_scores(PUBLISHED[name])
    np.testing.assert_array_equal(scores.collides, given[f"{name}_per_obj_box_col"] > 0)
    assert scores.point_collides is not None
    np.testing.assert_array_equal(scores.point_collides, given[f"{name}_per_obj_col"] > 0)
    np.testing.assert_allclose(scores.distance_m, given[f"{name}_per_L2"], rtol=1e-6, atol=1e-7)
    assert scores.skipped == 0


def test_golden_steps_that_the_recorded_drive_excuses() -> None:
    truth = golden_scores(UNIAD_METRIC).truth_collides
    np.testing.assert_array_equal(truth, arrays(METRIC)["uniad_gt_box_col"])
    every = golden_scores(replace(UNIAD_METRIC, excuse_truth=False))
    np.testing.assert_array_equal(every.collides & ~truth, golden_scores(UNIAD_METRIC).collides)
    assert (every.collides & truth).any()


def test_golden_means_of_uniad() -> None:
    given, scores = arrays(METRIC), golden_scores(UNIAD_METRIC)
    np.testing.assert_allclose(scores.distance_m.mean(axis=0), given["uniad_L2"], rtol=1e-6)
    np.testing.assert_allclose(scores.collides.mean(axis=0), given["uniad_obj_box_col"], atol=1e-7)
    assert scores.point_collides is not None
    np.testing.assert_allclose(scores.point_collides.mean(axis=0), given["uniad_obj_col"], atol=1e-7)


@pytest.mark.parametrize("complete", [False, True])
def test_golden_tables_of_stp3(complete: bool) -> None:
    wanted = values(TABLES)
    scores = golden_scores(replace(STP3_METRIC, complete_only=complete))
    assert scores.skipped == (~known().all(axis=1)).sum() * complete
    if complete:
        assert scores.distance_m.shape[0] == len(arrays(METRIC)["valid_ids"])
    assert scores.point_collides is not None
    points = summarise(replace(scores, collides=scores.point_collides), "mean")
    for each, point in zip(summarise(scores, "mean").horizons, points.horizons, strict=True):
        key = "stp3_{}_{{}}_{:.0f}s".format("valid" if complete else "all", each.horizon_s)
        assert each.distance_m == pytest.approx(wanted[key.format("L2")], rel=1e-6)
        assert each.collision_rate == pytest.approx(wanted[key.format("obj_box_col")], abs=1e-7)
        assert point.collision_rate == pytest.approx(wanted[key.format("obj_col")], abs=1e-7)


@pytest.mark.parametrize(
    ("name", "convention"), [("uniad", UNIAD_METRIC), ("stp3", replace(STP3_METRIC, masked=True))]
)
def test_golden_tables_of_agent_driver(name: str, convention: Convention) -> None:
    wanted = values(TABLES)
    score = summarise(golden_scores(convention), convention.reading)
    distances = [*(each.distance_m for each in score.horizons), score.distance_m]
    rates = [*(each.collision_rate for each in score.horizons), score.collision_rate]
    assert distances == pytest.approx(wanted[f"agentdriver_{name}_L2"], rel=1e-6)
    assert rates == pytest.approx(wanted[f"agentdriver_{name}_obj_box_col"], abs=1e-7)


def test_golden_distances_of_vad() -> None:
    scores, given = golden_scores(STP3_METRIC), arrays(METRIC)
    complete = given["valid_ids"]
    means = np.stack([scores.distance_m[:, : 2 * k].mean(axis=1) for k in (1, 2, 3)], axis=1)
    np.testing.assert_allclose(means[complete], given["vad_L2_123s"][complete], rtol=1e-5, atol=1e-7)


def one(
    plan: tuple[float, float], cells: list[tuple[int, int]], convention: Convention = UNIAD_METRIC
) -> StepScores:
    """A plan of one waypoint, and a recorded drive far away, among some taken cells."""
    taken = np.zeros((1, 1, 200, 200), np.uint8)
    for cell in cells:
        taken[0, 0][cell] = 1
    truth = np.array([[[-40.0, -40.0]]])
    return raster_scores(np.array([[plan]]), truth, np.ones((1, 1), bool), taken, convention)


@pytest.mark.parametrize(
    ("cell", "hit"),
    [((97, 98), True), ((104, 101), True), ((96, 98), False), ((105, 101), False), ((97, 97), False)],
)
def test_the_car_at_the_origin_has_its_32_cells(cell: tuple[int, int], hit: bool) -> None:
    assert one((0.0, 0.0), [cell]).collides.item() == hit


def test_at_standstill_a_millionth_of_a_metre_moves_the_car_by_a_cell_unless_it_snaps() -> None:
    behind = [(96, 98)]
    assert not one((0.0, 0.0), behind).collides.item()
    assert one((0.0, -1e-6), behind).collides.item()
    assert not one((0.0, -1e-6), behind, replace(UNIAD_METRIC, snap_m=0.01)).collides.item()


def test_columns_count_to_the_right_or_to_the_left() -> None:
    cells = [(110, 120)]
    assert one((10.0, 4.0), cells).collides.item()
    assert not one((-10.0, 4.0), cells).collides.item()
    assert one((-10.0, 4.0), cells, STP3_METRIC).collides.item()
    assert not one((10.0, 4.0), cells, STP3_METRIC).collides.item()


def test_outside_the_grid_the_box_sticks_to_the_border_and_the_point_hits_nothing() -> None:
    scores = one((0.0, 90.0), [(199, 99)])
    assert scores.collides.item()
    assert scores.point_collides is not None
    assert not scores.point_collides.item()


def test_the_point_test_looks_up_one_cell() -> None:
    hit = one((10.0, 4.0), [(107, 119)])
    assert hit.point_collides is not None
    assert hit.point_collides.item()


def test_plans_are_left_as_they_are() -> None:
    given = arrays(METRIC)
    before = given["pred"].copy(), given["gt"].copy()
    raster_scores(given["pred"], given["gt"], known(), rasters("left"), STP3_METRIC)
    np.testing.assert_array_equal(given["pred"], before[0])
    np.testing.assert_array_equal(given["gt"], before[1])


def test_steps_after_the_end_are_0_or_compared_with_the_origin() -> None:
    taken = np.zeros((1, 2, 200, 200), np.uint8)
    plan, truth = np.array([[[0.0, 3.0], [0.0, 4.0]]]), np.array([[[0.0, 2.0], [np.nan, np.nan]]])
    there = np.array([[True, False]])
    for convention, wanted in ((UNIAD_METRIC, [1.0, 0.0]), (STP3_METRIC, [1.0, 4.0])):
        assert raster_scores(plan, truth, there, taken, convention).distance_m[0].tolist() == wanted
    complete = replace(STP3_METRIC, complete_only=True)
    assert raster_scores(plan, truth, there, taken, complete).skipped == 1


def test_a_snap_below_0_is_refused() -> None:
    with pytest.raises(InputError, match="snap_m"):
        Convention("left", snap_m=-1.0)
