"""Pickles are read and never run."""

import builtins
import gzip
import os
import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dreamdrive.datasets.pandaset.restricted import BOXES, SWEEP, read_pickle
from dreamdrive.datasets.pandaset.tables import read_table
from dreamdrive.errors import InputError
from dreamdrive.files.pickles import Made, Name
from tests.datasets.pandaset.pickles import table_bytes

TABLE = {
    "uuid": ["a", "b", "c"],
    "yaw": [0.5, -1.5, 3.0],
    "camera_used": np.array([-1, 2, 3]),
    "told": np.array(["Moving", np.nan, "Parked"], dtype=object),
    "stationary": [True, False, True],
    "z": [1.0, 2.0, 3.0],
}


class Call:
    """What unpickling would call."""

    def __init__(self, called: Any, *args: Any) -> None:
        self.called, self.args = called, args

    def __reduce__(self) -> tuple[Any, ...]:
        return self.called, self.args


def written(folder: Path, data: bytes, name: str = "00.pkl") -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("new", [False, True])
@pytest.mark.parametrize("name", ["00.pkl", "00.pkl.gz"])
def test_a_table_keeps_its_columns(tmp_path: Path, new: bool, name: str) -> None:
    data = table_bytes(TABLE, new)
    table = read_table(written(tmp_path, gzip.compress(data) if name.endswith("gz") else data, name), SWEEP)
    assert set(table) == set(TABLE)
    for key in ("yaw", "camera_used", "stationary", "z"):
        np.testing.assert_array_equal(table[key], TABLE[key])
    assert table["uuid"].tolist() == TABLE["uuid"]
    assert table["told"].tolist()[::2] == ["Moving", "Parked"]
    assert np.isnan(table["told"][1])


@pytest.mark.parametrize("new", [False, True])
def test_a_table_in_columns_of_memory_is_the_same(tmp_path: Path, new: bool) -> None:
    """numpy pickles arrays that lie in columns as such."""
    columns = {name: np.arange(4.0) + k for k, name in enumerate("xyz")}
    table = read_table(written(tmp_path, table_bytes(columns, new, order="F")), SWEEP)
    for name, column in columns.items():
        np.testing.assert_array_equal(table[name], column)


@pytest.mark.parametrize("protocol", [2, 3, 4, 5])
@pytest.mark.parametrize(
    "called",
    [os.system, builtins.eval, builtins.getattr, os.remove],
    ids=["os.system", "eval", "getattr", "os.remove"],
)
def test_what_calls_functions_is_refused_and_not_run(tmp_path: Path, protocol: int, called: Any) -> None:
    mark = tmp_path / "ran"
    mark.touch()
    data = pickle.dumps({"x": Call(called, f"rm {mark}")}, protocol=protocol)
    path = written(tmp_path, gzip.compress(data), "00.pkl.gz")
    with pytest.raises(InputError, match=r"asks for .*nothing of it was run"):
        read_pickle(path, SWEEP)
    assert mark.is_file()


def test_a_known_name_is_written_down_and_not_called(tmp_path: Path) -> None:
    made = read_pickle(written(tmp_path, pickle.dumps(slice(1, 2, 3))), SWEEP)
    assert isinstance(made, Made)
    assert (made.name, made.args) == ("slice", (1, 2, 3))
    assert read_pickle(written(tmp_path, pickle.dumps(slice)), SWEEP) == Name("slice")


