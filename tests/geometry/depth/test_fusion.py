"""One depth from stereo, the road and the street network."""

import numpy as np
import pytest

from dreamdrive.geometry.depth import make_view
from dreamdrive.geometry.depth.fusion import Fused, NetworkDepth, RoadDepth, fuse, with_stereo
from dreamdrive.geometry.options import FusionOptions
from dreamdrive.scene.street.street_class import StreetClass
from tests.geometry import toy

HEIGHT, WIDTH, HORIZON = 60, 96, 20


class Street:
    """A wall 20 m away above a road, a car on it; the network is off by a factor that bends across."""

    def __init__(self) -> None:
        rows = np.arange(HEIGHT)[:, None] + 0.5 - HORIZON
        self.plane = np.repeat(np.maximum(rows, 0) / 150, WIDTH, axis=1).astype(np.float32)
        self.inverse = np.maximum(self.plane, 1 / 20).astype(np.float32)
        self.classes = np.full((HEIGHT, WIDTH), StreetClass.STRUCTURE, np.uint8)
        self.classes[self.plane > 1 / 20] = StreetClass.ROAD
        self.classes[:6] = StreetClass.SKY
        self.instances = np.zeros((HEIGHT, WIDTH), np.uint16)
        self.instances[25:45, 40:60] = 1
        self.classes[self.instances == 1] = StreetClass.VEHICLE
        self.inverse[self.instances == 1] = self.plane[45, 0]
        bend = np.exp(np.linspace(-0.2, 0.3, WIDTH))[None]
        self.network = np.where(self.classes > 0, 0.4 / self.inverse * bend, 0).astype(np.float32)
        self.confidence = np.zeros((HEIGHT, WIDTH), np.float32)

    def fused(self, swept: np.ndarray | None = None, plane: RoadDepth | None = None) -> Fused:
        spread = np.full((HEIGHT, WIDTH), 0.2, np.float32)
        seen = NetworkDepth(self.network, spread, self.classes, self.instances)
        usable = np.ones((HEIGHT, WIDTH), bool)
        swept = self.inverse if swept is None else swept
        return fuse(seen, swept, self.confidence, plane or RoadDepth(self.plane), usable, FusionOptions())

    def off(self, found: Fused, where: np.ndarray) -> float:
        """Largest relative error of depth."""
        return float(np.abs(self.inverse[where] / found.inverse[where] - 1).max())


def test_the_road_and_sure_stereo_are_believed() -> None:
    street = Street()
    street.confidence[:, :30] = 0.9
    found = street.fused()
    assert street.off(found, street.classes == StreetClass.ROAD) < 0.02
    assert street.off(found, (street.confidence > 0) & (street.classes > 0)) < 0.02
    assert (found.inverse[street.classes == StreetClass.SKY] == 0).all()


def test_the_network_takes_its_scale_from_what_is_sure_nearby() -> None:
    street = Street()
    wall = street.classes == StreetClass.STRUCTURE
    street.confidence[wall & (np.arange(WIDTH) % 16 == 0)] = 0.9
    found = street.fused()
    unsure = wall & (street.confidence == 0) & (np.arange(WIDTH) <= 80)  # with sure pixels on both sides
    assert street.off(found, unsure) < 0.12
    assert found.spread[unsure].min() > found.spread[street.confidence > 0].max()


def test_stereo_that_contradicts_its_surroundings_is_not_believed() -> None:
    street = Street()
    wall = street.classes == StreetClass.STRUCTURE
    street.confidence[wall & (np.arange(WIDTH) % 8 == 0)] = 0.9
    wrong = street.inverse.copy()
    hole = np.zeros_like(wall)
    hole[10:14, 20:30] = True
    wrong[hole] = 1 / 4
    street.confidence[hole] = 0.3
    assert street.off(street.fused(wrong), hole) < 0.15


