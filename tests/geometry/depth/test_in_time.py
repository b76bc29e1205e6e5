"""Depth maps of neighbours settle what stands still."""

import numpy as np

from dreamdrive.geometry.depth import make_view, settled_in_time
from tests.geometry import toy


class Maps:
    """True inverse depth of the toy street, with its view."""

    def __init__(self) -> None:
        self.street = toy.drive([], count=7)
        posed = self.street.posed
        self.view = make_view(self.street.clip, posed.cameras, posed.fixed_regions, posed.ground)
        depth = self.street.depth_m
        self.inverse = np.where(depth > 0, 1 / np.maximum(depth, 0.1), 0).astype(np.float32)
        self.spread = np.where(self.inverse > 0, 0.1, 0).astype(np.float32)
        self.near = (depth[3] > 5) & (depth[3] < 25)

    def off(self, inverse: np.ndarray) -> float:
        """Median relative error in the middle frame."""
        return float(np.median(np.abs(inverse[3] / np.where(self.near, self.inverse[3], 1) - 1)[self.near]))

    def settled(self, inverse: np.ndarray, still: np.ndarray) -> np.ndarray:
        return settled_in_time(self.view, inverse, self.spread, still)


def test_right_maps_stay_as_they_are() -> None:
    maps = Maps()
    assert maps.off(maps.settled(maps.inverse, maps.inverse > 0)) < 0.01


def test_one_wrong_map_is_outvoted() -> None:
    maps = Maps()
    wrong = maps.inverse.copy()
    wrong[3] *= 1.2
    assert maps.off(maps.settled(wrong, wrong > 0)) < 0.03
    assert maps.off(wrong) > 0.15


def test_surer_maps_decide() -> None:
    maps = Maps()
    wrong = maps.inverse * np.float32(1.2)
    wrong[4] = maps.inverse[4]
    maps.spread[4] = np.where(maps.spread[4] > 0, 0.01, 0)
    assert maps.off(maps.settled(wrong, wrong > 0)) < 0.06


def test_what_moves_is_left_alone() -> None:
    maps = Maps()
    wrong = maps.inverse.copy()
    wrong[3] *= 1.2
    nothing = np.zeros(wrong.shape, bool)
    assert np.array_equal(maps.settled(wrong, nothing), wrong)
