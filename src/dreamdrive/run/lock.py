"""One run at a time in a folder."""

import errno
import fcntl
import json
import logging
import os
import stat
import sys
from collections.abc import Generator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

from dreamdrive.errors import InputError
from dreamdrive.files.json_file import parse_json

NAME = ".dreamdrive.lock"
"""The file that is locked; it goes away with the run, and what a killed run leaves of it hinders nobody."""
_UNSUPPORTED = (errno.ENOLCK, errno.ENOTSUP, errno.EINVAL, errno.ENOSYS)
_NOTE_BYTES = 4096
_log = logging.getLogger("dreamdrive")


@contextmanager
def only_run(out: Path) -> Generator[None, None, None]:
    """Keep other runs out of a folder; the kernel lets go of it however this process ends.

    Where another run works there, ``InputError`` names its process. The folder is made if need be, and
    removed at the end where nothing came into it.
    """
    made = _make(out)
    path = out / NAME
    handle = _locked(path, out)
    try:
        yield
    finally:
        # Removed before it is let go, and only by its owner: nobody else can have locked this file.
        path.unlink(missing_ok=True)
        os.close(handle)
        for folder in made:
            with suppress(OSError):
                folder.rmdir()


def _make(out: Path) -> list[Path]:
    """Make the folder and those above it; which were made, the innermost first."""
    missing = [folder for folder in (out, *out.parents) if not folder.exists()]
    out.mkdir(parents=True, exist_ok=True)
    return missing


def _locked(path: Path, out: Path) -> int:
    """An open file that this process alone has locked."""
    while True:
        handle = _open(path)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            note = os.pread(handle, _NOTE_BYTES, 0)
            if error.errno in _UNSUPPORTED:
                _log.warning("%s cannot be locked (%s): do not start a second run there", out, error.strerror)
                return handle
            os.close(handle)
            raise InputError(
                f"{out} is in use: {_told(note)} works there; wait until it has finished, stop it, or choose "
                "another output folder"
            ) from None
        if _still_there(handle, path):
            os.ftruncate(handle, 0)
            os.pwrite(handle, _note().encode(), 0)
            return handle
        # Its last owner removed it between our opening and locking it.
        os.close(handle)


def _open(path: Path) -> int:
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, 0o644)
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise InputError(f"{path} is a link; remove it") from None
        raise InputError(f"cannot write to {path.parent}: {error.strerror}") from error
    found = os.fstat(handle)
    # A second name elsewhere would let our note overwrite what lies there.
    if not stat.S_ISREG(found.st_mode) or found.st_nlink > 1:
        os.close(handle)
        raise InputError(f"{path} is not a file of dreamdrive's; remove it")
    return handle


def _still_there(handle: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(handle), os.lstat(path))
    except FileNotFoundError:
        return False


def _note() -> str:
    started = datetime.now().astimezone().isoformat(timespec="seconds")
    return json.dumps({"process": os.getpid(), "started": started, "command": " ".join(sys.argv)[:500]})


def _told(note: bytes) -> str:
    """Who holds the lock, in words."""
    try:
        values = parse_json(note, "lock")
    except InputError:
        values = None
    if not isinstance(values, dict) or not isinstance(values.get("process"), int):
        return "another process"
    return f"process {values['process']}, started {values.get('started')} ({values.get('command')}),"
