"""What stands where no frame looks."""

import numpy as np

from dreamdrive.prior.photo import layers_of
from dreamdrive.prior.photo.sight import sight_of
from dreamdrive.prior.photo.unseen import unseen_of
from tests.prior.photo.streets import CAR, GROUND, street


def test_what_the_frames_show_is_left_out_and_what_is_aside_and_behind_stays() -> None:
    photo = street()
    layers = layers_of(photo)
    depth = sight_of(layers, photo.camera, GROUND).depth_m
    unseen = unseen_of(layers, np.zeros((photo.road_users.max(), 3)), [photo.camera], depth[None])
    at = photo.camera.project(unseen.means.numpy().astype(np.float64))
    inside = photo.camera.shows(at)
    assert (~inside).sum() > 500
    # Inside of the picture only what is behind something is left, such as the wall behind the car.
    places = at[inside]
    behind = places[:, 2] > 1.02 * np.maximum(
        photo.depth_m[places[:, 1].astype(int), places[:, 0].astype(int)], 0.1
    )
    assert behind.mean() > 0.85
    car = (places[:, 0] > CAR[1].start) & (places[:, 0] < CAR[1].stop)
    assert car.any()
    assert unseen.actor is None


def test_nothing_is_left_where_another_frame_looks() -> None:
    photo = street()
    layers = layers_of(photo)
    pose = np.eye(4)
    pose[0, 3] = 1.5
    cameras = [photo.camera, photo.camera.at(pose)]
    depth = np.stack([sight_of(layers, camera, GROUND).depth_m for camera in cameras])
    one, both = (
        unseen_of(layers, np.zeros((photo.road_users.max(), 3)), cameras[:n], depth[:n]) for n in (1, 2)
    )
    assert 0 < len(both) < len(one)
