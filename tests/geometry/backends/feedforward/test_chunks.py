"""Chunks cover a clip, overlap, and are joined by what they share."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.spatial.transform import Rotation

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.feedforward.chunks import chunks, join
from dreamdrive.geometry.backends.feedforward.network import FeedforwardResult
from dreamdrive.scene.camera import Camera

CAMERA = Camera(30.0, 30.0, 16.0, 12.0, 32, 24)
FRAMES = 9


@given(st.integers(1, 100), st.integers(2, 24), st.data())
def test_chunks_cover_the_clip_and_overlap(count: int, length: int, data: st.DataObject) -> None:
    overlap = data.draw(st.integers(1, length - 1))
    found = chunks(count, length, overlap)
    assert found[0].start == 0
    assert found[-1].stop == count
    assert all(len(each) == min(count, length) for each in found)
    for before, after in pairwise(found):
        assert before.start < after.start
        assert before.stop - after.start >= overlap


def scene(noise: float = 0.0) -> list[tuple[range, FeedforwardResult]]:
    """Three chunks of a camera that turns and rides before a hilly wall, each in its own world."""
    rng = np.random.default_rng(0)
    poses = np.tile(np.eye(4), (FRAMES, 1, 1))
    poses[:, :3, :3] = Rotation.from_euler("y", np.linspace(0, 0.3, FRAMES)[:, None]).as_matrix()
    poses[:, 2, 3] = np.linspace(0, 2, FRAMES)
    depth = rng.uniform(3, 30, (FRAMES, 24, 32))
    parts = []
    for frames, scale in zip(chunks(FRAMES, 5, 3), (1.0, 0.3, 2.5), strict=True):
        own = slice(frames.start, frames.stop)
        turn = Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
        moved = np.tile(np.eye(4), (len(frames), 1, 1))
        moved[:, :3, :3] = turn @ poses[own, :3, :3]
        moved[:, :3, 3] = scale * (poses[own, :3, 3] @ turn.T + [1.0, 2.0, 3.0])
        seen = (scale * depth[own] * np.exp(rng.normal(0, noise, depth[own].shape))).astype(np.float32)
        seen[:, :4][rng.random((len(frames), 4, 32)) < 0.5] *= 3  # outliers: sky, say
        matrices = np.tile(CAMERA.matrix, (len(frames), 1, 1))
        parts.append((frames, FeedforwardResult(moved, matrices, seen, rng.random(seen.shape))))
    return parts


@pytest.mark.parametrize(("noise", "tolerance"), [(0.0, 1e-3), (0.05, 0.02)])
def test_outliers_and_noise_do_not_bend_the_path(noise: float, tolerance: float) -> None:
    found = join(scene(noise), CAMERA, np.ones((FRAMES, 24, 32), bool), np.arange(FRAMES))
    path = found.world_from_camera[:, :3, 3]
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    assert steps / steps.mean() == pytest.approx(1, abs=tolerance)
    assert found.scales / found.scales[0] == pytest.approx(np.array([1, 1 / 0.3, 1 / 2.5]), rel=tolerance)
    assert np.log(found.scales).mean() == pytest.approx(0)
    assert found.miss.max() < max(1e-3, 2 * noise)


def test_chunks_without_a_usable_pixel_in_common_are_refused() -> None:
    usable = np.ones((FRAMES, 24, 32), bool)
    usable[2:5] = False
    with pytest.raises(InputError, match="frames 16 to 22: two chunks see nothing in common"):
        join(scene(), CAMERA, usable, 10 + 3 * np.arange(FRAMES))
