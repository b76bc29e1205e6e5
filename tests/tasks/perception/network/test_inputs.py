import numpy as np
import pytest
import torch
from PIL import Image

from dreamdrive.errors import InputError
from dreamdrive.scene.street.log import LogMap
from dreamdrive.tasks.perception import (
    SMALL,
    BevGrid,
    BevSample,
    ImageSize,
    as_batch,
    bev_labels,
    camera_from_level_ego,
    prepare_picture,
)

NUSCENES = np.array([[1266.4, 0.0, 816.3], [0.0, 1266.4, 491.5], [0.0, 0.0, 1.0]])


def test_intrinsics_are_scaled_and_cropped() -> None:
    picture = np.zeros((900, 1600, 3), np.uint8)
    prepared, scaled = prepare_picture(picture, NUSCENES, ImageSize())
    assert prepared.shape == (3, 224, 480)
    wanted = [[1266.4 * 0.3, 0, 816.3 * 0.3], [0, 1266.4 * 0.3, 491.5 * 0.3 - 46], [0, 0, 1]]
    np.testing.assert_allclose(scaled, wanted, rtol=1e-6)
    assert scaled.dtype == np.float32
    small, _ = prepare_picture(picture, NUSCENES, SMALL.image)
    assert small.shape == (3, 96, 208)


def test_a_picture_is_resized_as_a_whole_and_then_cropped() -> None:
    picture = np.random.default_rng(0).integers(0, 256, (90, 160, 3), dtype=np.uint8)
    prepared, _ = prepare_picture(picture, NUSCENES, ImageSize(20, 40, 5))
    whole = np.asarray(Image.fromarray(picture).resize((40, 25), Image.Resampling.BILINEAR))
    np.testing.assert_array_equal(prepared, whole[5:].transpose(2, 0, 1))


def test_a_point_is_seen_at_the_same_place_of_the_picture() -> None:
    """Of 1080 x 1920 and stretched."""
    size, point = ImageSize(96, 208, 21), np.array([2.0, 1.0, 10.0])
    _, scaled = prepare_picture(np.zeros((1080, 1920, 3), np.uint8), NUSCENES, size)
    before, after = ((each @ point)[:2] / point[2] for each in (NUSCENES, scaled))
    np.testing.assert_allclose(after, [before[0] * 208 / 1920, before[1] * 117 / 1080 - 21], rtol=1e-5)


def test_extrinsics_lead_from_the_level_car_to_the_camera() -> None:
    mounting = np.array([[0.0, 0, 1, 1.5], [-1, 0, 0, 0.2], [0, -1, 0, 1.6], [0, 0, 0, 1]])
    yaw = 0.7
    ego = np.eye(4)
    ego[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    ego[:3, 3] = [400.0, -300.0, 2.0]
    found = camera_from_level_ego(ego @ mounting, ego)
    np.testing.assert_allclose(found, np.linalg.inv(mounting), atol=1e-3)
    later = ego.copy()
    later[:2, 3] += ego[:2, 0]  # the picture is one metre on
    ahead = camera_from_level_ego(later @ mounting, ego) @ np.array([2.5, 0.2, 1.6, 1.0])
    np.testing.assert_allclose(ahead[:3], 0, atol=1e-3)


def test_samples_are_put_together() -> None:
    labels = bev_labels(BevGrid(16, 16), np.eye(4), (), LogMap())
    sample = BevSample(
        np.zeros((2, 3, 8, 8), np.uint8),
        np.zeros((2, 3, 3), np.float32),
        np.tile(np.eye(4, dtype=np.float32), (2, 1, 1)),
        labels,
    )
    batch = as_batch([sample, sample])
    assert batch.pictures.shape == (2, 2, 3, 8, 8)
    assert batch.truth.vehicle.shape == (2, 16, 16)
    assert batch.truth.visibility.unique().tolist() == [255]
    assert batch.to(torch.device("cpu")).truth.centre.dtype == torch.float32


def test_samples_of_several_shapes_are_refused() -> None:
    labels = bev_labels(BevGrid(16, 16), np.eye(4), (), LogMap())
    one, other = (
        BevSample(
            np.zeros((count, 3, 8, 8), np.uint8), np.zeros((count, 3, 3)), np.zeros((count, 4, 4)), labels
        )
        for count in (1, 2)
    )
    with pytest.raises(InputError, match="expected one shape"):
        as_batch([one, other])
    with pytest.raises(InputError, match="expected one shape"):
        as_batch([])
