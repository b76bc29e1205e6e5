"""Files that may not be what they say, opened without waiting, up to a limit, kept to their folder.

A file that is missing, not a regular one, too large or may not be read raises ``InputError``, which calls it
``where``, or by its path without it. A link is taken for what it leads to unless ``follow`` is off.
"""

import errno
import os
import stat
from collections.abc import Generator
from contextlib import contextmanager
from io import BufferedReader
from pathlib import Path, PurePosixPath

from dreamdrive.errors import InputError

TEXT_BYTES = 16_000_000
"""Most that a JSON or text file may hold: 1000 frames take 1 MB, and Python needs thirty times as much."""
MAX_NAME = 255
_LONGEST_PATH = 4000
_NO_FOLLOW = getattr(os, "O_NOFOLLOW", 0)


@contextmanager
def open_file(path: Path, where: str = "", *, follow: bool = True) -> Generator[BufferedReader, None, None]:
    """A regular file, open for reading.

    A pipe, a device or a folder is refused at once: reading it would wait, or never end.
    """
    where = where or str(path)
    try:
        # Opening a pipe would otherwise wait for somebody who writes to it.
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | (0 if follow else _NO_FOLLOW))
    except ValueError as error:
        raise InputError(f"{where} is not a file name ({error})") from None
    except OSError as error:
        reason = "it is a link" if error.errno == errno.ELOOP and not follow else error.strerror
        raise InputError(f"{where} cannot be read: {reason}") from error
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise InputError(f"{where} cannot be read: it is not a regular file")
    with os.fdopen(handle, "rb") as file:
        yield file


def check_file(path: Path, where: str = "") -> int:
    """The size of a regular file in bytes."""
    with open_file(path, where) as file:
        return os.fstat(file.fileno()).st_size


def read_bytes(path: Path, where: str = "", *, at_most: int, follow: bool = True) -> bytes:
    """The content of a regular file of ``at_most`` bytes."""
    where = where or str(path)
    with open_file(path, where, follow=follow) as file:
        size = os.fstat(file.fileno()).st_size
        if size > at_most:
            raise InputError(f"{where} holds {size / 1e6:.1f} MB; expected at most {at_most / 1e6:.0f} MB")
        try:
            # Not ``at_most``: so much memory would be taken, however short the file.
            return file.read(size)
        except OSError as error:
            raise InputError(f"{where} cannot be read: {error.strerror}") from error


def text_in(data: bytes) -> str:
    """Text in UTF-8, or as a byte order mark at its start tells; ``UnicodeDecodeError`` for others."""
    return data.decode("utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")


def read_text(path: Path, where: str = "", *, at_most: int = TEXT_BYTES) -> str:
    """The text in a file, as of ``text_in``."""
    data = read_bytes(path, where, at_most=at_most)
    try:
        return text_in(data)
    except UnicodeDecodeError as error:
        raise InputError(f"{where or path} cannot be read as text: {error}") from None


def is_path(name: object) -> bool:
    """Whether what a file says can be the name of a file anywhere; asking for others raises ``OSError``."""
    if not isinstance(name, str) or not name or "\0" in name or len(name) > _LONGEST_PATH:
        return False
    try:
        return all(len(os.fsencode(part)) <= MAX_NAME for part in name.split("/"))
    except UnicodeEncodeError:
        return False


def is_inside(name: object) -> bool:
    """Whether a name in a file is that of something below a folder: plain, relative, without ``..``."""
    if not isinstance(name, str) or not name or "\0" in name or "\\" in name:
        return False
    parts = name.split("/")
    return all(0 < len(part) <= MAX_NAME and part not in (".", "..") for part in parts)


def inside(folder: Path, name: object) -> Path:
    """The place below a folder, which may be a link, that a name from a file means; no link on the way.

    For what dreamdrive itself wrote; names in files that a user gives may lead anywhere.
    """
    if not is_inside(name):
        raise InputError(f"{folder} names {str(name)[:80]!r}, which is not a plain name of a file in it")
    path = folder
    for part in PurePosixPath(str(name)).parts:
        path = path / part
        if path.is_symlink():
            raise InputError(f"{path} is a link; dreamdrive neither reads nor writes through links there")
    return path
