"""Pointmaps made from a drive of which all is known."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive_bench.geometry.simulated_pairs import Noise, Truth, pair_maps, smooth_noise
from tests.geometry.backends.dust3r.align.pairs import street, window

NONE = Noise(depth=0, scale=0, focal=0, outliers=0)


@pytest.fixture(scope="module")
def drive() -> Truth:
    return street(3, 64, 32)


@pytest.fixture(scope="module")
def mover(drive: Truth) -> Truth:
    """A thing in the middle of the picture that goes along with the camera."""
    instance = np.zeros(drive.depth.shape, int)
    instance[:, 18:22, 30:34] = 1
    centres = drive.world_from_camera[None, :, :3, 3] * 0.9
    return replace(drive, instance=instance, centres=centres)


@pytest.mark.parametrize("length", [8.0, 64.0])
def test_noise_has_its_deviation_and_length_on_either_grid(length: float) -> None:
    noise = smooth_noise(512, 1024, length, np.random.default_rng(0))
    assert noise.shape == (512, 1024)
    assert noise.std() == pytest.approx(1, abs=0.15)
    apart = int(length)
    correlation = (noise[:, apart:] * noise[:, :-apart]).mean() / np.square(noise).mean()
    assert correlation == pytest.approx(np.exp(-0.5), abs=0.15)


def test_without_noise_both_pointmaps_lie_in_the_frame_of_the_first_camera(drive: Truth) -> None:
    maps = pair_maps(drive, np.array([[0, 2]]), NONE)
    own, other = maps.points[0]
    seen = drive.depth > 0
    np.testing.assert_allclose(own[seen[0]][:, 2], drive.depth[0][seen[0]], rtol=1e-6)
    second_from_first = np.linalg.inv(drive.world_from_camera[2]) @ drive.world_from_camera[0]
    back = other @ second_from_first[:3, :3].T + second_from_first[:3, 3]
    np.testing.assert_allclose(back[seen[2]][:, 2], drive.depth[2][seen[2]], rtol=1e-4)
    assert (maps.confidence[0][1] == 1).sum() == (~seen[2]).sum()


def test_movers_are_where_they_are_or_where_standing_things_would_be(drive: Truth, mover: Truth) -> None:
    edges = np.array([[0, 2]])
    there = pair_maps(mover, edges, replace(NONE, mistaken=False)).points[0][1]
    np.testing.assert_array_equal(there, pair_maps(drive, edges, NONE).points[0][1])
    mistaken = pair_maps(mover, edges, NONE).points[0][1]
    at = np.s_[18:22, 30:34]
    assert (np.linalg.norm(mistaken[at], axis=-1) > 2 * np.linalg.norm(there[at], axis=-1)).all()


def test_noise_is_greater_only_where_the_first_camera_does_not_look(drive: Truth) -> None:
    noise = replace(NONE, depth=0.05)
    far = replace(drive, world_from_camera=drive.world_from_camera.copy())
    far.world_from_camera[2, :3, 3] += [0, 0, -4]  # behind: the first camera sees less around the middle
    for i, j in window(3, 2):
        edges = np.array([[i, j]])
        plain, apart = (pair_maps(far, edges, each).points[0] for each in (noise, replace(noise, unseen=4.0)))
        np.testing.assert_array_equal(plain[0], apart[0])
        if (i, j) == (0, 2):
            same = (plain[1] == apart[1]).all(axis=-1)
            assert same[12:20, 28:36].all()
            assert not same.all()


def test_a_common_focal_length_is_that_of_all_pairs(drive: Truth) -> None:
    edges = window(3, 2)
    plain, apart = (pair_maps(drive, edges, noise) for noise in (NONE, replace(NONE, common_focal=0.25)))
    for true, found in zip(plain.points, apart.points, strict=True):
        for one, other in zip(true, found, strict=True):
            np.testing.assert_allclose(other, one / np.float32([1.25, 1.25, 1]), rtol=1e-6)


def test_places_are_off_along_all_axes_by_a_share_of_the_depth(drive: Truth) -> None:
    edges = np.array([[0, 2]])
    plain, apart = (pair_maps(drive, edges, noise).points[0] for noise in (NONE, replace(NONE, place=0.02)))
    for image, one, other in zip((0, 2), plain, apart, strict=True):
        seen = drive.depth[image] > 0
        missed = (other - one)[seen] / drive.depth[image][seen][:, None]
        np.testing.assert_allclose(missed.std(axis=0), 0.02, rtol=0.4)
