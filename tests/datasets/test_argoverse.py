"""Sensor logs of Argoverse 2: drawn ones, broken ones, and the one that is shared."""

import csv
import gzip
import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from dreamdrive.datasets.argoverse import is_argoverse, read_argoverse
from dreamdrive.errors import InputError
from dreamdrive.scene.street.log import LANE_CENTRE, Log

Table = dict[str, list]
START_NS = 315_973_157_959_879_001
STAMPS_NS = [START_NS + each for each in (0, 100_000_000, 199_999_000, 300_100_000)]
TIMES_S = np.array([0.0, 0.1, 0.199999, 0.3001])
MAP = "log_map_archive_abc____PIT_city_57819.json"
POSES, BOXES = "city_SE3_egovehicle", "annotations"


def pose(x: float, y: float, z: float, yaw: float, pitch: float = 0.0) -> np.ndarray:
    made = np.eye(4)
    made[:3, :3] = Rotation.from_euler("ZY", [yaw, pitch]).as_matrix()
    made[:3, 3] = x, y, z
    return made


def axle(time_s: float, yaw: float = 0.4) -> np.ndarray:
    """World from the rear axle, on a hill; the path is straight, as between poses it is read as straight."""
    return pose(1400 + 8 * time_s, 200 + 3 * time_s, 13 + time_s, yaw, -0.05)


def car(time_s: float) -> np.ndarray:
    return pose(1420 + 10 * time_s, 210, 14, 1.2)


def walker(time_s: float) -> np.ndarray:
    return pose(1405, 195 + time_s, 13.5, -2.0)


def columns_of(matrices: list[np.ndarray]) -> Table:
    turns = Rotation.from_matrix(np.stack(matrices)[:, :3, :3]).as_quat(scalar_first=True)
    numbers = np.column_stack([turns, np.stack(matrices)[:, :3, 3]]).T
    names = ("qw", "qx", "qy", "qz", "tx_m", "ty_m", "tz_m")
    return {name: column.tolist() for name, column in zip(names, numbers, strict=True)}


def tables(yaw: float = 0.4) -> dict[str, Table]:
    """Poses at times that are not those of boxes too, and two things at all times, the last first."""
    pose_ns = sorted({*STAMPS_NS, *(START_NS + 50_000_000 * each for each in range(-1, 8))})
    poses = {"timestamp_ns": pose_ns} | columns_of([axle((ns - START_NS) / 1e9, yaw) for ns in pose_ns])
    rows = [(ns, *each) for ns in STAMPS_NS for each in ((walker, "p", "PEDESTRIAN"), (car, "c", "BUS"))][
        ::-1
    ]
    near = [
        np.linalg.inv(axle((ns - START_NS) / 1e9, yaw)) @ where((ns - START_NS) / 1e9)
        for ns, where, *_ in rows
    ]
    boxes: Table = {
        "timestamp_ns": [row[0] for row in rows],
        "track_uuid": [row[2] for row in rows],
        "category": [row[3] for row in rows],
        "length_m": [11.5] * len(rows),
        "width_m": [2.5] * len(rows),
        "height_m": [3.1] * len(rows),
        "num_interior_pts": list(range(len(rows))),
    }
    return {POSES: poses, BOXES: boxes | columns_of(near)}


def points(*places: tuple[float, float]) -> list[dict[str, float]]:
    return [{"x": x, "y": y, "z": 13.0} for x, y in places]


def lane(kind: str, junction: bool, left: list, right: list) -> dict:
    names = ("left_lane_boundary", "right_lane_boundary")
    return {"lane_type": kind, "is_intersection": junction, **dict(zip(names, (left, right), strict=True))}


def street() -> dict:
    """A lane of 4 m whose right border has fewer points, one in a junction, one for bicycles."""
    ahead = lane(
        "VEHICLE", False, points((1400, 204), (1403, 204), (1410, 204)), points((1400, 200), (1410, 200))
    )
    on = lane("BUS", True, points((1410, 204), (1420, 204)), points((1410, 200), (1420, 200)))
    bikes = lane("BIKE", False, points((1400, 200), (1410, 200)), points((1400, 198), (1410, 198)))
    return {
        "pedestrian_crossings": {
            "7": {
                "id": 7,
                "edge1": points((1411, 200), (1411, 204)),
                "edge2": points((1413, 200), (1413, 204)),
            }
        },
        "lane_segments": {"1": ahead, "2": on, "3": bikes},
        "drivable_areas": {
            "9": {"area_boundary": points((1390, 190), (1430, 190), (1430, 210), (1390, 190))}
        },
    }


