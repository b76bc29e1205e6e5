"""Feather files tell what they unpack to; what is far too much is never unpacked."""

import importlib
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dreamdrive.datasets.argoverse.tables import MOST_ROWS, read_table
from dreamdrive.datasets.argoverse.unpacked import rows_and_bytes
from dreamdrive.errors import InputError

pa = pytest.importorskip("pyarrow", reason="reading feather needs pyarrow, which the extra dev brings")
feather = importlib.import_module("pyarrow.feather")


def written(path: Path, columns: dict[str, Any], compression: str) -> bytes:
    feather.write_feather(pa.table(columns), str(path), compression=compression)
    return path.read_bytes()


def messages(data: bytes) -> list[Any]:
    return [m for m in pa.ipc.MessageReader.open_stream(pa.py_buffer(data[8:])) if m.type != "schema"]


@pytest.mark.parametrize("compression", ["zstd", "lz4", "uncompressed"])
def test_rows_and_bytes_are_those_of_the_table(tmp_path: Path, compression: str) -> None:
    columns = {"a": np.arange(5000), "b": np.zeros(5000), "c": pa.array(["x"] * 5000).dictionary_encode()}
    data = written(tmp_path / "a.feather", columns, compression)
    found = [
        rows_and_bytes(m.metadata.to_pybytes(), m.body.to_pybytes(), dictionary=m.type == "dictionary")
        for m in messages(data)
    ]
    assert [rows for rows, _ in found] == [1, 5000]
    assert found[1][1] == pytest.approx(5000 * 20, rel=0.05)


def test_a_file_that_unpacks_to_gigabytes_is_refused_at_once(tmp_path: Path) -> None:
    written(tmp_path / "boxes.feather", {"a": np.zeros(8_000_000)}, "zstd")
    before = pa.total_allocated_bytes()
    with pytest.raises(InputError, match=f"over {MOST_ROWS} rows"):
        read_table(tmp_path, "boxes", {"a": float})
    assert pa.total_allocated_bytes() - before < 1_000_000
    written(tmp_path / "boxes.feather", {"a": ["x" * 1000] * 60_000}, "zstd")
    with pytest.raises(InputError, match="unpacks to over 50 MB"):
        read_table(tmp_path, "boxes", {"a": str})


def test_too_many_lines_are_refused(tmp_path: Path) -> None:
    (tmp_path / "boxes.csv").write_text("a\n" + "1\n" * (MOST_ROWS + 1))
    with pytest.raises(InputError, match=f"over {MOST_ROWS} rows"):
        read_table(tmp_path, "boxes", {"a": int})


@given(st.data())
def test_damaged_messages_are_read_or_refused(tmp_path_factory: pytest.TempPathFactory, data: Any) -> None:
    path = tmp_path_factory.mktemp("feather") / "boxes.feather"
    made = bytearray(written(path, {"a": np.arange(50), "b": ["x"] * 50}, "zstd"))
    for _ in range(data.draw(st.integers(1, 4))):
        made[data.draw(st.integers(0, len(made) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(bytes(made[: data.draw(st.integers(len(made) // 2, len(made)))]))
    with suppress(InputError):
        assert len(read_table(path.parent, "boxes", {"a": int})["a"]) <= MOST_ROWS
