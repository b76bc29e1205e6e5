"""Locks for one writer at a time, which the kernel lets go of however their process ends."""

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

_HELD = (errno.EWOULDBLOCK, errno.EACCES)
_NOTE_BYTES = 4096
_log = logging.getLogger("dreamdrive")


@contextmanager
def locked(path: Path, what: Path) -> Generator[None, None, None]:
    """Hold the lock file ``path``, which goes away afterwards; what a killed process leaves of it is no lock.

    Where another process holds it, ``InputError`` says that ``what`` is in use, and by whom. Where the disk
    has no locks, a warning says so.
    """
    handle = _held(path, what)
    try:
        yield
    finally:
        # Removed before it is let go, and only by its owner: nobody else can have locked this file.
        path.unlink(missing_ok=True)
        os.close(handle)


def _held(path: Path, what: Path) -> int:
    """An open file that this process alone has locked."""
    while True:
        handle = _open(path)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            if error.errno not in _HELD:
                reason = error.strerror or str(error)
                _log.warning("%s cannot be locked (%s): let nothing else write there meanwhile", what, reason)
                return handle
            note = os.pread(handle, _NOTE_BYTES, 0)
            os.close(handle)
            raise InputError(
                f"{what} is in use: {_told(note)} works there; wait until it has finished, stop it, or "
                "choose another output folder"
            ) from None
        if _still_there(handle, path):
            # A full disk has no room for the note; who writes next says so.
            with suppress(OSError):
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
