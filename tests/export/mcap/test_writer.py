"""What is read back of a drive that was recorded step by step."""

import json
import resource
import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.export import DriveRecording, RecordedBox, ground_pose
from dreamdrive.scene.camera import Camera
from tests.logs import mounting

pytest.importorskip("foxglove", reason="needs the extra mcap")
pytest.importorskip("mcap_protobuf", reason="pip install mcap-protobuf-support")

from tests.export.mcap_reader import picture_of, placed, points_of, pose_of, read

START_US = 1_700_000_000_000_000
PINHOLE = Camera(50.0, 51.0, 32.5, 23.5, 64, 48)
SIZE_M = np.array([4.5, 1.9, 1.6])


def ns(time_s: float) -> int:
    return START_US * 1000 + round(time_s * 1e9)


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 256, (48, 64, 3), dtype=np.uint8)


def car(name: str, x_m: float, kind: str = "vehicle.car") -> RecordedBox:
    return RecordedBox(name, kind, ground_pose(x_m, 3.0, 0.3, 0.8), SIZE_M)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "made" / "drive.mcap"


@pytest.fixture
def recording(file: Path) -> DriveRecording:
    return DriveRecording(file, start_us=START_US)


def test_a_picture_is_the_same_as_png_and_alike_as_jpeg(file: Path, recording: DriveRecording) -> None:
    smooth = np.full((48, 64, 3), (200, 100, 30), np.uint8)
    with recording:
        recording.camera("front", PINHOLE, mounting(0.0))
        recording.picture(1 / 3, "front", noise(0), lossless=True)
        recording.picture(0.5, "front", smooth)
    found = read(file)
    topic = "/front/image_rect_compressed"
    assert found.schemas[topic] == "foxglove.CompressedImage"
    first, second = found.at(topic, ns(1 / 3)), found.at(topic, ns(0.5))
    assert (first.format, second.format) == ("png", "jpeg")
    assert first.frame_id == "front"
    assert first.timestamp.ToNanoseconds() == 1_700_000_000_333_333_333
    np.testing.assert_array_equal(picture_of(first), noise(0))
    assert np.abs(picture_of(second).astype(int) - smooth).max() <= 3


def test_calibration_is_told_with_each_picture(file: Path, recording: DriveRecording) -> None:
    with recording:
        recording.camera("front", PINHOLE, mounting(0.0))
        recording.picture(0.0, "front", noise(0))
        recording.picture(0.1, "front", noise(1))
    found = read(file)
    assert (
        found.times("/front/camera_info") == found.times("/front/image_rect_compressed") == [ns(0), ns(0.1)]
    )
    told = found.at("/front/camera_info", ns(0.1))
    assert (told.width, told.height, told.frame_id) == (64, 48, "front")
    assert list(told.K) == [50, 0, 32.5, 0, 51, 23.5, 0, 0, 1]
    assert list(told.P) == [50, 0, 32.5, 0, 0, 51, 23.5, 0, 0, 0, 1, 0]
    assert list(told.R) == np.eye(3).ravel().tolist()
    assert list(told.D) == [0] * 5


def test_one_message_tells_where_car_and_cameras_are(file: Path, recording: DriveRecording) -> None:
    first, second = ground_pose(200.0, 300.0, 2.9, 0.1), ground_pose(201.0, 300.5, -3.0)
    with recording:
        recording.camera("front", PINHOLE, mounting(0.0))
        recording.camera("back", PINHOLE, mounting(1.9))
        recording.pose(0.0, first)
        recording.camera("back", PINHOLE, mounting(2.0))
        recording.pose(0.1, second)
    found = read(file)
    np.testing.assert_allclose(placed(found, ns(0), "base_link"), first, atol=1e-12)
    np.testing.assert_allclose(placed(found, ns(0), "back"), first @ mounting(1.9), atol=1e-12)
    np.testing.assert_allclose(placed(found, ns(0.1), "front"), second @ mounting(0.0), atol=1e-12)
    np.testing.assert_allclose(placed(found, ns(0.1), "back"), second @ mounting(2.0), atol=1e-12)


