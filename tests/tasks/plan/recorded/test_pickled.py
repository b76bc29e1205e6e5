"""Pickles of plain values are read, and nothing in any of them is run."""

import builtins
import codecs
import os
import pickle
import pickletools
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy._core import numeric as np_numeric

from dreamdrive.errors import InputError
from dreamdrive.tasks.plan.recorded import pickled
from dreamdrive.tasks.plan.recorded.pickled import read_pickle

VALUES = {
    "array": np.arange(12.0).reshape(6, 2),
    "columns": np.asfortranarray(np.arange(12, dtype=np.float32).reshape(6, 2)),
    "backwards": np.arange(3.0).astype(">f8"),
    "whole": np.arange(4),
    "number": np.float32(1.5),
    "lists": [[1.0, 2], [3, -4.5e10]],
    "tuples": ((1, 2), (3, 4)),
    "text": "ä",
    "nothing": None,
    "yes": True,
    "deeper": {"x": [1, {"y": 2}]},
}


class Call:
    """What unpickling would call."""

    def __init__(self, called: Any, *args: Any) -> None:
        self.called, self.args = called, args

    def __reduce__(self) -> tuple[Any, ...]:
        return self.called, self.args


def written(folder: Path, data: bytes) -> Path:
    path = folder / "plans.pkl"
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("protocol", [2, 3, 4, 5])
def test_plain_values_come_back(tmp_path: Path, protocol: int) -> None:
    made = read_pickle(written(tmp_path, pickle.dumps(VALUES, protocol)))
    assert isinstance(made, dict)
    assert list(made) == list(VALUES)
    for name in ("array", "columns", "backwards", "whole", "number"):
        np.testing.assert_array_equal(made[name], VALUES[name])
    assert made["lists"] == VALUES["lists"]
    assert made["tuples"] == [[1, 2], [3, 4]]
    for name in ("text", "nothing", "yes", "deeper"):
        assert made[name] == VALUES[name]


def test_names_of_older_numpy_are_known(tmp_path: Path) -> None:
    data = pickle.dumps({"a": np.zeros((6, 2)), "b": np.float64(2)}, 4)
    older = data.replace(b"\x8c\x16numpy._core.multiarray", b"\x8c\x15numpy.core.multiarray")
    assert older != data
    made = read_pickle(written(tmp_path, _without_frames(older)))
    assert isinstance(made, dict)
    assert made["a"].shape == (6, 2)
    assert made["b"] == 2


def _without_frames(data: bytes) -> bytes:
    """A pickle whose frames no longer tell its length, which was changed."""
    place = data.index(b"\x95")
    return data[:place] + data[place + 9 :]


@pytest.mark.parametrize("protocol", [2, 3, 4, 5])
@pytest.mark.parametrize(
    "called",
    [os.unlink, builtins.eval, builtins.getattr, os.remove, np.fromfile, np.load],
    ids=["os.unlink", "eval", "getattr", "os.remove", "fromfile", "numpy.load"],
)
def test_what_calls_functions_is_refused_by_name_and_not_run(
    tmp_path: Path, protocol: int, called: Any
) -> None:
    mark = tmp_path / "ran"
    mark.touch()
    path = written(tmp_path, pickle.dumps({"x": Call(called, f"rm {mark}")}, protocol))
    with pytest.raises(InputError, match=rf"asks for '[\w.]*{called.__name__}'; nothing of it was run"):
        read_pickle(path)
    assert mark.exists()


@pytest.mark.parametrize(
    "value",
    [{"x": {1, 2}}, {"x": np.array(["a"])}, {"x": np.array([None])}, {(1, 2): 3}, {"x": 1j}, {"x": slice(3)}],
    ids=["set", "text", "objects", "tuple as a key", "complex", "slice"],
)
def test_other_values_are_refused(tmp_path: Path, value: Any) -> None:
    with pytest.raises(InputError):
        read_pickle(written(tmp_path, pickle.dumps(value, 4)))


def test_two_entries_of_one_key_are_refused(tmp_path: Path) -> None:
    data = pickle.dumps({"first": 1, "other": 2}, 4).replace(b"other", b"first")
    with pytest.raises(InputError, match="two entries 'first'"):
        read_pickle(written(tmp_path, data))


def test_what_contains_itself_is_refused(tmp_path: Path) -> None:
    loop: list[Any] = []
    loop.append(loop)
    with pytest.raises(InputError, match="nested too deep"):
        read_pickle(written(tmp_path, pickle.dumps({"x": loop})))


