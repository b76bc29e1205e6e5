"""The cost and its slopes, against sums written out and finite differences."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dreamdrive.errors import InputError
from dreamdrive.tasks.plan import AGENT_DRIVER, CollisionOptions, Surroundings, cost_of, slopes_of

options = st.builds(CollisionOptions, st.floats(0.3, 2), st.floats(0, 10))
STEP_M = 1e-4


def case(seed: int, waypoints: int = 4, points: int = 30) -> tuple[np.ndarray, np.ndarray, Surroundings]:
    rng = np.random.default_rng(seed)
    reference = rng.normal(0, 5, (waypoints, 2))
    owner = np.sort(rng.integers(0, waypoints - 1, points))  # the last has none
    return (
        reference + rng.normal(0, 0.5, reference.shape),
        reference,
        Surroundings(reference[owner] + rng.normal(0, 1.5, (points, 2)), owner),
    )


@given(st.integers(0, 1000), options)
def test_the_cost_is_the_published_sum(seed: int, chosen: CollisionOptions) -> None:
    waypoints, reference, near = case(seed)
    for k, (p, r) in enumerate(zip(waypoints, reference, strict=True)):
        own = near.places_m[near.waypoint == k]
        pushes = sum(np.exp(-((p - o) ** 2).sum() / 2 / chosen.sigma_m**2) for o in own)
        wanted = ((p - r) ** 2).sum() + chosen.alpha / (2.507 * chosen.sigma_m) * pushes
        assert cost_of(waypoints, reference, near, chosen)[k] == pytest.approx(wanted)


@given(st.integers(0, 1000), options)
def test_slopes_are_those_of_finite_differences(seed: int, chosen: CollisionOptions) -> None:
    waypoints, reference, near = case(seed)
    gradient, hessian = slopes_of(waypoints, reference, near, chosen)
    for axis in range(2):
        step = STEP_M * np.eye(2)[axis]
        costs = [cost_of(waypoints + way, reference, near, chosen) for way in (step, -step)]
        scale = 1 + chosen.weight / chosen.sigma_m**3
        np.testing.assert_allclose(
            gradient[:, axis], (costs[0] - costs[1]) / (2 * STEP_M), atol=1e-6 * scale * 30
        )
        slopes = [slopes_of(waypoints + way, reference, near, chosen)[0] for way in (step, -step)]
        scale = 1 + chosen.weight / chosen.sigma_m**4
        np.testing.assert_allclose(
            hessian[:, axis], (slopes[0] - slopes[1]) / (2 * STEP_M), atol=1e-6 * scale * 30
        )


def test_points_of_some_waypoints_are_counted_anew() -> None:
    _, _, near = case(0)
    some = near.of(np.array([False, True, False, True]))
    np.testing.assert_array_equal(some.places_m, near.places_m[near.waypoint == 1])
    assert some.counts(2).tolist() == [int((near.waypoint == 1).sum()), 0]


def test_without_points_the_cost_is_the_way() -> None:
    none = Surroundings(np.zeros((0, 2)), np.zeros(0, int))
    assert cost_of(np.array([[3.0, 4.0]]), np.zeros((1, 2)), none, AGENT_DRIVER).tolist() == [25.0]


@pytest.mark.parametrize(
    "wrong", [{"sigma_m": 0.0}, {"alpha": -1.0}, {"radius_m": float("nan")}, {"margin_m": -0.1}]
)
def test_options_without_sense_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match="expected"):
        CollisionOptions(**wrong)  # pyright: ignore[reportArgumentType]