def test_boxes_replace_those_of_before(file: Path, recording: DriveRecording) -> None:
    with recording:
        recording.boxes(0.0, [car("one", 10.0), car("two", 20.0, "human.pedestrian.adult")])
        recording.boxes(0.5, [car("two", 21.0, "human.pedestrian.adult")])
        recording.boxes(1.0, [])
    found = read(file)
    before = found.at("/markers/annotations", ns(0))
    assert [each.id for each in before.entities] == ["one", "two"]
    assert {each.frame_id for each in before.entities} == {"map"}
    one, two = before.entities
    np.testing.assert_allclose(pose_of(one.cubes[0].pose), car("one", 10.0).world_from_box, atol=1e-12)
    assert (one.cubes[0].size.x, one.cubes[0].size.y, one.cubes[0].size.z) == tuple(SIZE_M)
    assert [(each.key, each.value) for each in two.metadata] == [("category", "human.pedestrian.adult")]
    assert one.cubes[0].color != two.cubes[0].color
    for time_s, names in ((0.5, ["two"]), (1.0, [])):
        update = found.at("/markers/annotations", ns(time_s))
        assert [each.id for each in update.entities] == names
        (deletion,) = update.deletions
        assert deletion.type == 1  # all that are older
        assert deletion.timestamp.ToNanoseconds() == ns(time_s)


def test_points_lie_where_the_lidar_saw_them(file: Path, recording: DriveRecording) -> None:
    points, pose = np.random.default_rng(1).normal(size=(30, 3)) * 20, ground_pose(200.0, 300.0, 0.7, 1.8)
    with recording:
        recording.points(0.2, points, pose)
        recording.points(0.3, points[:0], pose)
    found = read(file)
    assert found.schemas["/LIDAR_TOP"] == "foxglove.PointCloud"
    told = found.at("/LIDAR_TOP", ns(0.2))
    np.testing.assert_allclose(points_of(told), points @ pose[:3, :3].T + pose[:3, 3], atol=1e-4)
    assert points_of(found.at("/LIDAR_TOP", ns(0.3))).shape == (0, 3)


def test_a_plan_is_a_line_that_can_go_away(file: Path, recording: DriveRecording) -> None:
    points = np.array([[0.0, 0, 0], [5, 0.5, 0], [10, 2, 0.1]])
    with recording:
        recording.path(0.0, points)
        recording.path(0.1, points[:0])
    found = read(file)
    (entity,) = found.at("/markers/path", ns(0)).entities
    assert [(each.x, each.y, each.z) for each in entity.lines[0].points] == [tuple(each) for each in points]
    assert len(found.at("/markers/path", ns(0.1)).entities) == 0
    assert len(found.at("/markers/path", ns(0.1)).deletions) == 1


def test_numbers_have_a_schema_to_plot_by(file: Path, recording: DriveRecording) -> None:
    with recording:
        recording.number(0.0, "reward", 0.25)
        recording.number(0.1, "reward", -2.0)
        recording.describe(name="made up")
    found = read(file)
    assert found.schemas["/numbers/reward"] == "Number"
    assert [json.loads(each) for _, each in found.messages["/numbers/reward"]] == [
        {"value": 0.25},
        {"value": -2.0},
    ]
    assert found.facts == {"name": "made up"}


def test_the_same_bytes_again(file: Path, tmp_path: Path) -> None:
    for name in ("one.mcap", "two.mcap"):
        with DriveRecording(tmp_path / name) as recording:
            recording.camera("front", PINHOLE, mounting(0.0))
            for step in range(200):
                recording.pose(step / 10, ground_pose(step, 0, 0))
                recording.picture(step / 10, "front", noise(step), lossless=True)
                recording.number(step / 10, "reward", step)
    assert (tmp_path / "one.mcap").read_bytes() == (tmp_path / "two.mcap").read_bytes()
    assert (tmp_path / "one.mcap").stat().st_size > 1_500_000  # more than one chunk


