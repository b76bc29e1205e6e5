"""Points of a lidar in the files of three data sets."""

import gzip
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays

from dreamdrive.datasets import lidar_file
from dreamdrive.datasets.lidar_file import read_points
from dreamdrive.errors import InputError
from tests.datasets.pandaset.pickles import table_bytes

POINTS = np.array([[1.5, -2.25, 0.5], [100.0, 0.125, -1.75]])


@pytest.mark.parametrize(("name", "columns"), [("a.pcd.bin", 5), ("000000.bin", 4)])
def test_floats_of_nuscenes_and_kitti(tmp_path: Path, name: str, columns: int) -> None:
    rows = np.zeros((4, columns), "<f4")
    rows[:2, :3] = POINTS
    rows[2, 1], rows[3, 0] = np.nan, np.inf
    rows[0, 3] = np.nan
    (tmp_path / name).write_bytes(rows.tobytes())
    points = read_points(tmp_path / name)
    assert points.dtype == np.float64
    np.testing.assert_array_equal(points, POINTS)


@pytest.mark.parametrize("name", ["00.pkl", "00.pkl.gz"])
def test_tables_of_pandaset(tmp_path: Path, name: str) -> None:
    table = {axis: np.append(POINTS[:, k], np.nan) for k, axis in enumerate("xyz")} | {"d": np.zeros(3, int)}
    data = table_bytes(table)
    (tmp_path / name).write_bytes(gzip.compress(data) if name.endswith("gz") else data)
    np.testing.assert_array_equal(read_points(tmp_path / name), POINTS)


def test_no_points_are_points(tmp_path: Path) -> None:
    (tmp_path / "a.bin").touch()
    assert read_points(tmp_path / "a.bin").shape == (0, 3)


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("a.pcd.bin", bytes(5 * 4 + 1), "holds 21 bytes; expected whole points of 5 float32"),
        ("a.bin", bytes(4 * 4 + 4), "holds 20 bytes; expected whole points of 4 float32"),
        ("a.ply", b"", "expected lidar points as .pcd.bin, .bin, .pkl.gz, .pkl"),
        ("a.pkl", table_bytes({"x": [1.0], "y": [1.0]}), "has no columns z"),
        ("a.pkl", table_bytes({"x": ["far"], "y": [1.0], "z": [1.0]}), "hold what is no number"),
        ("a.pkl.gz", b"\x1f\x8b", "cut short"),
    ],
)
def test_what_holds_no_points_is_told(tmp_path: Path, name: str, data: bytes, said: str) -> None:
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=said):
        read_points(tmp_path / name)


def test_a_missing_file_and_one_too_large_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_points(tmp_path / "a.bin")
    monkeypatch.setattr(lidar_file, "_MOST_BYTES", 100)
    (tmp_path / "a.bin").write_bytes(bytes(160))
    with pytest.raises(InputError, match="expected at most"):
        read_points(tmp_path / "a.bin")


@given(arrays("<f4", st.tuples(st.integers(0, 20), st.just(4))))
def test_all_points_are_finite(tmp_path_factory: pytest.TempPathFactory, rows: np.ndarray) -> None:
    path = tmp_path_factory.getbasetemp() / "any.bin"
    path.write_bytes(rows.tobytes())
    points = read_points(path)
    kept = (np.abs(rows[:, :3].astype(float)) <= 1e7).all(axis=1)
    np.testing.assert_array_equal(points, rows[kept, :3])


@pytest.mark.filterwarnings("error")
def test_numbers_that_signal_are_left_out(tmp_path: Path) -> None:
    rows = np.zeros((2, 4), "<f4")
    rows.view("<u4")[0, 0] = 0x7F800001  # a NaN that signals
    (tmp_path / "a.bin").write_bytes(rows.tobytes())
    assert len(read_points(tmp_path / "a.bin")) == 1