def write_csv(path: Path, table: Table, opened: Callable = open) -> None:
    with opened(path, "wt", newline="") as file:
        csv.writer(file).writerows([list(table), *zip(*table.values(), strict=True)])


def write_packed(path: Path, table: Table) -> None:
    write_csv(path, table, gzip.open)


def write_feather(path: Path, table: Table) -> None:
    """As the data set has it: sizes in single precision, in Arrow's file format, packed."""
    pa = pytest.importorskip("pyarrow")
    import pyarrow.ipc as ipc

    kinds = {"timestamp_ns": pa.int64(), "num_interior_pts": pa.int64()}
    made = pa.table({name: pa.array(values, kinds.get(name)) for name, values in table.items()})
    options = ipc.IpcWriteOptions(compression="lz4")
    with pa.OSFile(str(path), "wb") as sink, ipc.new_file(sink, made.schema, options=options) as writer:
        writer.write_table(made, max_chunksize=3)


WRITERS: dict[str, Callable[[Path, Table], None]] = {
    ".csv": write_csv,
    ".csv.gz": write_packed,
    ".feather": write_feather,
}


def write(folder: Path, given: dict[str, Table] | None = None, ending: str = ".csv") -> Path:
    for name, table in (tables() if given is None else given).items():
        WRITERS[ending](folder / f"{name}{ending}", table)
    (folder / "map").mkdir(exist_ok=True)
    (folder / "map" / MAP).write_text(json.dumps(street()))
    return folder


def check(log: Log, yaw: float = 0.4) -> None:
    """That a log is the drawn one."""
    np.testing.assert_allclose(log.times_s, TIMES_S, atol=1e-12)
    lowered = np.eye(4)
    lowered[2, 3] = -0.33
    np.testing.assert_allclose(log.world_from_ego, [axle(t, yaw) @ lowered for t in TIMES_S], atol=1e-9)
    bus, person = log.boxes
    assert (bus.id, bus.category, person.category) == ("c", "vehicle.bus.rigid", "human.pedestrian.adult")
    for box, where in ((bus, car), (person, walker)):
        np.testing.assert_allclose(box.times_s, TIMES_S, atol=1e-12)
        np.testing.assert_allclose(box.world_from_box, [where(t) for t in TIMES_S], atol=1e-9)
        np.testing.assert_allclose(box.size_lwh_m, np.tile([11.5, 2.5, 3.1], (4, 1)))
    assert bus.lidar_points.tolist() == [6, 4, 2, 0]
    assert (bus.visibility == 0).all()


@pytest.mark.parametrize("ending", WRITERS)
def test_all_formats_of_tables_give_the_same_log(tmp_path: Path, ending: str) -> None:
    folder = write(tmp_path, ending=ending)
    log = read_argoverse(folder)
    check(log)
    assert (log.name, log.location, log.problems, log.cameras) == (tmp_path.name, "PIT", (), ())
    assert log.start_us == START_NS // 1000
    assert is_argoverse(folder)


@settings(max_examples=20)
@given(st.floats(-np.pi, np.pi))
def test_boxes_are_where_they_were_however_the_car_points(
    tmp_path_factory: pytest.TempPathFactory, yaw: float
) -> None:
    check(read_argoverse(write(tmp_path_factory.mktemp("log"), tables(yaw))), yaw)


def test_the_map_has_the_layers_of_nuscenes(tmp_path: Path) -> None:
    map = read_argoverse(write(tmp_path)).map
    assert {name: len(each) for name, each in map.areas.items()} == {
        "drivable_area": 1,
        "lane": 1,
        "lane_connector": 1,
        "ped_crossing": 1,
    }
    assert len(map.areas["drivable_area"][0].outline) == 3
    np.testing.assert_array_equal(
        map.areas["ped_crossing"][0].outline, [[1411, 200], [1411, 204], [1413, 204], [1413, 200]]
    )
    one, other = map.lines[LANE_CENTRE]
    np.testing.assert_allclose(one, np.column_stack([np.linspace(1400, 1410, 11), np.full(11, 202)]))
    np.testing.assert_array_equal(one[-1], other[0])


