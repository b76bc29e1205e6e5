"""What every adapter has to keep to, on a street whose truth the networks know."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dreamdrive.geometry import BACKENDS
from dreamdrive.geometry.backends.feedforward.reconstruct import FeedForward
from dreamdrive.geometry.measured import Measured
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.street.truth import DriveTruth
from tests.geometry.backends.feedforward.fakes import BACKEND, METRIC, Truth


def way_of(kind: str, **changes: int) -> FeedForward:
    way = BACKENDS[BACKEND.get(kind, kind)].reconstruct
    assert isinstance(way, FeedForward)
    return replace(way, **changes)


def measure(way: FeedForward, clip: Clip, weights: Path, seed: int = 0) -> Measured:
    return way.measure(clip, clip.valid, weights, seed)


def reprojected(found: Measured, drive: DriveTruth, first: int, second: int) -> np.ndarray:
    """Depth in the second frame by the first frame's, relative to what the second says there."""
    street = drive.depth_m[first] > 0
    local = (found.camera.rays() * found.depth[first][..., None])[street]
    pose = found.world_from_camera[first]
    world = local @ pose[:3, :3].T + pose[:3, 3]
    columns, rows, depth = found.camera.at(found.world_from_camera[second]).project(world).T
    inside = (depth > 0) & (columns >= 0) & (columns < found.camera.width_px)
    inside &= (rows >= 0) & (rows < found.camera.height_px)
    there = found.depth[second][rows[inside].astype(int), columns[inside].astype(int)]
    return depth[inside] / there


def test_the_depth_of_a_frame_is_that_of_the_others(
    kind: str, clip: Clip, drive: DriveTruth, weights: Path
) -> None:
    clip = replace(clip, held_out=np.zeros(len(clip), bool))
    found = measure(way_of(kind), clip, weights)
    for first, second in ((0, 1), (4, 3), (2, 5)):
        ratio = reprojected(found, drive, first, second)
        assert len(ratio) > 3000
        assert np.median(ratio) == pytest.approx(1, abs=0.01)
        assert np.mean(np.abs(ratio - 1) < 0.1) > 0.85  # the rest is hidden, or at the edge of something


def test_path_and_depth_are_the_truth_in_some_unit(
    kind: str, clip: Clip, drive: DriveTruth, weights: Path, truth: Truth
) -> None:
    found = measure(way_of(kind), clip, weights)
    factor = 1.0 if kind in METRIC else truth.factors[0]
    assert (found.unit is not None) == (kind in METRIC)
    assert found.world_from_camera[:, :3, 3] == pytest.approx(
        factor * drive.trajectory.world_from_camera[:, :3, 3], abs=1e-4
    )
    street = (drive.depth_m > 0) & ~clip.held_out[:, None, None]
    np.testing.assert_allclose(found.depth[street], factor * drive.depth_m[street], rtol=1e-4)
    assert found.camera.fx_px == pytest.approx(drive.cameras[0].fx_px, rel=0.01)
    assert (found.camera.cx_px, found.camera.cy_px) == pytest.approx((80, 48), abs=0.01)
    assert found.focal_observed


def test_confidence_is_a_rank_and_held_out_frames_have_no_depth(kind: str, clip: Clip, weights: Path) -> None:
    found = measure(way_of(kind), clip, weights)
    assert not found.depth[clip.held_out].any()
    assert not found.confidence[clip.held_out].any()
    given = found.confidence[~clip.held_out]
    assert 0 < given.min() <= given.max() == 1
    assert np.median(given) == pytest.approx(0.5, abs=0.01)


def test_pixels_that_show_no_street_have_no_depth(kind: str, clip: Clip, weights: Path) -> None:
    free = clip.valid.copy()
    free[:, 80:] = False
    found = way_of(kind).measure(clip, free, weights)
    assert not found.depth[:, 80:].any()
    assert (found.depth[1, :80] > 0).all()