def test_what_is_shared_a_million_times_takes_no_time(tmp_path: Path) -> None:
    shared: list[Any] = [1.0] * 100
    for _ in range(5):
        shared = [shared] * 100
    assert isinstance(read_pickle(written(tmp_path, pickle.dumps({"x": shared}))), dict)


def test_a_memory_of_many_places_takes_none(tmp_path: Path) -> None:
    with pytest.raises(InputError):
        read_pickle(written(tmp_path, b"\x80\x02}r\xff\xff\xff\x7fX\xff\xff\xff\x7f."))


@pytest.mark.parametrize("shape", [(2**2000,) * 5000, (2**63, 0), (-1, 0), (1,) * 9, [6, 2]])
def test_a_shape_is_refused_before_it_is_multiplied(tmp_path: Path, shape: Any) -> None:
    """Megabytes of long numbers take a minute to multiply."""
    array = Call(np_numeric._frombuffer, bytes(8), np.dtype("f8"), shape, "C")
    begin_s = time.process_time()
    with pytest.raises(InputError, match=r"an array has (no shape|another size than its shape says)"):
        read_pickle(written(tmp_path, pickle.dumps({"x": array}, 4)))
    assert time.process_time() - begin_s < 2


def test_arrays_without_numbers_have_shapes(tmp_path: Path) -> None:
    made = read_pickle(written(tmp_path, pickle.dumps({"x": np.zeros((0, 6, 2))}, 4)))
    assert isinstance(made, dict)
    assert made["x"].shape == (0, 6, 2)


def test_a_text_that_becomes_many_arrays_fills_no_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pickled, "MOST_BYTES", 10_000)
    text = "x" * 800
    arrays = [
        Call(np_numeric._frombuffer, Call(codecs.encode, text, "latin1"), np.dtype("f8"), (100,), "C")
        for _ in range(20)
    ]
    assert isinstance(read_pickle(written(tmp_path, pickle.dumps(arrays[:12], 4))), list)
    with pytest.raises(InputError, match="its arrays take over 0 MB"):
        read_pickle(written(tmp_path, pickle.dumps(arrays, 4)))


class OddType:
    """A type of NumPy whose state is a table."""

    def __reduce__(self) -> tuple[Any, ...]:
        return np.dtype, ("f8", False, True), {}


def test_a_type_with_a_table_as_its_state_is_refused(tmp_path: Path) -> None:
    array = Call(np_numeric._frombuffer, bytes(8), OddType(), (1,), "C")
    with pytest.raises(InputError, match="is damaged or no pickle"):
        read_pickle(written(tmp_path, pickle.dumps({"x": array}, 4)))


def test_text_instructions_and_endless_ones_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(InputError, match="protocol 2 or higher"):
        read_pickle(written(tmp_path, pickle.dumps({"x": 1.5}, 0)))
    monkeypatch.setattr(pickled, "EXPECTED", replace(pickled.EXPECTED, steps=5))
    with pytest.raises(InputError, match="takes over 5 instructions"):
        read_pickle(written(tmp_path, pickle.dumps([1, 2, 3, 4, 5, 6])))


@settings(max_examples=300)
@given(st.integers(0, 2**32), st.integers(1, 4), st.sampled_from([2, 4, 5]))
def test_damaged_ones_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, seed: int, count: int, protocol: int
) -> None:
    data = bytearray(pickle.dumps({k: np.ones((6, 2)) for k in ("a", "b")} | {"c": [[0.5, 1]]}, protocol))
    rng = np.random.default_rng(seed)
    for _ in range(count):
        data[rng.integers(len(data))] = rng.integers(256)
    path = tmp_path_factory.getbasetemp() / "damaged.pkl"
    path.write_bytes(bytes(data[: rng.integers(len(data) // 2, len(data) + 1)]))
    try:
        read_pickle(path)
    except InputError as error:
        said = str(error)
    else:
        said = str(path)
    assert str(path) in said


def test_the_instructions_of_real_files_are_all_known() -> None:
    """Those that Python writes for dictionaries of arrays and lists, by any protocol from 2 on."""
    for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1):
        used = {each.name for each, _, _ in pickletools.genops(pickle.dumps(VALUES, protocol))}
        assert not used & {"INST", "OBJ", "NEWOBJ", "EXT1", "PERSID"}