@pytest.mark.parametrize("name", [POSES, BOXES])
def test_a_missing_table_is_named(tmp_path: Path, name: str) -> None:
    (write(tmp_path) / f"{name}.csv").unlink()
    assert not is_argoverse(tmp_path)
    with pytest.raises(InputError, match=rf"lacks the table {name}.feather, without which"):
        read_argoverse(tmp_path)


@pytest.mark.parametrize("ending", WRITERS)
@pytest.mark.parametrize(("name", "column"), [(POSES, "qy"), (BOXES, "category"), (BOXES, "timestamp_ns")])
def test_a_missing_column_is_named(tmp_path: Path, name: str, column: str, ending: str) -> None:
    given_ = tables()
    del given_[name][column]
    with pytest.raises(InputError, match=rf"{name}{ending} has no columns {column}; expected"):
        read_argoverse(write(tmp_path, given_, ending))


@pytest.mark.parametrize(
    ("column", "value"), [("tx_m", np.nan), ("tz_m", np.inf), ("qw", np.nan), ("qx", 3.0), ("ty_m", 1e9)]
)
def test_a_pose_that_is_none_is_named(tmp_path: Path, column: str, value: float) -> None:
    given_ = tables()
    given_[POSES][column][4] = value
    with pytest.raises(InputError, match=rf"{POSES}.csv: row 5: expected finite places in metres"):
        read_argoverse(write(tmp_path, given_))


@pytest.mark.parametrize(
    ("name", "column", "value", "said"),
    [
        (POSES, "tx_m", "here", "column tx_m holds what is no number"),
        (BOXES, "timestamp_ns", 1.5, "column timestamp_ns holds what is no whole number"),
        (BOXES, "timestamp_ns", -5, "column timestamp_ns holds what is no whole number of 0 or more"),
        (BOXES, "timestamp_ns", 10**30, "column timestamp_ns holds what is no whole number"),
    ],
)
def test_values_of_another_kind_are_named(
    tmp_path: Path, name: str, column: str, value: object, said: str
) -> None:
    given_ = tables()
    given_[name][column][0] = value
    with pytest.raises(InputError, match=said):
        read_argoverse(write(tmp_path, given_))


def test_boxes_need_poses_at_their_times(tmp_path: Path) -> None:
    given_ = tables()
    given_[POSES] = {name: values[:4] for name, values in given_[POSES].items()}
    with pytest.raises(InputError, match="expected poses at all times of boxes"):
        read_argoverse(write(tmp_path, given_))


def test_an_empty_table_is_named(tmp_path: Path) -> None:
    given_ = tables()
    for name, said in ((BOXES, "the table annotations is empty"), (POSES, "it is empty")):
        emptied = given_ | {name: {column: [] for column in given_[name]}}
        with pytest.raises(InputError, match=said):
            read_argoverse(write(tmp_path, emptied))


def test_broken_boxes_are_left_out_and_said(tmp_path: Path) -> None:
    given_ = tables()
    boxes = given_[BOXES]
    boxes["width_m"][0] = np.nan
    boxes["category"][1] = "HOVERCRAFT"
    for column in boxes.values():
        column.append(column[2])
    log = read_argoverse(write(tmp_path, given_))
    assert [len(box.times_s) for box in log.boxes] == [3, 3]
    said = " ".join(log.problems)
    for part in ("1 boxes have no usable numbers", "not known and their boxes left out: HOVERCRAFT", "twice"):
        assert part in said
    assert len(log.problems) == 3


def test_a_log_without_a_usable_box_has_none(tmp_path: Path) -> None:
    given_ = tables()
    given_[BOXES]["category"] = ["HOVERCRAFT"] * len(given_[BOXES]["category"])
    assert read_argoverse(write(tmp_path, given_)).boxes == ()


def no_map(folder: Path) -> None:
    shutil.rmtree(folder)


def two_maps(folder: Path) -> None:
    shutil.copy(folder / MAP, folder / f"{MAP[:-5]}b.json")


def cut_off(folder: Path) -> None:
    (folder / MAP).write_text("{")