def test_of_what_is_far_sure_parallax_is_believed() -> None:
    street = Street()
    tower = np.zeros((HEIGHT, WIDTH), bool)
    tower[8:16, 40:50] = True
    street.confidence[(street.classes == StreetClass.STRUCTURE) & ~tower] = 0.9
    street.confidence[tower] = 0.9
    swept = np.where(tower, 1 / 140, street.inverse).astype(np.float32)
    assert (street.fused(swept).inverse[tower] > 1 / 30).all()  # the network sees the wall at 20 m
    street.network *= np.where(tower, 2.2, 1)
    assert np.allclose(street.fused(swept).inverse[tower], 1 / 140, rtol=1e-3)


def test_a_car_has_the_depth_of_its_contact_whatever_stereo_says() -> None:
    street = Street()
    street.confidence[:] = 0.9
    wrong = street.inverse.copy()
    wrong[street.instances == 1] = 1 / 60
    assert street.off(street.fused(wrong), street.instances == 1) < 0.12  # with its bumper nearer


@pytest.mark.parametrize("sure", [0.0, 0.9])
def test_maps_are_finite_and_positive_where_something_is_seen(sure: float) -> None:
    street = Street()
    street.confidence[:] = sure
    found = street.fused()
    shown = street.classes != StreetClass.SKY
    for each in (found.inverse, found.spread, found.confidence):
        assert np.isfinite(each).all()
        assert (each[shown] > 0).all()
        assert (each[~shown] == 0).all()


def test_a_road_of_unsure_tilt_is_believed_nearby_only() -> None:
    """The horizon is 3 pixels too low: 8 % of the depth at the lower border, two thirds at the wall."""
    street = Street()
    street.network = np.where(street.classes > 0, 0.4 / street.inverse, 0).astype(np.float32)
    rows = np.arange(HEIGHT)[:, None] + 0.5 - HORIZON - 3
    tilted = np.repeat(np.maximum(rows, 0) / 150, WIDTH, axis=1).astype(np.float32)
    believed, doubted = street.fused(plane=RoadDepth(tilted)), street.fused(plane=RoadDepth(tilted, 0.04))
    road = street.classes == StreetClass.ROAD
    assert street.off(doubted, road) < 0.6 * street.off(believed, road)
    near = road & (np.arange(HEIGHT) == HEIGHT - 1)[:, None]
    assert doubted.spread[near].max() < 0.19


def test_parallax_of_nothing_is_believed_of_what_is_far() -> None:
    street = Street()
    tower = np.zeros((HEIGHT, WIDTH), bool)
    tower[8:16, 40:50] = True
    street.network[tower] *= 4
    street.confidence[:] = 0.9
    swept = np.where(tower, 0, street.inverse).astype(np.float32)
    found = street.fused(swept)
    assert (1 / found.inverse[tower] > 300).all()


def test_a_standing_road_user_follows_sure_stereo_near_its_contact() -> None:
    drive = toy.drive([], count=2)
    view = make_view(drive.clip, drive.posed.cameras, drive.posed.fixed_regions, drive.posed.ground)
    shape = drive.depth_m.shape
    contact = Fused(*(np.full(shape, value, np.float32) for value in (0.1, 0.5, 0.06)))
    stereo = np.full(shape, 0.105, np.float32)
    stereo[:, :, 30:33] = 0.2
    sure = np.zeros(shape, np.float32)
    sure[:, ::2] = 0.9
    frame = view.frames[0]
    standing = np.ones(shape, bool)
    standing[:, :10] = False
    found = with_stereo(view, contact, standing, stereo, sure)
    assert found.inverse[frame, 10:, :20] == pytest.approx(0.105, rel=0.02)
    assert found.inverse[frame, 10::2, :20] == pytest.approx(0.105)
    assert found.inverse[frame, 10:, 31] == pytest.approx(0.105, rel=0.02)  # what is far off is not stereo's
    assert found.inverse[frame, :10] == pytest.approx(0.1)
    assert found.spread[frame, 10, 0] < contact.spread[frame, 10, 0]
