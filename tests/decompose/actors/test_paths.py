"""Which paths a thing can have."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.decompose.actors import paths
from dreamdrive.decompose.actors.observations import Carried, Observations, Placement, PlacingOptions
from dreamdrive.decompose.actors.paths import Path, find_path
from tests.streets import bare_street, street_clip, true_geometry

COUNT = 20


def path_of(step_m: float, options: PlacingOptions | None = None) -> Path | None:
    """The path of a cloud of points straight ahead that goes so far from frame to frame."""
    street = bare_street()
    frames = np.arange(len(street.frames))
    cloud = np.random.default_rng(0).uniform(-0.5, 0.5, (COUNT, 3))
    middle_m = street.cameras[0].world_from_camera[:3, 3]
    shown = [
        street.cameras[k].project(middle_m + cloud + np.array([0, 0.5, 15 + k * step_m])) for k in frames
    ]
    return find_path(
        street_clip(street), true_geometry(street), frames, shown, options or PlacingOptions(), 4.5
    )


def test_what_drives_has_a_path() -> None:
    path = path_of(1.2)
    assert path is not None
    gone_m = path.placement.place_m[-1] - path.placement.place_m[0]
    assert gone_m[2] == pytest.approx(4 * 1.2, abs=1.0)


def test_what_leaps_has_none() -> None:
    assert path_of(25.0) is None
    assert path_of(25.0, PlacingOptions(most_m_s=1e4, most_spread_m=1e4)) is not None


def test_what_is_nowhere_sure_has_none() -> None:
    assert path_of(1.2, PlacingOptions(most_spread_m=1e-3)) is None


def test_a_path_that_points_carry_away_is_not_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is carried wrongly may send a thing anywhere; then the path is that by depth alone."""
    by_depth = paths.placed

    def placed(
        seen: Observations, carried: Sequence[Carried], up: np.ndarray, options: PlacingOptions
    ) -> Placement:
        found = by_depth(seen, (), up, options)
        return replace(found, spread_m=found.spread_m + 1e3) if carried else found

    wanted = path_of(1.2, PlacingOptions(samples=1))  # too few points to carry any
    monkeypatch.setattr(paths, "placed", placed)
    found = path_of(1.2)
    assert wanted is not None
    assert found is not None
    np.testing.assert_allclose(found.placement.place_m, wanted.placement.place_m)
