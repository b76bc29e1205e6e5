"""What tables of contents claim is read without reading them."""

import zipfile
from pathlib import Path

import pytest

from dreamdrive.errors import InputError
from dreamdrive.files.tensor_file import HEADER_BYTES, directory_bytes, header_problem, read_own


def archive(path: Path, count: int, comment: bytes = b"") -> int:
    with zipfile.ZipFile(path, "w") as made:
        made.comment = comment
        for i in range(count):
            made.writestr(f"{i:06d}", b"")
    with path.open("rb") as file:
        return directory_bytes(file)


@pytest.mark.parametrize("count", [0, 3, 70_000])
def test_each_entry_takes_its_place(tmp_path, count):
    """70,000 entries need the longer form of the end."""
    assert archive(tmp_path / "a.zip", count) == count * (46 + 6)


def test_a_comment_lies_behind_the_end(tmp_path):
    assert archive(tmp_path / "a.zip", 3, b"x" * 60_000) == 3 * 52


def test_what_is_no_zip_has_none(tmp_path):
    (tmp_path / "a.zip").write_bytes(b"PK\3\4" + bytes(100))
    with (tmp_path / "a.zip").open("rb") as file:
        assert directory_bytes(file) == 0


@pytest.mark.parametrize("stated", [0, 1, 100, HEADER_BYTES + 1, 2**63])
def test_a_table_of_tensors_that_is_too_long_is_not_read(tmp_path: Path, stated: int) -> None:
    path = tmp_path / "a.safetensors"
    path.write_bytes(stated.to_bytes(8, "little") + b"{}")
    with path.open("r+b") as file:
        file.truncate(HEADER_BYTES + 100 if stated > HEADER_BYTES else 10)
    assert f"it states a header of {stated} bytes" in str(header_problem(path))
    with pytest.raises(
        InputError, match=rf"a\.safetensors holds no tensors: it states a header of {stated} "
    ):
        read_own(path)


def test_a_file_of_tensors_comes_whole(tmp_path: Path) -> None:
    path = tmp_path / "a.safetensors"
    path.write_bytes((2).to_bytes(8, "little") + b"{}")
    assert header_problem(path) is None
    assert read_own(path) == path.read_bytes()
