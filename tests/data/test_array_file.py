"""Arrays are read as far as their headers are believable."""

import io
import os
import zipfile

import numpy as np
import pytest

from dreamdrive.data.array_file import read_npy, read_npz
from dreamdrive.errors import InputError

NUMBERS = np.arange(24, dtype=np.float32).reshape(4, 6)


def header(text: str) -> bytes:
    """The beginning of an NPY file that states what the text says."""
    body = text.encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(body).to_bytes(2, "little") + body


def stating(shape: object, dtype: str = "<f4", fortran: bool = False) -> bytes:
    return header(repr({"descr": dtype, "fortran_order": fortran, "shape": shape}))


def npz(path, members: dict[str, bytes], compression: int = zipfile.ZIP_DEFLATED):
    with zipfile.ZipFile(path, "w", compression) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return path


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
@pytest.mark.parametrize(
    "array",
    [NUMBERS, np.asfortranarray(NUMBERS), NUMBERS.astype(">f8"), NUMBERS[:0], NUMBERS[0, 0], NUMBERS > 3],
)
def test_what_numpy_writes_is_read(tmp_path, save, array):
    save(tmp_path / "a.npz", x=array, y=NUMBERS)
    np.save(tmp_path / "a.npy", array)
    found = read_npz(tmp_path / "a.npz", ("x", "z"))
    assert list(found) == ["x"]
    for each in (found["x"], read_npy(tmp_path / "a.npy")):
        np.testing.assert_array_equal(each, array)
        assert each.dtype == array.dtype.newbyteorder("=")
        assert each.flags.c_contiguous


BAD = {
    "more than there is": (
        stating((4, 6)) + NUMBERS.tobytes()[:-1],
        "is cut short: 95 of 96 bytes are there; copy the file again",
    ),
    "a huge shape": (
        stating((100000, 100000)),
        "says that its shape is (100000, 100000) (float32), 40000 MB; expected at most 256 MB",
    ),
    "small numbers that grow": (
        stating((10000, 10000), "|u1"),
        "says that its shape is (10000, 10000) (uint8), 400 MB; expected at most 256 MB",
    ),
    "a shape that overflows": (
        stating((2**40, 2**40)),
        "says that its shape is (1099511627776, 1099511627776) (float32), 4835703278458516480 MB; "
        "expected at most 256 MB",
    ),
    "a negative shape": (stating((-4, -6)) + NUMBERS.tobytes(), "says that its shape is (-4, -6)"),
    "numbers of 3000 digits": (
        stating((10**3000,) * 3),
        f"says that its shape is ({'1' + 198 * '0'}...",
    ),
    "nine sides": (stating((1,) * 9) + bytes(4), "says that its shape is (1, 1, 1, 1, 1, 1, 1, 1, 1)"),
    "objects": (stating((4,), "|O") + b"cos\nsystem\n", "holds object; expected numbers of up to 64 bits"),
    "complex": (stating((4,), "<c8") + bytes(32), "holds complex64; expected numbers of up to 64 bits"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_is_refused(tmp_path, name):
    content, expected = BAD[name]
    (tmp_path / "a.npy").write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_npy(tmp_path / "a.npy")
    assert str(caught.value) == f"{tmp_path}/a.npy: the array {expected}"
    with pytest.raises(InputError) as caught:
        read_npz(npz(tmp_path / "a.npz", {"x.npy": content}), ["x"])
    assert str(caught.value) == f"{tmp_path}/a.npz: x {expected}"


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"rubbish",
        header("{1: 2, 'a': 3}"),
        header("[" * 100),
        header("{'descr'"),
        b"\x93NUMPY\x07\x00" + bytes(20),
    ],
)
def test_damaged_headers_are_refused(tmp_path, content):
    (tmp_path / "a.npy").write_bytes(content)
    with pytest.raises(InputError, match=r"a\.npy cannot be read as an npy"):
        read_npy(tmp_path / "a.npy")
    with pytest.raises(InputError, match=r"a\.npz cannot be read as an npz"):
        read_npz(npz(tmp_path / "a.npz", {"x.npy": content}), ["x"])


def test_all_arrays_together_are_bounded(tmp_path):
    np.savez(tmp_path / "a.npz", x=NUMBERS, y=NUMBERS)
    assert len(read_npz(tmp_path / "a.npz", ("x", "y"), at_most=192)) == 2
    with pytest.raises(InputError, match=r"y says that its shape is \(4, 6\)"):
        read_npz(tmp_path / "a.npz", ("x", "y"), at_most=191)


def test_an_archive_of_many_files_is_refused(tmp_path):
    npz(tmp_path / "a.npz", {f"{i:0100d}": b"" for i in range(7000)}, zipfile.ZIP_STORED)
    with pytest.raises(InputError) as caught:
        read_npz(tmp_path / "a.npz", ["x"])
    assert str(caught.value) == f"{tmp_path}/a.npz: holds more files than an npz with a few arrays"


def test_other_compression_is_refused(tmp_path):
    content = io.BytesIO()
    np.save(content, NUMBERS)
    npz(tmp_path / "a.npz", {"x.npy": content.getvalue()}, zipfile.ZIP_LZMA)
    with pytest.raises(InputError, match="x is compressed in a way that NumPy never does"):
        read_npz(tmp_path / "a.npz", ["x"])


def test_what_is_no_plain_file_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "a")
    for read in (lambda: read_npy(tmp_path / "a"), lambda: read_npz(tmp_path / "a", ["x"])):
        with pytest.raises(InputError) as caught:
            read()
        assert str(caught.value) == f"{tmp_path}/a cannot be read: it is not a regular file"
