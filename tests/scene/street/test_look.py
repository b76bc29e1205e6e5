"""What is seen, as a noun."""

from dataclasses import replace

import numpy as np
import pytest
from jaxtyping import TypeCheckError

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.look import CameraEstimate, Look, RoadUser
from dreamdrive.scene.street.street_class import StreetClass

CAMERA = CameraEstimate(480, 270, 400.0, 0.05, 10.0, 4.0, 0.02, 0.01, 0.1)


def small_look(frames: int = 2, camera_height_m: float | None = None) -> Look:
    """Sky above road, with a car in the left half of it."""
    classes = np.full((frames, 8, 12), StreetClass.ROAD, np.uint8)
    classes[:, :4] = StreetClass.SKY
    classes[:, 3:6, :6] = StreetClass.VEHICLE
    classes[:, 7] = StreetClass.OWN_CAR
    depth = np.where(np.isin(classes, (StreetClass.SKY, StreetClass.OWN_CAR)), 0, 4).astype(np.float32)
    car = RoadUser(StreetClass.VEHICLE, 0.8, (0, 3, 6, 6), 18)
    camera = replace(CAMERA, width_px=12, height_px=8, focal_px=10.0, horizon_px=0.0, horizon_spread_px=0.5)
    return Look(
        depth=depth,
        spread=np.where(depth > 0, 0.1, 0).astype(np.float16),
        classes=classes,
        confidence=np.full(classes.shape, 0.75, np.float16),
        instances=(classes == StreetClass.VEHICLE).astype(np.uint16),
        road_users=((car,),) * frames,
        cameras=(camera,) * frames,
        camera=camera,
        camera_height_m=camera_height_m,
    )


def test_metres_need_the_height_of_the_camera() -> None:
    assert small_look(camera_height_m=1.5).depth_m.max() == 6
    with pytest.raises(ValueError, match="give the camera's height"):
        _ = small_look().depth_m


def test_up_is_that_of_the_level_rays() -> None:
    camera = Camera(400.0, 420.0, 250.0, 130.0, 480, 270)
    up = CAMERA.up_in(camera)
    columns = np.array([0.0, 100.0, 480.0])
    pixels = np.stack([columns, CAMERA.horizon_rows(columns), np.ones(3)], axis=1)
    np.testing.assert_allclose(pixels @ np.linalg.inv(camera.matrix).T @ up, 0, atol=1e-12)
    assert np.linalg.norm(up) == pytest.approx(1)
    assert up[1] < -0.99
    level = replace(CAMERA, horizon_px=0.0, roll_rad=0.0)
    np.testing.assert_array_equal(level.up_in(Camera(400.0, 400.0, 240.0, 135.0, 480, 270)), [0, -1, 0])


def test_masks_are_those_of_the_classes() -> None:
    seen = small_look()
    assert len(seen) == 2
    assert seen.sky.sum() == 2 * (3 * 12 + 6)
    assert seen.own_car[:, 7].all()


def test_maps_of_another_shape_are_refused() -> None:
    seen = small_look()
    with pytest.raises((ValueError, TypeCheckError), match="classes"):
        replace(seen, classes=seen.classes[:1])
    with pytest.raises(ValueError, match="cameras of 1 frames, expected 2"):
        replace(seen, cameras=seen.cameras[:1])


def test_a_road_user_is_of_their_classes() -> None:
    with pytest.raises(ValueError, match="ROAD is none of"):
        RoadUser(StreetClass.ROAD, 0.5, (0, 0, 1, 1), 1)


def test_angles_follow_from_pixels() -> None:
    assert CAMERA.hfov_rad == pytest.approx(2 * np.arctan(0.6))
    assert CAMERA.pitch_rad == pytest.approx(np.arctan(10 * np.cos(0.02) / 400))
    left, middle, right = CAMERA.horizon_rows(np.array([0.0, 240.0, 480.0]))
    assert middle == pytest.approx(145)
    assert left - middle == pytest.approx(240 * np.tan(0.02))
    assert right - middle == pytest.approx(-240 * np.tan(0.02))


def test_the_horizon_is_where_level_rays_of_a_turned_camera_lie() -> None:
    pitch, roll, focal = 0.1, 0.3, 400.0
    # Up in a camera that looks up by the pitch and is then turned clockwise about its axis.
    up = np.array([-np.sin(roll) * np.cos(pitch), -np.cos(roll) * np.cos(pitch), np.sin(pitch)])
    row = focal * np.tan(pitch) / np.cos(roll)
    camera = replace(CAMERA, roll_rad=roll, horizon_px=row)
    columns = np.array([0.0, 100.0, 470.0])
    rays = np.column_stack(
        [(columns - 240) / focal, (camera.horizon_rows(columns) - 135) / focal, np.ones(3)]
    )
    assert np.allclose(rays @ up, 0, atol=1e-12)
    assert camera.pitch_rad == pytest.approx(pitch)