def without_layers(folder: Path) -> None:
    (folder / MAP).write_text("{}")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (no_map, "found none: there is no map"),
        (two_maps, "expected one map"),
        (cut_off, "there is no map"),
        (without_layers, "missing required field"),
    ],
)
def test_without_a_map_the_rest_works(tmp_path: Path, change: Callable[[Path], object], said: str) -> None:
    write(tmp_path)
    change(tmp_path / "map")
    log = read_argoverse(tmp_path)
    assert not log.map
    assert said in log.problems[0]
    check(log)


def test_shapes_that_enclose_nothing_are_left_out(tmp_path: Path) -> None:
    given_ = street()
    given_["lane_segments"]["1"]["left_lane_boundary"] = points((1400, 204))
    given_["drivable_areas"]["9"]["area_boundary"] = points((1400, 204), (1401, 204), (1400, 204))
    (write(tmp_path) / "map" / MAP).write_text(json.dumps(given_))
    log = read_argoverse(tmp_path)
    assert len(log.map.lines[LANE_CENTRE]) == 1
    assert [part in said for part, said in zip(("1 lanes", "1 areas"), log.problems, strict=True)] == [
        True
    ] * 2


def test_feather_without_pyarrow_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path, ending=".feather")
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match=r"pip install -e '\.\[argoverse\]', or give the table as .csv"):
        read_argoverse(tmp_path)
    write(tmp_path)  # beside them
    check(read_argoverse(tmp_path))


@pytest.mark.parametrize("ending", WRITERS)
@given(at=st.floats(0, 1), value=st.integers(0, 255), cut=st.booleans(), name=st.sampled_from([POSES, BOXES]))
@settings(max_examples=40)
def test_damaged_tables_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, ending: str, at: float, value: int, cut: bool, name: str
) -> None:
    folder = write(tmp_path_factory.mktemp("log"), ending=ending)
    file = folder / f"{name}{ending}"
    data = bytearray(file.read_bytes())
    place = min(int(at * len(data)), len(data) - 1)
    data[place] = value
    file.write_bytes(data[:place] if cut else data)
    try:
        log = read_argoverse(folder)
    except InputError as error:
        assert str(tmp_path_factory.getbasetemp()) in str(error)  # noqa: PT017
    else:
        assert np.isfinite(log.world_from_ego).all()


def test_the_shared_log(data_dir: Path) -> None:
    folder = data_dir / "planning" / "av2_adcf7d18"
    if not folder.is_dir():
        pytest.skip(f"DREAMDRIVE_DATA ({data_dir}) lacks planning/av2_adcf7d18")
    log = read_argoverse(folder)
    assert log.problems == ()
    assert len(log.times_s) == 156
    assert len(log.boxes) == 146
    assert 35 < np.linalg.norm(np.diff(log.world_from_ego[:, :2, 3], axis=0), axis=1).sum() < 40
    # Who drives ahead stands on the road as the car does: its box ends where the car's frame begins.
    near = [
        (
            np.linalg.inv(pose)
            @ box.world_from_box[box.row_at(float(t_s))]
            @ [0, 0, -box.size_lwh_m[0, 2] / 2, 1]
        )
        for t_s, pose in zip(log.times_s[::10], log.world_from_ego[::10], strict=True)
        for box in log.boxes
        if box.category == "vehicle.car" and box.times_s[0] <= t_s <= box.times_s[-1]
    ]
    heights = [place[2] for place in near if abs(place[1]) < 2 and 0 < place[0] < 20]
    assert len(heights) > 5
    assert abs(np.median(heights)) < 0.3


def test_lanes_as_long_as_none_is_are_left_out(tmp_path: Path) -> None:
    folder = write(tmp_path)
    given = street()
    given["lane_segments"]["1"]["left_lane_boundary"][0]["x"] = -9e6
    (folder / "map" / MAP).write_text(json.dumps(given))
    log = read_argoverse(folder)
    assert "1 lanes have no borders, or such of over 10 km, and are left out" in log.problems[0]
    assert len(log.map.lines[LANE_CENTRE]) == 1
    given = street()
    for name in range(20_000):
        given["lane_segments"][f"more {name}"] = given["lane_segments"]["1"]
    for point in given["lane_segments"]["1"]["left_lane_boundary"][:1]:
        point["x"] -= 1000
    (folder / "map" / MAP).write_text(json.dumps(given))
    log = read_argoverse(folder)
    assert "km of lanes; expected those around one drive" in str(log.problems)
    assert not log.map
