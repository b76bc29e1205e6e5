import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st
from scipy.spatial.transform import Rotation

from dreamdrive.data import read_trajectory, write_trajectory
from dreamdrive.data.cameras.poses import of_frames, read_pose_file, to_first
from dreamdrive.errors import InputError
from dreamdrive.scene.trajectory import Trajectory


def drive(count: int, seed: int = 0) -> np.ndarray:
    """Random rigid poses a few metres apart."""
    rng = np.random.default_rng(seed)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = Rotation.from_rotvec(rng.normal(0, 0.4, (count, 3))).as_matrix()
    poses[:, :3, 3] = rng.normal(0, 5, (count, 3)).cumsum(axis=0) + 100
    return poses


def kitti(poses: np.ndarray) -> str:
    return "\n".join(" ".join(f"{x:.9e}" for x in p[:3].ravel()) for p in poses) + "\n"


def read(path: Path, index: list[int], count: int, fps: float = 10.0, camera: str = "front_camera"):
    """As the clip reader calls it."""
    rows = read_pose_file(path, "--poses", camera)
    return of_frames(rows, np.array(index), np.array(index) / fps, lambda: count)


@pytest.fixture
def write(tmp_path):
    def write(text: object, name: str = "poses.txt") -> Path:
        path = tmp_path / name
        path.write_text(text if isinstance(text, str) else json.dumps(text))
        return path

    return write


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=30)
@given(st.integers(1, 8), st.integers(0, 99), st.sampled_from(["a.json", "a.txt", "a.tum"]))
def test_a_trajectory_survives_the_disk(tmp_path, count, seed, name):
    times = np.cumsum(np.random.default_rng(seed).uniform(0.01, 1, count))
    trajectory = Trajectory(drive(count, seed), times)
    write_trajectory(trajectory, tmp_path / name)
    again = read_trajectory(tmp_path / name)
    np.testing.assert_array_equal(again.times_s, times)
    np.testing.assert_allclose(again.world_from_camera, trajectory.world_from_camera, atol=1e-12)


def test_an_unwritable_place_is_refused(tmp_path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="cannot write"):
        write_trajectory(Trajectory(drive(2), np.arange(2.0)), tmp_path / "file" / "a.json")


def test_one_pose_per_source_frame_is_selected(write):
    poses = drive(20)
    got, notes = read(write(kitti(poses)), [4, 7, 10], 20)
    np.testing.assert_allclose(got, np.linalg.inv(poses[4]) @ poses[[4, 7, 10]], atol=1e-6)
    np.testing.assert_array_equal(got[0], np.eye(4))
    assert notes == ()


def test_one_pose_per_selected_frame_is_taken_in_order(write):
    poses = drive(3)
    got, _ = read(write(kitti(poses)), [4, 7, 10], 20)
    np.testing.assert_allclose(got, np.linalg.inv(poses[0]) @ poses, atol=1e-6)


def test_every_format_gives_the_same_poses(write, tmp_path):
    poses, times = drive(6), np.arange(6) / 10
    write_trajectory(Trajectory(poses, times), tmp_path / "t.json")
    write_trajectory(Trajectory(poses, times), tmp_path / "t.tum")
    cameras = {"front_camera": {"camera_to_world": poses.tolist(), "frames": list(range(6))}, "left": {}}
    files = [
        tmp_path / "t.json",
        tmp_path / "t.tum",
        write(kitti(poses)),
        write({"cameras": cameras}, "c.json"),
    ]
    expected = to_first(poses[[1, 3, 5]])
    for path in files:
        np.testing.assert_allclose(read(path, [1, 3, 5], 6)[0], expected, atol=1e-6)


def test_a_camera_with_fewer_images_than_poses_says_which(write):
    poses = drive(10)
    cameras = {"left": {"camera_to_world": poses.tolist(), "frames": [0, 5, 9]}}
    got, _ = read(write({"cameras": cameras}), [0, 1, 2], 3, camera="left")
    np.testing.assert_allclose(got, to_first(poses[[0, 5, 9]]), atol=1e-9)
    with pytest.raises(InputError, match="cameras left; none is called like the input, 'right'"):
        read(write({"cameras": cameras}), [0, 1, 2], 3, camera="right")


@pytest.mark.parametrize("start_s", [0.0, 1.5e9])
def test_poses_of_another_rate_are_matched_by_time(write, start_s):
    poses = drive(101)
    text = "".join(
        f"{start_s + i / 50:.9f} {' '.join(map(str, p[:3, 3]))} "
        f"{' '.join(map(str, Rotation.from_matrix(p[:3, :3]).as_quat()))}\n"
        for i, p in enumerate(poses)
    )
    got, notes = read(write("# a comment\n" + text), [2, 4, 9], 20)
    np.testing.assert_allclose(got, to_first(poses[[10, 20, 45]]), atol=1e-6)
    assert bool(notes) == (start_s > 0)


def tum(poses: np.ndarray, times_s: np.ndarray) -> str:
    quaternions = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
    table = np.column_stack([times_s, poses[:, :3, 3], quaternions])
    return "\n".join(" ".join(f"{x:.9f}" for x in row) for row in table)


@pytest.mark.parametrize(
    ("times_s", "index", "fps"),
    [(np.arange(16.0), range(16), "1"), (np.arange(8) / 10, range(0, 16, 2), "20")],
)
def test_times_that_do_not_fit_count_more_than_a_number_that_does(write, times_s, index, fps):
    path = write(tum(drive(len(times_s)), times_s))
    with pytest.raises(InputError, match=rf"a pose for each frame, but its times span .* give --fps {fps},"):
        read(path, list(index), 16)