def test_known_intrinsics_are_kept(
    kind: str, clip: Clip, drive: DriveTruth, weights: Path, truth: Truth
) -> None:
    fx_px = 1.5 * clip.rig[0].fx_px
    camera = replace(clip.rig[0], fx_px=fx_px, fy_px=113.0, cx_px=79.0)
    known = replace(clip, rig=(camera,), known=Known(intrinsics=True))
    found = measure(way_of(kind), known, weights)
    assert np.array_equal(found.camera.matrix, camera.matrix)
    assert found.focal_observed
    assert any("focal length" in note for note in found.notes)
    told = truth.asked[0].get("intrinsics")
    assert (told is not None) == (kind in ("mapanything", "pi3x"))
    if told is not None:
        wide = 518 if kind == "mapanything" else 504
        assert told[3, 0, 0] == pytest.approx(fx_px * wide / 160)
        # One counts pixels from 0, the other from 0.5.
        assert told[3, 0, 2] == pytest.approx(79 * wide / 160 - (0.5 if kind == "mapanything" else 0))


@pytest.mark.parametrize("metric", [True, False])
def test_known_poses_are_kept_and_give_the_depth_their_unit(
    kind: str, clip: Clip, drive: DriveTruth, weights: Path, truth: Truth, metric: bool
) -> None:
    poses = drive.trajectory.world_from_camera.copy()
    poses[:, :3, 3] *= 0.3
    known = replace(clip, known=Known(poses, intrinsics=True, metric=metric))
    found = measure(way_of(kind), known, weights)
    assert np.array_equal(found.world_from_camera, poses)
    assert found.unit == ("poses" if metric else None)
    assert list(found.others.values()) == ([pytest.approx(1 / 0.3, rel=1e-3)] if kind in METRIC else [])
    street = (drive.depth_m > 0) & ~clip.held_out[:, None, None]
    np.testing.assert_allclose(found.depth[street], 0.3 * drive.depth_m[street], rtol=1e-3)
    told = {"mapanything": "camera_poses", "pi3x": "poses"}.get(kind)
    if told is not None:
        np.testing.assert_allclose(truth.asked[0][told], poses, atol=1e-6)
    if kind == "mapanything":
        assert truth.asked[0]["is_metric_scale"].tolist() == [metric] * len(clip)


def test_chunks_of_different_units_become_one_world(
    kind: str, clip: Clip, drive: DriveTruth, weights: Path, truth: Truth
) -> None:
    truth.factors[:] = [0.1, 0.35, 0.02]
    found = measure(way_of(kind, chunk=4, overlap=2), clip, weights)
    assert len(truth.asked) == 3
    factor = 1.0 if kind in METRIC else float(np.prod([0.1, 0.35, 0.02])) ** (1 / 3)
    true = drive.trajectory.world_from_camera
    length = np.linalg.norm(true[-1, :3, 3])
    path = found.world_from_camera[:, :3, 3] / factor
    # The first chunk's unit says how long everything is, up to the mean of all.
    assert np.abs(path - true[:, :3, 3]).max() < 1e-3 * length
    np.testing.assert_allclose(found.world_from_camera[:, :3, :3], true[:, :3, :3], atol=1e-3)
    street = (drive.depth_m > 0) & ~clip.held_out[:, None, None]
    np.testing.assert_allclose(found.depth[street] / factor, drive.depth_m[street], rtol=1e-3)
    assert max(found.details["chunk_miss"]) < 1e-3


# The seed is set in what all share; once is enough, and it takes seconds.
@pytest.mark.parametrize("kind", ["da3"], indirect=True)
def test_the_same_seed_gives_the_same_result(kind: str, clip: Clip, weights: Path) -> None:
    way = way_of(kind, chunk=5, overlap=2)
    first, again, other = (measure(way, clip, weights, seed) for seed in (3, 3, 4))
    for name in ("world_from_camera", "depth", "confidence"):
        assert np.array_equal(getattr(first, name), getattr(again, name))
    assert not np.array_equal(first.confidence, other.confidence)