def test_two_at_a_time_are_kept_apart(tmp_path: Path) -> None:
    with DriveRecording(tmp_path / "a.mcap") as one, DriveRecording(tmp_path / "b.mcap") as other:
        one.number(0.0, "reward", 1.0)
        other.number(0.0, "cost", 2.0)
    assert list(read(tmp_path / "a.mcap").messages) == ["/numbers/reward"]
    assert list(read(tmp_path / "b.mcap").messages) == ["/numbers/cost"]


def test_a_drive_that_fails_leaves_nothing(file: Path, recording: DriveRecording) -> None:
    """Its error is no error of the file, though it is one of input and output."""

    def drive() -> None:
        with recording:
            recording.number(0.0, "reward", 1.0)
            assert not file.exists()
            raise ConnectionError("the policy is gone")

    with pytest.raises(ConnectionError, match="the policy is gone"):
        drive()
    assert not file.parent.exists()


def test_an_older_file_stays_until_a_new_one_is_whole(file: Path) -> None:
    file.parent.mkdir()
    file.write_bytes(b"older")
    with pytest.raises(InputError, match="exists already"):
        DriveRecording(file)
    with pytest.raises(ValueError, match="no"), DriveRecording(file, replace=True):
        raise ValueError("no")
    assert file.read_bytes() == b"older"
    with DriveRecording(file, replace=True) as recording:
        recording.number(0.0, "reward", 1.0)
        assert file.read_bytes() == b"older"
    assert list(read(file).messages) == ["/numbers/reward"]
    assert list(file.parent.iterdir()) == [file]


@contextmanager
def disk_of(most_bytes: int) -> Generator[None, None, None]:
    """Let no file grow beyond a size."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("pictures", [5, 1000])
def test_a_full_disk_is_told(
    file: Path, recording: DriveRecording, capfd: pytest.CaptureFixture[str], pictures: int
) -> None:
    """Few pictures are still in memory when the block ends; many would not be."""
    written: list[int] = []

    def drive() -> None:
        with disk_of(1000), recording:
            recording.camera("front", PINHOLE, mounting(0.0))
            for step in range(pictures):
                recording.picture(step / 10, "front", noise(step), lossless=True)
                written.append(step)

    with pytest.raises(InputError, match=r"cannot write .*drive\.mcap: File too large"):
        drive()
    assert not file.parent.exists()
    assert capfd.readouterr().err == ""
    assert (len(written) == pictures) == (pictures == 5)


def test_what_cannot_be_recorded_is_refused(file: Path, recording: DriveRecording) -> None:
    with recording:
        recording.camera("front", PINHOLE, mounting(0.0))
        with pytest.raises(InputError, match=r"uint8 \(40, 64, 3\); expected uint8 \(48, 64, 3\)"):
            recording.picture(0.0, "front", noise(0)[:40])
        with pytest.raises(InputError, match="camera back is not known"):
            recording.picture(0.0, "back", noise(0))
        with pytest.raises(InputError, match="camera 'map'"):
            recording.camera("map", PINHOLE, mounting(0.0))
        with pytest.raises(InputError, match="reward is nan"):
            recording.number(0.0, "reward", float("nan"))
        for time_s in (float("nan"), -2e9, 1e10):
            with pytest.raises(InputError, match="expected 1970 to 2106"):
                recording.number(time_s, "reward", 1.0)
        with pytest.raises(ValueError, match="the pose of the car"):
            recording.pose(0.0, np.ones((4, 4)))
    with pytest.raises(InputError, match="inside its with block"):
        recording.number(0.0, "reward", 1.0)


@pytest.mark.parametrize("name", ["drive.bag", "drive", "drive.mcap.gz"])
def test_the_name_ends_in_mcap(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match=r"ends in \.mcap"):
        DriveRecording(tmp_path / name)


def test_a_folder_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "drive.mcap").mkdir()
    with pytest.raises(InputError, match="is a folder"):
        DriveRecording(tmp_path / "drive.mcap", replace=True)


def test_the_package_is_asked_for(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "foxglove.channels", None)
    with pytest.raises(InputError, match=r"pip install -e '\.\[mcap\]'"):
        DriveRecording(file)
