import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera
from dreamdrive.tasks.environment.rig import Mount, check_size, mount, scene_rig
from tests.tasks.environment.scenes import scene, two_cameras

LOOK, RIGHT, DOWN = 2, 0, 1
"""Columns of a camera's axes."""
FRONT = np.eye(4)
FRONT[:3, :3], FRONT[:3, 3] = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], [1.7, 0, 1.5]


def test_a_mount_looks_ahead_unless_told() -> None:
    pose = mount("front").ego_from_camera
    np.testing.assert_allclose(pose, FRONT, atol=1e-12)


def test_it_looks_to_the_left_and_down() -> None:
    left = mount("left", left_deg=90).ego_from_camera
    np.testing.assert_allclose(left[:3, LOOK], [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(left[:3, RIGHT], [1, 0, 0], atol=1e-12)
    down = mount("down", down_deg=30).ego_from_camera
    np.testing.assert_allclose(down[:3, LOOK], [np.cos(np.pi / 6), 0, -0.5], atol=1e-12)
    assert down[2, DOWN] < 0


def test_its_field_of_view_is_what_was_asked_for() -> None:
    made = mount("wide", hfov_deg=90, size_px=(200, 100))
    assert made.pinhole.fx_px == pytest.approx(100.0)
    assert (made.pinhole.width_px, made.pinhole.height_px) == (200, 100)


@pytest.mark.parametrize(
    "size_px", [(64.0, 40), (np.nan, 40), "ab", None, (5,), (5, 5, 5), 2**70, (2**70, 1), ("5", 5)]
)
def test_what_is_no_size_is_refused(size_px: object) -> None:
    with pytest.raises(InputError, match=r"size_px .* expected width and height, whole numbers from 1"):
        check_size(size_px)


@pytest.mark.parametrize("size_px", [(1, 1), [64, 40], (np.int64(64), np.uint8(40)), (16_384, 900)])
def test_sizes_are_whole_numbers(size_px: object) -> None:
    check_size(size_px)


def test_the_cameras_of_a_scene_keep_their_places_and_fields_of_view() -> None:
    rig = scene_rig(two_cameras(scene()), FRONT, (128, 64), only_front=False)
    assert [each.name for each in rig] == ["front", "camera 1"]
    assert [each.of_rig for each in rig] == [0, 1]
    np.testing.assert_allclose(rig[0].ego_from_camera, FRONT, atol=1e-9)
    np.testing.assert_allclose(rig[1].ego_from_camera[:3, 3], [1.7, 0.5, 1.5], atol=1e-9)
    np.testing.assert_allclose(rig[1].ego_from_camera[:3, LOOK], [0, 1, 0], atol=1e-9)
    assert rig[0].pinhole.fx_px / 128 == pytest.approx(50.0 / 64)
    assert rig[0].pinhole.fy_px == rig[0].pinhole.fx_px
    assert len(scene_rig(two_cameras(scene()), FRONT, (128, 64), only_front=True)) == 1


@pytest.mark.parametrize("wrong", [{"hfov_deg": 180.0}, {"size_px": (0, 5)}, {"left_deg": float("nan")}])
def test_what_no_camera_is_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(InputError, match=r"camera odd|size_px \(0, 5\)"):
        mount("odd", **wrong)  # type: ignore[arg-type]


def test_a_mounting_is_rigid() -> None:
    with pytest.raises(ValueError, match="mounting of bent"):
        Mount("bent", Camera(50, 50, 32, 20, 64, 40), 2 * np.eye(4))
