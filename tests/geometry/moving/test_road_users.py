"""Road users move as a whole, in all their frames."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.geometry.depth import make_view
from dreamdrive.geometry.moving import FLAGGED, too_near, whole_road_users
from dreamdrive.geometry.moving.following import Sighting
from dreamdrive.geometry.moving.road_users import off_place
from dreamdrive.geometry.options import RoadUserOptions
from dreamdrive.scene.street.look import Look
from dreamdrive.scene.street.street_class import StreetClass
from tests.geometry import toy
from tests.scene.street.test_look import small_look

FRAMES = 6


class Scene:
    """An empty road of the toy street with one block in the picture, in the same place in every frame."""

    def __init__(self) -> None:
        self.drive = toy.drive([], count=FRAMES)
        posed = self.drive.posed
        self.view = make_view(self.drive.clip, posed.cameras, posed.fixed_regions, posed.ground)
        shape = self.drive.depth_m.shape
        self.block = np.zeros(shape, bool)
        middle = shape[2] // 2
        self.block[:, shape[1] // 2 : shape[1] // 2 + 20, middle - 10 : middle + 10] = True
        small = small_look(FRAMES)
        zeros = np.zeros(shape, np.float32)
        self.look: Look = replace(
            small,
            depth=zeros,
            spread=zeros.astype(np.float16),
            classes=zeros.astype(np.uint8),
            confidence=np.ones(shape, np.float16),
            instances=self.block.astype(np.uint16),
        )
        self.nearer = np.zeros(shape, bool)
        self.depth_m = np.full(shape, 100.0, np.float32)

    def found(self, evidence: np.ndarray) -> np.ndarray:
        """What is flagged in the end."""
        return (
            whole_road_users(self.view, self.look, {}, evidence, self.nearer, 1 / self.depth_m)[0] >= FLAGGED
        )


def test_a_user_of_which_enough_is_flagged_moves_in_all_frames() -> None:
    scene = Scene()
    evidence = np.zeros(scene.block.shape, np.float32)
    evidence[2:5][scene.block[2:5]] = 0.8  # half of the frames
    flagged = scene.found(evidence)
    used = list(scene.view.frames)
    assert (flagged[used] == scene.block[used]).all()


@pytest.mark.parametrize(
    ("was", "becomes", "same"),
    [
        (StreetClass.VEHICLE, StreetClass.VEHICLE, True),
        (StreetClass.VEHICLE, StreetClass.PERSON, False),
        (StreetClass.PERSON, StreetClass.VEHICLE, False),
        # Riders are often taken for persons, motorcycles for cars.
        (StreetClass.TWO_WHEELER, StreetClass.PERSON, True),
        (StreetClass.VEHICLE, StreetClass.TWO_WHEELER, True),
    ],
)
def test_a_vehicle_does_not_go_on_as_a_person(was: StreetClass, becomes: StreetClass, same: bool) -> None:
    """Where a car has left the picture, what stands behind it shares its pixels."""
    scene = Scene()
    user, half = scene.look.road_users[0][0], FRAMES // 2
    road_users = [(replace(user, kind=was if frame < half else becomes),) for frame in range(FRAMES)]
    scene.look = replace(scene.look, road_users=tuple(road_users))
    evidence = np.zeros(scene.block.shape, np.float32)
    evidence[:half][scene.block[:half]] = 0.8
    flagged = scene.found(evidence)
    used = np.array(scene.view.frames)
    assert flagged[used[used < half]].any(axis=(1, 2)).all()
    assert flagged[used[used >= half]].any(axis=(1, 2)).all() == same


def test_a_user_of_which_little_is_flagged_stands() -> None:
    scene = Scene()
    evidence = np.zeros(scene.block.shape, np.float32)
    evidence[3][scene.block[3]] = 0.8
    assert not scene.found(evidence).any()


def test_what_is_surely_street_does_not_move() -> None:
    scene = Scene()
    assert not scene.found(np.where(scene.block, 0, 0.9).astype(np.float32)).any()
    doubtful = replace(scene.look, confidence=np.full(scene.block.shape, 0.4, np.float16))
    scene.look = doubtful
    assert scene.found(np.where(scene.block, 0, 0.9).astype(np.float32))[scene.view.frames[0]].any()


def test_rims_beside_users_do_not_move_but_wide_regions_do() -> None:
    scene = Scene()
    scene.look = replace(scene.look, confidence=np.full(scene.block.shape, 0.4, np.float16))
    evidence = np.where(scene.block, 0.9, 0).astype(np.float32)
    row, column = np.argwhere(scene.block[0])[0]
    evidence[:, row : row + 20, column + 20 : column + 24] = 0.9  # the road that it has just left
    evidence[:, row : row + 20, column - 60 : column - 30] = 0.9
    flagged = scene.found(evidence)[scene.view.frames[0]]
    assert flagged[row + 10, column + 10]
    assert not flagged[row + 10, column + 21]
    assert flagged[row + 10, column - 45]


def test_a_user_that_stereo_sees_before_its_foot_moves() -> None:
    scene = Scene()
    scene.nearer[:3] = scene.block[:3]  # half of the frames
    flagged = scene.found(np.zeros(scene.block.shape, np.float32))
    assert (flagged[list(scene.view.frames)] == scene.block[list(scene.view.frames)]).all()


def test_a_parked_car_does_not_go_on_as_the_next_one_farther_away() -> None:
    scene = Scene()
    used = np.array(scene.view.frames)
    half = FRAMES // 2
    evidence = np.zeros(scene.block.shape, np.float32)
    evidence[half:][scene.block[half:]] = 0.8
    scene.depth_m[:half], scene.depth_m[half:] = 6.0, 24.0
    flagged = scene.found(evidence)
    assert not flagged[used[used < half]].any()
    assert flagged[used[used >= half]].any(axis=(1, 2)).all()
    scene.depth_m[half:] = 7.0
    assert scene.found(evidence)[used].any(axis=(1, 2)).all()


def test_stereo_contradicts_contact_where_it_is_sure_and_near() -> None:
    metres = np.array([[[20.0, 20.0, 20.0, 90.0]]], np.float32)
    stereo = np.array([[[10.0, 15.0, 10.0, 45.0]]], np.float32)
    confidence = np.array([[[0.9, 0.9, 0.1, 0.9]]], np.float32)
    found = too_near(1 / metres, 1 / stereo, confidence, RoadUserOptions())
    assert found.tolist() == [[[True, False, False, False]]]


def test_a_user_that_keeps_its_distance_needs_less_that_tells() -> None:
    """A truck beside the camera: the road goes by, but it does not come nearer."""
    scene = Scene()
    evidence = np.zeros(scene.block.shape, np.float32)
    evidence[1][scene.block[1]] = 0.8
    evidence[2][scene.block[2] & (np.arange(scene.block.shape[2]) % 2 == 0)] = 0.8
    assert not scene.found(evidence).any()
    scene.depth_m[:] = 2.5
    assert off_place_of(scene) > 0.25
    used = list(scene.view.frames)
    assert (scene.found(evidence)[used] == scene.block[used]).all()
    assert not scene.found(np.zeros_like(evidence)).any()
    for frame in used:
        travelled_m = scene.view.cameras[frame].world_from_camera[2, 3]
        scene.depth_m[frame] = 12.0 - travelled_m
    assert off_place_of(scene) < 0.05
    assert not scene.found(evidence).any()


def off_place_of(scene: Scene) -> float:
    pixels = int(scene.block[0].sum())
    track = [Sighting(frame, 1, pixels, 0) for frame in scene.view.frames]
    return off_place(scene.view, scene.look, 1 / scene.depth_m, track)


@pytest.mark.parametrize("repainted", [False, True])
def test_nothing_goes_on_in_other_colours(repainted: bool) -> None:
    """Where a car has left the picture at its border, there comes the next."""
    scene, half = Scene(), FRAMES // 2
    rgb = scene.view.rgb.copy()
    rgb[scene.block] = (180, 30, 30)
    if repainted:
        rgb[half:][scene.block[half:]] = (30, 60, 170)
    scene.view = replace(scene.view, rgb=rgb)
    evidence = np.zeros(scene.block.shape, np.float32)
    evidence[:half][scene.block[:half]] = 0.8
    flagged = scene.found(evidence)
    used = np.array(scene.view.frames)
    assert flagged[used[used < half]].any(axis=(1, 2)).all()
    assert flagged[used[used >= half]].any(axis=(1, 2)).all() != repainted


def test_who_rides_moves_without_any_evidence() -> None:
    scene = Scene()
    row, column = np.argwhere(scene.block[0])[0].tolist()
    instances = scene.look.instances.copy()
    instances[:, row : row + 10, column : column + 20] = 2
    wheel = replace(scene.look.road_users[0][0], kind=StreetClass.TWO_WHEELER)
    wheel = replace(wheel, box_px=(column, row + 10, column + 20, row + 20))
    rider = replace(wheel, kind=StreetClass.PERSON, box_px=(column, row, column + 20, row + 10))
    scene.look = replace(scene.look, instances=instances, road_users=((wheel, rider),) * FRAMES)
    nothing = np.zeros(scene.block.shape, np.float32)
    used = list(scene.view.frames)
    assert (scene.found(nothing)[used] == scene.block[used]).all()
    afoot = replace(rider, kind=StreetClass.VEHICLE)
    scene.look = replace(scene.look, road_users=((wheel, afoot),) * FRAMES)
    assert not scene.found(nothing).any()
