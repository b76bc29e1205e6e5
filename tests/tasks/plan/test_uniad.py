"""The optimisation of plans against UniAD's own program, and what it does to a car beside one."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from dreamdrive.tasks.plan import (
    AGENT_DRIVER,
    CONDITIONAL,
    GRID,
    UNIAD,
    CollisionOptions,
    Occupancy,
    Surroundings,
    cost_of,
    covered,
    minimise,
    optimise_as_uniad,
    slopes_of,
    surroundings,
)
from tests.golden.reading import arrays
from tests.tasks.plan.golden import OPTIMISED, occupied

STRAIGHT = np.stack([np.zeros(6), 4.0 * np.arange(1, 7)], axis=1)[None]


def golden_options(case: int) -> CollisionOptions:
    given_ = arrays(OPTIMISED)
    return replace(
        UNIAD,
        sigma_m=float(given_["sigma"][case]),
        alpha=float(given_["alpha"][case]),
        radius_m=float(given_["rng"][case]),
    )


def test_golden_plans() -> None:
    given_ = arrays(OPTIMISED)
    for case, occupancy in enumerate(occupied()):
        plan = given_["traj"][case : case + 1].astype(np.float64)
        made = optimise_as_uniad(plan, [occupancy], golden_options(case))
        assert made.points[0].tolist() == given_["npts"][case].tolist()
        np.testing.assert_allclose(made.waypoints_m[0], given_["out"][case], rtol=0, atol=2e-6)
        assert made.cost_before[0] == pytest.approx(given_["cost0"][case], abs=1e-9)
        assert made.cost_after[0] == pytest.approx(given_["cost1"][case], abs=1e-6)


def test_golden_points() -> None:
    given_ = arrays(OPTIMISED)
    plans = given_["traj"].astype(np.float64)
    found = [
        surroundings(plan[None], [occupancy], golden_options(case)).places_m
        for case, (plan, occupancy) in enumerate(zip(plans, occupied(), strict=True))
    ]
    np.testing.assert_array_equal(np.concatenate(found), given_["points"])


def test_golden_presets_are_the_values_of_the_goldens() -> None:
    given_ = arrays(OPTIMISED)
    presets = {(each.sigma_m, each.alpha, each.radius_m) for each in (UNIAD, AGENT_DRIVER)}
    assert presets == set(zip(given_["sigma"], given_["alpha"], given_["rng"], strict=True))


def test_golden_plans_together_are_the_same() -> None:
    plans = arrays(OPTIMISED)["traj"].astype(np.float64)
    together = optimise_as_uniad(plans, occupied(), UNIAD)
    for case, occupancy in enumerate(occupied()):
        alone = optimise_as_uniad(plans[case : case + 1], [occupancy], UNIAD)
        np.testing.assert_allclose(together.waypoints_m[case], alone.waypoints_m[0], atol=1e-9)
        np.testing.assert_array_equal(together.hits[case], alone.hits[0])


def traffic(seed: int, waypoints: int = 40) -> tuple[np.ndarray, Surroundings]:
    """Waypoints among patches of cells."""
    rng = np.random.default_rng(seed)
    reference = rng.uniform(-3, 3, (waypoints, 2))
    patch = 0.5 * np.argwhere(np.ones((9, 4))) - [2.0, 0.75]
    places = [patch + rng.uniform(-4, 4, 2) for _ in range(2 * waypoints)]
    return reference, Surroundings(np.concatenate(places), np.repeat(np.arange(waypoints), 2 * len(patch)))


@settings(max_examples=30)
@given(st.integers(0, 10_000), st.sampled_from([CONDITIONAL, AGENT_DRIVER, CollisionOptions(0.5, 50.0)]))
def test_it_ends_in_a_hollow_below_where_it_began(seed: int, options: CollisionOptions) -> None:
    reference, near = traffic(seed)
    found = minimise(reference, near, options)
    gradient, hessian = slopes_of(found, reference, near, options)
    assert np.abs(gradient).max() < 1e-8 * (1 + options.weight)
    assert np.linalg.eigvalsh(hessian).min() > 0
    before, after = (cost_of(each, reference, near, options) for each in (reference, found))
    assert (after <= before + 1e-12).all()


def test_most_waypoints_end_where_steepest_descent_ends() -> None:
    reference, near = traffic(1, 100)
    slow = reference.copy()
    for _ in range(800):
        gradient, _ = slopes_of(slow, reference, near, CONDITIONAL)
        length = np.linalg.norm(gradient, axis=1, keepdims=True)
        slow -= np.minimum(0.02, 0.1 / np.maximum(length, 1e-9)) * gradient
    apart = np.linalg.norm(slow - minimise(reference, near, CONDITIONAL), axis=1)
    assert (apart < 0.05).mean() > 0.97


@pytest.mark.parametrize(
    ("options", "cell_m", "gap_m", "push_m"),
    [
        (CONDITIONAL, 0.5, 1.0, 0.55),
        (CONDITIONAL, 0.5, 2.0, 0.12),
        (CONDITIONAL, 0.5, 3.0, 0.01),
        (CONDITIONAL, 0.25, 1.0, 0.91),
        (CONDITIONAL, 0.1, 1.0, 1.31),
        (AGENT_DRIVER, 0.5, 1.0, 1.06),
    ],
)
def test_the_push_of_a_car_beside(
    options: CollisionOptions, cell_m: float, gap_m: float, push_m: float
) -> None:
    """Tuned for one point in a cell of 0.5 m; more push harder. The gap is between the sides of two cars."""
    side = gap_m + options.footprint.width_m / 2
    across, along = np.meshgrid(
        np.arange(cell_m / 2, 1.9, cell_m), np.arange(cell_m / 2 - 2.25, 2.25, cell_m)
    )
    points = np.stack([across + side, along], axis=-1).reshape(-1, 2)
    near = Surroundings(points, np.zeros(len(points), int))
    moved = minimise(np.zeros((1, 2)), near, options)
    assert -moved[0, 0] == pytest.approx(push_m, abs=0.08)


def beside(x_m: float) -> Occupancy:
    """A standing car 12 m ahead."""
    taken = np.zeros((1, 200, 200), bool)
    column = int(x_m / 0.5) + 100
    taken[0, 120:129, column : column + 4] = True
    return Occupancy(taken)


def test_only_plans_that_hit_are_moved() -> None:
    near, clear = beside(0.5), beside(2.5)
    made = optimise_as_uniad(np.repeat(STRAIGHT, 2, axis=0), [near, clear], CONDITIONAL)
    assert made.chosen.tolist() == [True, False]
    assert made.hits[0].tolist() == [False, True, True, True, False, False]
    assert made.waypoints_m[0, 2, 0] < -0.5
    np.testing.assert_array_equal(made.waypoints_m[1], STRAIGHT[0])
    assert made.points[1].sum() > 0
    assert made.cost_after[1] == made.cost_before[1]
    always = optimise_as_uniad(STRAIGHT, [clear], replace(CONDITIONAL, always=True))
    assert always.chosen.all()
    assert always.waypoints_m[0, 2, 0] < -0.02


def test_the_margin_decides_what_is_a_hit() -> None:
    points = beside(1.0)
    assert not covered(STRAIGHT, [points], CONDITIONAL.footprint, 0.3).any()
    assert covered(STRAIGHT, [points], CONDITIONAL.footprint, 0.4).any()


def test_nothing_taken_leaves_a_plan_as_it_is() -> None:
    empty = Occupancy(np.zeros((1, 200, 200), bool))
    made = optimise_as_uniad(STRAIGHT, [empty], UNIAD)
    np.testing.assert_array_equal(made.waypoints_m, STRAIGHT)
    assert made.points.sum() == 0
    assert made.cost_after.tolist() == [0.0]


def test_a_waypoint_on_an_axis_of_symmetry_stays_on_it() -> None:
    taken = np.zeros((1, 200, 200), bool)
    taken[0, 122:126, 98:102] = True
    made = optimise_as_uniad(STRAIGHT, [Occupancy(taken)], replace(UNIAD, whole_metres=False))
    np.testing.assert_allclose(made.waypoints_m[0, :, 0], 0, atol=1e-12)
    assert np.abs(made.waypoints_m - STRAIGHT).max() > 0.05


def test_whole_metres_move_points_towards_the_car() -> None:
    centres, cut = (
        surroundings(STRAIGHT, [beside(1.5)], replace(CONDITIONAL, whole_metres=whole)).places_m
        for whole in (False, True)
    )
    assert set(centres[:, 0].tolist()) == {1.75, 2.25, 2.75, 3.25}
    assert set(cut[:, 0].tolist()) == {1.0, 2.0, 3.0}


def test_plans_and_surroundings_must_be_as_many() -> None:
    with pytest.raises(ValueError, match="expected one for each"):
        optimise_as_uniad(STRAIGHT, [beside(1.0), beside(2.0)])


def test_waypoints_outside_the_grid_stay() -> None:
    far = STRAIGHT * [1, 20]
    taken = Occupancy(np.ones((1, GRID.cells, GRID.cells), bool))
    made = optimise_as_uniad(far, [taken], UNIAD)
    np.testing.assert_array_equal(made.waypoints_m[0, 1:], far[0, 1:])