@pytest.mark.parametrize(
    "data",
    [
        pytest.param(b"", id="empty"),
        pytest.param(b"\x80\x03", id="no end"),
        pytest.param(b"\x80\x03.", id="no value"),
        pytest.param(b"\x80\x03h\x05.", id="nothing remembered"),
        pytest.param(b"\x80\x03Nb.", id="a state of nothing"),
        pytest.param(b"\x80\x03NNR.", id="a call of nothing"),
        pytest.param(b"\x80\x03e.", id="no mark"),
        pytest.param(b"\x80\x03}(]Nu.", id="a list as a key"),
        pytest.param(b"\x80\x03cbuiltins\nslice\n)\x81}b(i__main__\nx\n.", id="an instance"),
        pytest.param(b"\x80\x03P1\n.", id="from outside"),
        pytest.param(b"\x80\x04NN\x93.", id="names that are no text"),
        pytest.param(b"\x80\x03\x82\x01.", id="a registered class"),
        pytest.param(b"\x1f\x8b\x08nothing", id="no gzip"),
    ],
)
def test_what_is_broken_is_told(tmp_path: Path, data: bytes) -> None:
    with pytest.raises(InputError, match=r"damaged|cut short"):
        read_pickle(written(tmp_path, data), SWEEP)


def test_a_table_that_is_cut_off_is_told(tmp_path: Path) -> None:
    data = gzip.compress(table_bytes(TABLE))
    with pytest.raises(InputError, match="cut short"):
        read_table(written(tmp_path, data[: len(data) // 2]), SWEEP)
    with pytest.raises(InputError, match="damaged"):
        read_table(written(tmp_path, table_bytes(TABLE)[:-40]), SWEEP)
    with pytest.raises(InputError, match="cannot be read"):
        read_table(tmp_path / "missing.pkl.gz", SWEEP)


def test_what_unpacks_to_too_much_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="unpacks to over"):
        read_pickle(
            written(tmp_path, gzip.compress(bytes(1_000_000))), replace(SWEEP, unpacked_bytes=100_000)
        )
    with pytest.raises(InputError, match="instructions"):
        read_pickle(written(tmp_path, pickle.dumps(list(range(100)))), replace(SWEEP, steps=50))


@pytest.mark.parametrize(
    "columns", [{"z": np.zeros(BOXES.rows + 1)}, {f"c{k}": [1.0] for k in range(65)}], ids=["rows", "columns"]
)
def test_a_table_of_far_more_than_a_time_has_is_refused(tmp_path: Path, columns: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=r"an array has the shape \(.*at most \d+ rows"):
        read_table(written(tmp_path, gzip.compress(table_bytes(columns))), BOXES)


def test_large_numbers_to_remember_take_no_memory(tmp_path: Path) -> None:
    """The unpickler of Python takes sixteen bytes for each number below."""
    assert read_pickle(written(tmp_path, b"\x80\x03Nr\xff\xff\xff\x7f."), SWEEP) is None


@pytest.mark.parametrize("value", [{"x": 1}, [1.0], "text", None, slice(2)])
def test_what_is_no_table_is_told(tmp_path: Path, value: object) -> None:
    with pytest.raises(InputError, match="holds no table"):
        read_table(written(tmp_path, pickle.dumps(value)), SWEEP)


def test_nested_keys_do_not_take_for_ever(tmp_path: Path) -> None:
    nested: Any = ()
    for _ in range(60):
        nested = (nested, nested)
    data = pickle.dumps([nested])[:-1] + b"}" + b"j\x00\x00\x00\x00" + b"Ns."
    with pytest.raises(InputError):
        read_table(written(tmp_path, data), SWEEP)
    with pytest.raises(InputError):
        read_table(written(tmp_path, pickle.dumps(nested)), SWEEP)


@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = written(tmp_path_factory.getbasetemp(), data)
    with pytest.raises(InputError):
        read_table(path, SWEEP)


@given(st.data())
def test_a_damaged_table_is_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """Whatever byte is another: the columns are of one length, or ``InputError`` is raised."""
    raw = bytearray(table_bytes(TABLE, data.draw(st.booleans())))
    for _ in range(data.draw(st.integers(1, 4))):
        raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    path = written(tmp_path_factory.getbasetemp(), bytes(raw))
    try:
        table = read_table(path, SWEEP)
    except InputError:
        return
    assert len({len(column) for column in table.values()}) == 1
