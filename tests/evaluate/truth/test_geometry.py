"""Truth lands on the pixels of the scene, from each kind of place it is read from."""

import json
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive.data.layout_file import write_layout
from dreamdrive.errors import InputError
from dreamdrive.evaluate.estimate import Estimate
from dreamdrive.evaluate.truth.geometry import GeometryTruth, of_drive, read_geometry_truth
from dreamdrive.scene.camera import Camera
from tests.streets import bare_street


def asking(index: list[int], size: tuple[int, int], source: str | None = None) -> Estimate:
    camera = Camera(50.0, 50.0, size[0] / 2, size[1] / 2, *size)
    frames = len(index)
    return Estimate(
        cameras=(camera,) * frames,
        held_out=np.zeros(frames, dtype=bool),
        index=np.array(index),
        times_s=0.1 * (np.array(index) - index[0]),
        source=source,
    )


def poses(count: int) -> np.ndarray:
    made = np.tile(np.eye(4), (count, 1, 1))
    made[:, 2, 3] = np.arange(count)
    return made


def write_points(path: Path, u: list[float], v: list[float], depth: list[float]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(path, u=np.array(u), v=np.array(v), depth=np.array(depth))


def edit(path: Path, old: str, new: str) -> None:
    path.write_text(path.read_text().replace(old, new))


def recording(folder: Path) -> Path:
    """A KITTI-like folder of 3 frames of 64x32, points in frame 1."""
    folder.mkdir(exist_ok=True)
    (folder / "poses.txt").write_text("\n".join(" ".join(map(str, p[:3].ravel())) for p in poses(3)))
    k = {"fx": 60.0, "fy": 60.0, "cx": 31.5, "cy": 15.5}
    (folder / "meta.json").write_text(json.dumps({"width": 64, "height": 32, "intrinsics": k}))
    write_points(folder / "lidar_depth" / "0001.npz", [0, 1, 10.4, 63.4], [0, 0.4, 20, 31.4], [9, 7, 20, 50])
    return folder


def pandaset(folder: Path) -> Path:
    """Sweeps 0, 5 and 10 of a camera that looks along y of a world with z up; a box stands 10 m ahead."""
    folder.mkdir(exist_ok=True)
    upright = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
    camera = {
        "width": 64,
        "height": 32,
        "K": [[60.0, 0, 31.5], [0, 60.0, 15.5], [0, 0, 1]],
        "frames": [0, 5, 10],
        "camera_to_world": [upright.tolist()] * 11,
    }
    (folder / "cameras.json").write_text(json.dumps({"cameras": {"side_camera": camera}}))
    box = {"position": [0, 10, 0], "size_wlh": [2, 4, 2], "yaw": 0.0, "motion": "Moving"}
    frames: list[list[object]] = [[] for _ in range(11)]
    frames[5] = [box, {**box, "position": [6, 10, 0], "motion": "Parked"}]
    (folder / "cuboids.json").write_text(json.dumps({"frames": frames}))
    # In the box, behind it, beside it, in the parked one.
    write_points(
        folder / "lidar_depth_side" / "05.npz", [31.5, 33.5, 50, 62], [15.5] * 4, [10.0, 13, 10, 11.9]
    )
    return folder


def test_a_drive_of_the_same_size_is_taken_as_it_is() -> None:
    street = bare_street()
    truth = of_drive(street, asking([1, 3], (80, 48)), Path("world"))
    np.testing.assert_array_equal(truth.depth_m, street.depth_m[[1, 3]])
    assert truth.moving is not None
    assert truth.moving.any()
    np.testing.assert_array_equal(truth.moving, street.moving[[1, 3]])
    np.testing.assert_allclose(truth.cameras[1].world_from_camera, street.cameras[3].world_from_camera)


def test_a_layout_is_drawn_as_the_scene_saw_it(tmp_path: Path) -> None:
    street = bare_street()
    write_layout(street.world.layout, tmp_path / "layout.json")
    truth = read_geometry_truth(tmp_path / "layout.json", asking([1, 3], (80, 48)))
    np.testing.assert_allclose(truth.depth_m, street.depth_m[[1, 3]], atol=1e-4)


def test_a_smaller_scene_takes_the_pixel_under_each_centre() -> None:
    street = bare_street()
    truth = of_drive(street, asking([0], (40, 24)), Path("world"))
    np.testing.assert_array_equal(truth.depth_m[0], street.depth_m[0, 1::2, 1::2])
    camera, true = truth.cameras[0], street.cameras[0]
    assert (camera.fx_px, camera.cx_px) == pytest.approx((true.fx_px / 2, true.cx_px / 2))


def test_of_several_points_in_a_pixel_the_nearest_counts(tmp_path: Path) -> None:
    truth = read_geometry_truth(recording(tmp_path), asking([1, 2], (32, 16)))
    expected = np.zeros((2, 16, 32))
    expected[0, 0, 0], expected[0, 10, 5], expected[0, 15, 31] = 7, 20, 50
    np.testing.assert_array_equal(truth.depth_m, expected)
    assert truth.moving is None
    assert truth.cameras[0].fx_px == 30
    assert truth.cameras[0].cx_px == 16, "the file counts pixels by their index"
    assert truth.cameras[1].world_from_camera[2, 3] == 2


def test_a_crop_moves_points_and_principal_point(tmp_path: Path) -> None:
    folder = recording(tmp_path)
    meta = json.loads((folder / "meta.json").read_text())
    (folder / "meta.json").write_text(json.dumps({**meta, "width": 204, "height": 100}))
    write_points(folder / "lidar_depth" / "0001.npz", [101.5, 0], [49.5, 0], [12.0, 3])
    # The reader of clips scales 204x100 to 102x50 and cuts a column at either side.
    truth = read_geometry_truth(folder, asking([1], (100, 50)))
    assert truth.depth_m[0, 25, 50] == 12
    assert np.count_nonzero(truth.depth_m) == 1, "a point in the column that was cut away"
    assert truth.cameras[0].cx_px == pytest.approx(32 / 2 - 1)


def test_depth_pictures_count_256_levels_a_metre(tmp_path: Path) -> None:
    folder = recording(tmp_path)
    (folder / "lidar_depth" / "0001.npz").unlink()
    picture = np.zeros((32, 64), dtype=np.uint16)
    picture[20, 11] = 20 * 256 + 128
    cv2.imwrite(str(folder / "lidar_depth" / "000001.png"), picture)
    truth = read_geometry_truth(folder, asking([0, 1], (64, 32)))
    assert truth.depth_m[1, 20, 11] == 20.5
    assert np.count_nonzero(truth.depth_m) == 1


def test_a_recording_without_calibration_or_lidar_has_poses_alone(tmp_path: Path) -> None:
    folder = recording(tmp_path)
    (folder / "meta.json").write_text(json.dumps({"width": 64, "height": 32}))
    (folder / "lidar_depth" / "0001.npz").unlink()
    truth = read_geometry_truth(folder, asking([0, 2], (64, 32)))
    assert not truth.calibrated
    assert not truth.depth_m.any()
    assert truth.cameras[1].world_from_camera[2, 3] == 2


def test_points_move_that_lie_in_a_box_that_moves(tmp_path: Path) -> None:
    truth = read_geometry_truth(pandaset(tmp_path), asking([0, 1], (64, 32), "side_camera"))
    row = truth.depth_m[1, 16]
    assert {int(c): float(row[c]) for c in np.flatnonzero(row)} == pytest.approx(
        {32: 10, 34: 13, 50: 10, 62: 11.9}
    )
    assert truth.moving is not None
    assert np.argwhere(truth.moving).tolist() == [[1, 16, 32]]


BAD: dict[str, tuple[Callable[[Path], object], str]] = {
    "nothing": (
        lambda folder: None,
        "PLACE holds no truth: neither layout.json nor cameras.json nor poses.txt; expected a folder of "
        "dreamdrive world make, a layout as JSON, a folder with PandaSet's cameras.json, or one with "
        "poses.txt and meta.json",
    ),
    "no calibration file": (
        lambda folder: (recording(folder) / "meta.json").unlink(),
        "--truth PLACE/meta.json cannot be read: No such file or directory",
    ),
    "no size": (
        lambda folder: (recording(folder) / "meta.json").write_text("{}"),
        "--truth PLACE/meta.json is unusable (calibration: Object missing required field `width`); expected "
        "JSON with width, height and, "
        'where known, intrinsics {"fx", "fy", "cx", "cy"} in pixels',
    ),
    "no depth in a file": (
        lambda folder: np.savez(recording(folder) / "lidar_depth" / "0001.npz", u=np.zeros(2), v=np.zeros(2)),
        "PLACE/lidar_depth/0001.npz lacks the array 'depth'; expected arrays u, v and depth",
    ),
    "lists of different lengths": (
        lambda folder: write_points(recording(folder) / "lidar_depth" / "0001.npz", [1], [1, 2], [3]),
        "PLACE/lidar_depth/0001.npz holds u, v and depth of shapes (1,), (2,) and (1,); expected three "
        "equally long lists of finite numbers, depths above 0",
    ),
    "a depth of 0": (
        lambda folder: write_points(recording(folder) / "lidar_depth" / "0001.npz", [1], [1], [0]),
        "PLACE/lidar_depth/0001.npz holds u, v and depth of shapes (1,), (1,) and (1,); expected three "
        "equally long lists of finite numbers, depths above 0",
    ),
    "a picture of another kind": (
        lambda folder: cv2.imwrite(
            str(recording(folder) / "lidar_depth" / "0000.png"), np.zeros((32, 64, 3), np.uint8)
        ),
        "PLACE/lidar_depth/0000.png holds uint8 of shape (32, 64, 3); expected 16 bits of grey, 256 levels a "
        "metre, 64x32 pixels",
    ),
    "another camera": (
        lambda folder: edit(pandaset(folder) / "cameras.json", "side_camera", "other"),
        "--truth PLACE/cameras.json has the cameras other; none is called like the input, 'side_camera': "
        "name the input folder like its camera",
    ),
    "no matrix": (
        lambda folder: edit(pandaset(folder) / "cameras.json", '"K"', '"k"'),
        "--truth PLACE/cameras.json: side_camera has no usable width, height and K (calibration: "
        "Object missing required field `K`); expected "
        "pixels and a 3x3 matrix",
    ),
    "boxes without a place": (
        lambda folder: edit(pandaset(folder) / "cuboids.json", "position", "place"),
        "--truth PLACE/cuboids.json is damaged (cuboids: Object missing required field "
        "`position` - at `$.frames[5][0]`); expected frames, each a list of boxes "
        "with motion, position, size_wlh and yaw: take it away to do without what moves",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_truth_is_refused_with_what_to_do(tmp_path: Path, name: str) -> None:
    make, expected = BAD[name]
    make(tmp_path)
    with pytest.raises(InputError) as caught:
        read_geometry_truth(tmp_path, asking([0, 1], (64, 32), "side_camera"))
    assert str(caught.value).replace(str(tmp_path), "PLACE") == expected


def test_other_frames_are_refused(tmp_path: Path) -> None:
    folder = recording(tmp_path)
    with pytest.raises(InputError, match="knows 3 frames but the scene shows frame 7 of its source; give"):
        read_geometry_truth(folder, asking([0, 7], (64, 32)))
    with pytest.raises(InputError, match=r"frames are 64x48, those of .* 64x32; expected the same shape"):
        read_geometry_truth(folder, asking([0], (64, 48)))
    with pytest.raises(InputError, match="none does not exist; expected a folder of dreamdrive world make"):
        read_geometry_truth(folder / "none", asking([0], (64, 32)))


def test_arrays_of_another_shape_are_a_mistake_of_the_programmer() -> None:
    estimate = asking([0], (64, 32))
    with pytest.raises(ValueError, match="geometry truth: depth_m of shape"):
        GeometryTruth(estimate.cameras, np.zeros((1, 3, 3)), None)


def test_real_recordings_are_read(data_dir: Path) -> None:
    truth = read_geometry_truth(
        data_dir / "clips/pandaset_002", asking([40, 41, 50], (480, 270), "front_camera")
    )
    shares = (truth.depth_m > 0).mean(axis=(1, 2))
    assert shares[0] > 0.3
    assert shares[1] == 0
    assert truth.moving is not None
    assert 0.05 < truth.moving[0].sum() / (truth.depth_m[0] > 0).sum() < 0.3
    kitti = read_geometry_truth(data_dir / "clips/kitti_odom04_follow_van", asking([0, 5], (480, 144)))
    assert 0.1 < (kitti.depth_m[1] > 0).mean() < 0.5
    assert 6 < np.linalg.norm(kitti.cameras[1].world_from_camera[:3, 3]) < 8, "50 km/h for half a second"
