"""The size of a zip's table of contents is read without reading the table."""

import zipfile
from pathlib import Path

import pytest

from dreamdrive.files.tensor_file import directory_bytes


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
