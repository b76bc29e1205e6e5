"""From where the street benchmark looks: free sides, frames that do not count, caches that know them."""

from collections.abc import Iterator
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
import torch

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.truth import WorldBox
from dreamdrive_bench.street import measure, views as views_module

FRAMES = 24


@pytest.fixture
def views(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    caches = views_module.counted, views_module.view_digest
    for cache in caches:
        cache.cache_clear()
    yield views_module
    for cache in caches:
        cache.cache_clear()


def box(x_m: float, z_m: float) -> WorldBox:
    """A car of 4 m along z and 2 m across it, as it stands in a world of x right, y down and z ahead."""
    pose = np.eye(4)
    pose[:3, :3] = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
    pose[:3, 3] = [x_m, 0.75, z_m]
    return WorldBox(1, "car", "car", False, np.array([4.0, 2.0, 1.5]), np.stack([pose] * FRAMES))


def street(*boxes: WorldBox) -> SimpleNamespace:
    """A drive of a metre a frame, straight ahead."""
    pinhole = Camera(80, 80, 50, 30, 100, 60)
    poses = [np.eye(4) for _ in range(FRAMES)]
    for k, pose in enumerate(poses):
        pose[2, 3] = float(k)
    cameras = tuple(pinhole.at(pose) for pose in poses)
    frames = np.zeros((FRAMES, 6, 10, 3), np.uint8)
    return SimpleNamespace(boxes=boxes, cameras=cameras, times_s=np.arange(FRAMES) / 10, frames=frames)


def side_of(views: ModuleType, made: SimpleNamespace, metres: float) -> int:
    return views._free_side(made, metres)


def test_the_side_with_fewer_frames_inside_boxes_is_taken(views: ModuleType) -> None:
    right, far_left = box(3.0, 10.0), box(-3.0, 23.0)
    # Inside both: all of the car to the right, half of that to the left, which the drive ends beside.
    assert side_of(views, street(right, far_left), 3.0) == -1
    assert side_of(views, street(box(-3.0, 10.0), box(3.0, 23.0)), 3.0) == 1


def test_of_sides_without_such_frames_the_wider_one_is_taken(views: ModuleType) -> None:
    assert side_of(views, street(box(4.6, 10.0), box(-5.0, 10.0)), 1.0) == -1
    assert side_of(views, street(box(5.0, 10.0), box(-4.6, 10.0)), 1.0) == 1


def test_the_shift_leads_beside_the_camera_to_that_side(
    views: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(views, "world_of", lambda seed: street(box(3.0, 10.0)))
    for view, x_m, y_m in (("shift_3", -3.0, 0.0), ("shift_1", -1.0, 0.0), ("raise_1", 0.0, -1.0)):
        placed = np.stack([c.world_from_camera[:3, 3] for c in views.true_cameras(0, view)])
        np.testing.assert_allclose(placed, np.stack([[x_m, y_m, float(k)] for k in range(FRAMES)]))
    turned = views.true_cameras(0, "yaw_10")[0].world_from_camera
    assert np.degrees(np.arctan2(turned[0, 2], turned[2, 2])) == pytest.approx(10)


def test_frames_inside_or_close_to_a_box_do_not_count(
    views: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    both = street(box(3.0, 10.0), box(-3.0, 10.0))
    monkeypatch.setattr(views, "world_of", lambda seed: both)
    # The car reaches from 8 to 12 m: those frames are inside, those a metre off are not.
    assert np.flatnonzero(~views.counted(0, "shift_3")).tolist() == [8, 9, 10, 11, 12]
    assert views.counted(0, "yaw_10").all()
    clear = views.clearance_m(both.boxes, views.true_cameras(0, "shift_3"))
    assert clear[10] == 0
    assert clear[7] == pytest.approx(1)


def test_a_view_close_beside_a_car_does_not_count_either(
    views: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    beside = street(box(2.4, 10.0), box(-2.4, 10.0))  # their flanks 0.4 m from a camera 1 m to the side
    monkeypatch.setattr(views, "world_of", lambda seed: beside)
    assert 9 not in np.flatnonzero(views.counted(0, "shift_1"))
    assert 7 in np.flatnonzero(views.counted(0, "shift_1"))


def test_true_frames_of_another_path_are_drawn_again(
    views: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    made, drawn = street(), []

    def look(cameras: list[Camera], times_s: list[float]) -> list[SimpleNamespace]:
        drawn.append(len(cameras))
        return [SimpleNamespace(frame=frame) for frame in made.frames]

    made.views = look
    monkeypatch.setattr(views, "world_of", lambda seed: made)
    monkeypatch.setattr(views, "world_digest", lambda seed: "a")
    for _ in range(2):
        views.true_frames(0, "shift_1", tmp_path)
    assert len(drawn) == 1
    monkeypatch.setattr(views, "_free_side", lambda *_: 1)  # until now it was the left one
    views.view_digest.cache_clear()
    views.true_frames(0, "shift_1", tmp_path)
    assert len(drawn) == 2


def test_windows_hold_no_frame_that_does_not_count(views: ModuleType) -> None:
    frames = np.zeros((FRAMES, 4, 4, 3), np.uint8)
    frames[:, 0, 0, 0] = np.arange(FRAMES)

    def first(part: torch.Tensor) -> np.ndarray:
        return part[:1, 0, 0, :1].numpy().astype(np.float32)

    def each(part: torch.Tensor) -> np.ndarray:
        return part[:, 0, 0, :1].numpy().astype(np.float32)

    networks = [
        measure.Extractor("video", "", True, first),
        measure.Extractor("image", "", False, each),
    ]
    counts = np.ones(FRAMES, bool)
    counts[:4] = False
    found = measure.features_of(frames, counts, networks)
    assert found["video"].ravel().tolist() == [4, 6, 8]
    assert found["image"].ravel().tolist() == list(range(4, FRAMES))
    counts[14] = False
    assert set(measure.features_of(frames, counts, networks)) == {"image"}
    assert measure.features_of(frames, np.zeros(FRAMES, bool), networks) == {}


def test_likeness_is_that_of_frames_that_count(views: ModuleType) -> None:
    truth = np.full((3, 16, 16, 3), 100, np.uint8)
    shown = truth.copy()
    shown[0] = 255
    shown[1:] = 110
    counts = np.array([False, True, True])
    found = measure.likeness_of(shown, truth, counts)
    assert found["frames"] == 2
    assert found["psnr"] == pytest.approx(20 * np.log10(25.5), abs=1e-4)
    assert measure.likeness_of(shown, truth, np.zeros(3, bool)) == {"psnr": None, "ssim": None, "frames": 0}
