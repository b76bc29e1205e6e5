"""Warps, correlation and the plane sweep against exact geometry."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from dreamdrive.geometry.depth import smoothing, sweep
from dreamdrive.geometry.depth.one_frame import sweep_frames
from dreamdrive.geometry.depth.view import make_view
from dreamdrive.scene.camera import Camera
from dreamdrive.vision.flow import single_threaded_opencv
from tests.geometry import toy


def turned(angle: float, shift: tuple[float, float, float]) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3] = cv2.Rodrigues(np.array([0.1 * angle, angle, -0.05 * angle]))[0]
    pose[:3, 3] = shift
    return pose


@settings(max_examples=40)
@given(
    angle=st.floats(-0.2, 0.2),
    shift=st.tuples(*[st.floats(-1.0, 1.0)] * 3),
    inverse=st.floats(0.0, 0.3),
)
def test_warp_and_homography_agree_with_projection(angle, shift, inverse):
    reference = Camera(90.0, 100.0, 33.0, 22.0, 64, 48)
    source = reference.at(turned(angle, shift))
    x, y = sweep.Warp(reference, source)(inverse)
    point = reference.rays()[10, 20]
    seen = source.matrix @ (source.world_from_camera[:3, :3].T @ (point - inverse * np.array(shift)))
    if seen[2] > 0.1:
        expected = seen[:2] / seen[2] - 0.5
        np.testing.assert_allclose([x[10, 20], y[10, 20]], expected, atol=1e-2)
        mapped = sweep.Warp(reference, source).homographies(np.array([inverse]))[0] @ [20, 10, 1]
        np.testing.assert_allclose(mapped[:2] / mapped[2], expected, atol=1e-6)


def test_a_cropped_camera_sees_the_same_part_of_the_picture():
    camera = Camera(90.0, 100.0, 33.0, 22.0, 64, 48)
    window = np.s_[5:60, 7:20]
    part = camera.cropped(*window)
    assert (part.height_px, part.width_px) == (43, 13)
    np.testing.assert_allclose(part.rays(), camera.rays()[window], atol=1e-12)


def test_correlation_ignores_gain_and_noise_on_flat_pictures():
    texture = toy.TEXTURES[0][:40, :50].astype(np.float32)
    correlation = sweep.Correlation(texture)
    assert np.median(correlation(texture)) > 0.95
    assert np.median(correlation(0.5 * texture + 60)) > 0.9
    noise = np.random.default_rng(1).normal(0, 1, (2, 40, 50)).astype(np.float32)
    flat = sweep.Correlation(100 + noise[0])(100 + noise[1])
    assert np.abs(flat).max() < 0.15


def test_sources_are_used_frames_on_both_sides_at_the_wanted_baselines():
    positions = np.zeros((12, 3))
    positions[:, 2] = 0.5 * np.arange(12)
    usable = np.ones(12, bool)
    assert sweep.choose_sources(positions, usable, 6, reach=5) == (2, 4, 8, 10)
    usable[[4, 8]] = False
    chosen = sweep.choose_sources(positions, usable, 6, reach=5)
    assert usable[list(chosen)].all()
    assert min(chosen) < 6 < max(chosen)


def test_smoothing_carries_depth_into_a_blank_and_refines_between_labels():
    work = smoothing.CostBuffers(9, 16, 20)
    labels = np.arange(16)[None, :, None]
    work.cost[:] = 0.02 * (labels - 7.3) ** 2
    work.cost[3:6, :, 8:12] = 0.5
    found = smoothing.best_label(work, np.full((9, 20), 100, np.float32))
    np.testing.assert_allclose(found, 7.3, atol=0.35)


def test_smoothed_labels_are_those_of_path_costs_added_up():
    rng = np.random.default_rng(3)
    work, grey = smoothing.CostBuffers(7, 20, 21), rng.uniform(0, 40, (7, 21)).astype(np.float32)
    work.cost[:] = rng.uniform(0, 1, work.cost.shape)

    def paths(cost, levels):
        path, total = cost[0], [cost[0]]
        for before, here, costs in zip(levels, levels[1:], cost[1:], strict=False):
            jump = np.maximum(0.9 / (1 + np.abs(here - before) / 8), 0.1)
            beside = np.pad(path, ((1, 1), (0, 0)), constant_values=np.inf) + 0.1
            least = path.min(axis=0)
            path = np.min([path, beside[2:], beside[:-2], least + jump + 0 * path], axis=0) + costs - least
            total.append(path)
        return np.stack(total)

    def both_ways(cost, levels):
        return paths(cost, levels) + paths(cost[::-1], levels[::-1])[::-1]

    cost = work.cost.astype(np.float64)
    total = both_ways(cost, grey) + both_ways(cost.transpose(2, 1, 0), grey.T).transpose(2, 1, 0)
    found, cheapest = smoothing.best_label(work, grey), total.argmin(axis=1)
    np.testing.assert_allclose(found, cheapest, atol=0.5001)
    assert (found != cheapest).any()


def seen_from_both_sides():
    """A reference, with pictures beside it of which one shows less."""
    camera, rng = Camera(60.0, 60.0, 25.0, 15.0, 50, 30), np.random.default_rng(5)
    pictures = [
        cv2.GaussianBlur(rng.uniform(0, 255, (30, 50)), (0, 0), 1.5).astype(np.float32) for _ in "abc"
    ]
    usable = np.ones((30, 50), bool), rng.uniform(size=(30, 50)) > 0.2
    poses = turned(0.05, (0.5, 0, -1.0)), turned(-0.02, (-0.4, 0.1, 5.0))
    warps = [sweep.Warp(camera, camera.at(pose)) for pose in poses]
    return pictures[0], list(zip(warps, pictures[1:], usable, strict=True))


def test_cost_of_a_plane_is_one_minus_similarity_on_it():
    grey, sources = seen_from_both_sides()
    correlation = sweep.Correlation(grey)
    cost = np.zeros((30, sweep.LABELS, 50), np.float32)
    sweep.matching_cost(correlation, sources, cost)
    for label, inverse in ((0, 0.0), (20, 20 * 0.3 / 63), (63, 0.3)):
        expected = sweep.similarity(correlation, sources, np.full(grey.shape, inverse, np.float32))
        off = np.abs(1 - cost[:, label] - expected)
        assert (off < 1e-4).mean() > 0.9  # the rest are pixels at the borders of what is seen
        assert np.median(off) < 1e-5


def test_misfit_on_a_plane_is_the_mean_difference_to_those_that_see_it():
    grey, sources = seen_from_both_sides()
    found = sweep.misfits(grey, sources, np.array([0.1]), 25.0)[0]
    total, count = np.zeros((2, *grey.shape))
    for warp, picture, usable in sources:
        x, y = warp(0.1)
        seen = sweep.inside(x, y, usable)
        total += np.minimum(np.abs(sweep.sample(picture, x, y) - grey), 25) * seen
        count += seen
    expected = np.where(count > 0, total / np.maximum(count, 1), 25)
    assert (np.abs(found - expected) < 1e-2).mean() > 0.97


@pytest.fixture(scope="module")
def street():
    return toy.drive([])


def test_depth_of_road_and_walls_is_right(street):
    view = make_view(street.clip, street.posed.cameras, street.posed.fixed_regions, street.posed.ground)
    with single_threaded_opencv():
        swept = sweep_frames(view, street.depth_m == 0)[3]
    assert swept is not None
    true = street.depth_m[3]
    inverse = np.where(true > 0, 1 / np.maximum(true, 0.1), 0)
    near = (true > 4) & (true < 25)
    error = np.abs(swept.inverse_depth / np.maximum(inverse, 1e-6) - 1)
    rows, columns = np.indices(true.shape)
    road = (
        near
        & (np.abs(true * (columns + 0.5 - toy.WIDTH / 2) / toy.FOCAL_PX) < toy.WALL_M - 0.5)
        & (rows > 72)
    )
    wall = near & (np.abs(true * (columns + 0.5 - toy.WIDTH / 2) / toy.FOCAL_PX) > toy.WALL_M - 0.01)
    assert np.median(error[road]) < 0.02
    assert np.median(error[wall]) < 0.03
    assert (error[wall] < 0.1).mean() > 0.8
    assert (swept.inverse_depth[true == 0] < 0.01).mean() > 0.9


def test_without_a_ground_the_road_is_found_from_its_texture(street):
    view = make_view(street.clip, street.posed.cameras, street.posed.fixed_regions, None)
    with single_threaded_opencv():
        swept = sweep_frames(view, street.depth_m == 0)[3]
    assert swept is not None
    assert not swept.on_plane.any()
    true = street.depth_m[3]
    near = (true > 4) & (true < 12)
    assert np.median(np.abs(swept.inverse_depth[near] * true[near] - 1)) < 0.05
