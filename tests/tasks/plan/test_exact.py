"""Exact collisions against a published program with polygons, and against polygons of our own."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings, strategies as st

from dreamdrive.tasks.plan import (
    CAR,
    Agents,
    ExactOptions,
    collisions,
    corners,
    exact_scores,
    headings,
    summarise,
)
from tests.golden.reading import arrays
from tests.tasks.plan.golden import METRIC, agents, known


def test_golden_collisions_of_polygons() -> None:
    given_ = arrays(METRIC)
    plans, truth = (collisions(given_[name].astype(np.float64), agents()) for name in ("pred", "gt"))
    np.testing.assert_array_equal(truth, given_["polygon_gt_col"] > 0)
    np.testing.assert_array_equal(plans & ~truth, given_["polygon_per_box_col"] > 0)


def test_golden_scores_leave_out_what_ends_early() -> None:
    given_ = arrays(METRIC)
    complete = given_["valid_ids"]
    whole = given_["pred"], given_["gt"], known(), agents()
    scores = exact_scores(*whole)
    assert scores.skipped == len(known()) - len(complete)
    np.testing.assert_array_equal(scores.truth_collides, given_["polygon_gt_col"][complete] > 0)
    excused = exact_scores(*whole, ExactOptions(excuse_truth=True))
    np.testing.assert_array_equal(excused.collides, given_["polygon_per_box_col"][complete] > 0)
    assert scores.collides.sum() > excused.collides.sum()
    figures = summarise(scores, "any").horizons
    hits = [int(scores.collides[:, :step].any(axis=1).sum()) for step in (2, 4, 6)]
    assert [each.collisions for each in figures] == hits
    assert {each.cases for each in figures} == {len(complete)}


def placed(*boxes: tuple[float, float, float, float, float], steps: int = 1) -> Agents:
    rows = np.tile(np.array(boxes, np.float64).reshape(1, -1, 5), (steps, 1, 1))
    count = rows.shape[1]
    return Agents(rows, np.ones((steps, count), bool), ("vehicle.car",) * count, np.ones(count, bool))


def test_the_heading_counts() -> None:
    """A car that turns right covers other ground than one that goes straight, at the same place."""
    around = placed((4.3, 4.3, 0.3, 0.3, 0.0), steps=3)
    turned = np.array([[[1.0, 1.0], [3.0, 3.0], [5.0, 5.0]]])
    straight = np.array([[[3.0, -3.0], [3.0, 3.0], [3.0, 9.0]]])
    assert collisions(turned, [around])[0, 1]
    assert not collisions(straight, [around])[0, 1]


def test_who_is_not_there_is_not_hit() -> None:
    around = placed((0.0, 5.0, 4.0, 2.0, 0.0))
    gone = Agents(around.boxes, np.zeros((1, 1), bool), around.categories, around.seen)
    plan = np.array([[[0.0, 4.0]]])
    assert collisions(plan, [around]).item()
    assert not collisions(plan, [gone]).item()
    assert not collisions(plan, [placed()]).item()


@settings(max_examples=50)
@given(st.integers(0, 100_000))
def test_collisions_are_those_of_polygons_one_by_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    plan = np.cumsum(rng.normal([0, 2], [0.7, 1.5], (6, 2)), axis=0)
    boxes = rng.uniform([-5, -2, 0.4, 0.4, -np.pi], [5, 15, 6, 2.5, np.pi], (6, 5, 5))
    there = rng.random((6, 5)) < 0.7
    around = Agents(boxes, there, ("vehicle.car",) * 5, np.ones(5, bool))
    found, yaws = collisions(plan[None], [around])[0], headings(plan)
    for step, ((x, y), yaw) in enumerate(zip(plan, yaws, strict=True)):
        turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        outline = np.array([[2.542, 0.925], [2.542, -0.925], [-1.542, -0.925], [-1.542, 0.925]])
        car = shapely.Polygon(outline @ turn.T + [x, y])
        others = [shapely.Polygon(corners(box)) for box in boxes[step][there[step]]]
        assert found[step] == any(car.intersects(other) for other in others)


def test_the_car_is_4_metres_long() -> None:
    touching = placed((0.0, 2.542 + 0.5, 1.0, 1.0, 0.0))
    apart = placed((0.0, 2.542 + 0.501, 1.0, 1.0, 0.0))
    still = np.zeros((1, 1, 2))
    assert collisions(still, [touching], CAR).item()
    assert not collisions(still, [apart], CAR).item()


def test_plans_and_road_users_must_be_as_many() -> None:
    with pytest.raises(ValueError, match="expected one for each"):
        exact_scores(np.zeros((2, 1, 2)), np.zeros((2, 1, 2)), np.ones((2, 1), bool), [placed()])