@pytest.mark.parametrize("clock", [lambda t: t, lambda t: t + 1.5e9, lambda t: 1.01 * t + 3])
def test_a_clock_of_its_own_start_and_pace_is_no_matter(write, clock):
    poses = drive(12)
    got, notes = read(write(tum(poses, clock(np.arange(12) / 10))), list(range(12)), 12)
    np.testing.assert_allclose(got, to_first(poses), atol=1e-6)
    assert notes == ()


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
@pytest.mark.parametrize("name", ["p.txt", "p.json"])
def test_text_as_other_editors_save_it_is_read(tmp_path, encoding, name):
    poses, times_s = drive(4), np.arange(4) / 10
    write_trajectory(Trajectory(poses, times_s), tmp_path / name)
    (tmp_path / name).write_bytes((tmp_path / name).read_text().replace("\n", "\r\n").encode(encoding))
    got, _ = read(tmp_path / name, [0, 1, 2, 3], 4)
    np.testing.assert_allclose(got, to_first(poses), atol=1e-9)


def test_poses_too_far_from_the_frames_are_refused(write, tmp_path):
    write_trajectory(Trajectory(drive(7), np.arange(7.0)), tmp_path / "t.json")
    with pytest.raises(InputError, match=r"a frame lies .* at most half a frame \(0.05 s\)"):
        read(tmp_path / "t.json", [0, 1, 2], 20)


def test_a_number_of_poses_that_fits_nothing_is_refused(write):
    with pytest.raises(InputError, match="has 5 poses, but the input has 20 frames, 3 of them"):
        read(write(kitti(drive(5))), [0, 1, 2], 20)


def spoilt(change: str) -> np.ndarray:
    poses = drive(4)
    if change == "nan":
        poses[2, 0, 3] = np.nan
    elif change == "scale":
        poses[2, :3, :3] *= 1.1
    elif change == "mirror":
        poses[2, :3, 0] *= -1
    return poses


@pytest.mark.parametrize(
    ("change", "words"), [("nan", "NaN"), ("scale", "not rigid"), ("mirror", "not rigid")]
)
def test_bad_poses_are_refused_with_their_row(write, change, words):
    poses = spoilt(change)
    with pytest.raises(InputError, match=rf"line 3.*{words}"):
        read(write(kitti(poses)), [0, 1, 2, 3], 4)
    values = {"world_from_camera": poses.tolist(), "times_s": [0, 1, 2, 3]}
    in_json = (
        "NaN or Infinity, which JSON has not" if change == "nan" else rf"pose 2 \(counted from 0\).*{words}"
    )
    with pytest.raises(InputError, match=in_json):
        read(write(values, "t.json"), [0, 1, 2, 3], 4)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no poses"),
        ("1 2 3\n", "3 numbers a line"),
        ("one two\n", "line 1 is not made of numbers"),
        ("0 0 0 0 0 0 0 1\n1 2\n", "line 2 has 2 numbers"),
        ("0 0 0 0 0 0 0 2\n", "quaternion has length 2"),
        ("0 0 0 0 0 0 0 nan\n", "quaternion has length nan"),
        ("1 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n", "line 2: time 1; expected finite, increasing"),
        ('{"cameras": 3}', "has the cameras ; none"),
        ('{"x": 3}', "expected Trajectory JSON"),
        ('{"world_from_camera": [[1]], "times_s": [0]}', "shape"),
        ('{"world_from_camera": [[1], [1, 2]], "times_s": [0]}', "expected arrays of numbers"),
        ("[1, 2]", "expected a JSON object"),
        ('{"world_from_camera": ', "is not JSON"),
    ],
)
def test_malformed_files_are_refused(write, text, words):
    with pytest.raises(InputError, match=words):
        read(write(text), [0, 1], 2)


def test_times_must_match_the_poses(write):
    values = {"world_from_camera": drive(3).tolist(), "times_s": [0, 1]}
    with pytest.raises(InputError, match="3 poses, but times_s"):
        read_trajectory(write(values, "t.json"))


def test_a_trajectory_needs_times(write):
    with pytest.raises(InputError, match="poses but no times"):
        read_trajectory(write(kitti(drive(3))))


def test_files_that_are_not_text_are_refused(tmp_path):
    (tmp_path / "p.txt").write_bytes(b"\x81\xfe\x00")
    for path in (tmp_path / "p.txt", tmp_path / "none.txt"):
        with pytest.raises(InputError, match="cannot be read"):
            read(path, [0, 1], 2)


def test_golden_the_poses_of_real_clips(data_dir):
    path = data_dir / "clips/kitti_odom06_avenue/poses.txt"
    got, _ = read(path, list(range(0, 48, 2)), 51)
    table = np.loadtxt(path).reshape(-1, 3, 4)
    np.testing.assert_allclose(
        np.linalg.norm(got[-1, :3, 3]), np.linalg.norm(table[46, :, 3] - table[0, :, 3]), rtol=1e-6
    )
    got, _ = read(data_dir / "clips/pandaset_002/cameras.json", list(range(20, 68, 2)), 80)
    assert np.linalg.norm(np.diff(got[:, :3, 3], axis=0), axis=1).sum() == pytest.approx(14.3, abs=0.1)
    assert got[-1, 2, 3] > 14
