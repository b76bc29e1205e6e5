"""Files and folders that appear whole or not at all.

Where they cannot be written, ``InputError`` says why, and what was there stays.
"""

import os
import shutil
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from dreamdrive.errors import InputError


@contextmanager
def new_file(path: Path) -> Generator[Path, None, None]:
    """A temporary sibling to write to; on success it replaces ``path``, on any failure it vanishes."""
    partial = path.with_name(f".{path.stem}.partial{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # A link under this name would lead the writer elsewhere.
        remove(partial)
        yield partial
        os.replace(partial, path)
    except OSError as error:
        raise _cannot_write(path, error) from error
    finally:
        remove(partial)


@contextmanager
def new_folder(path: Path, *, replace: bool, mark: str) -> Generator[Path, None, None]:
    """A temporary sibling folder to fill; on success it becomes ``path``, on any failure it vanishes.

    An existing folder is only replaced if that is asked for and it is empty or holds ``mark``, the file by
    which a folder of this kind is known, so that nothing foreign is deleted.
    """
    partial, retired = (path.with_name(f".{path.name}.{kind}") for kind in ("partial", "retired"))
    try:
        if retired.exists() and not path.exists():
            # A kill between the two renames below left the old folder under this name.
            os.replace(retired, path)
        check_free(path, replace, mark)
        remove(partial)
        partial.mkdir(parents=True)
        yield partial
        _swap(partial, path, retired)
    except OSError as error:
        raise _cannot_write(path, error) from error
    finally:
        remove(partial)


def check_free(path: Path, replace: bool, mark: str) -> None:
    """Fail before the work where ``new_folder``, of the same arguments, would fail after it."""
    if not path.exists() or (path.is_dir() and not any(path.iterdir())):
        return
    if not path.is_dir():
        raise InputError(f"{path} is a file, expected a folder or a new name; choose another place")
    if not (path / mark).is_file():
        raise InputError(f"{path} holds other files (no {mark}), and is not replaced; choose another place")
    if not replace:
        raise InputError(
            f"{path} exists already; choose another place or ask for it to be replaced (--force)"
        )


def _swap(partial: Path, path: Path, retired: Path) -> None:
    """Put ``partial`` in the place of ``path``, which returns if that fails."""
    remove(retired)
    existed = path.exists()
    if existed:
        os.replace(path, retired)
    try:
        os.replace(partial, path)
    except OSError:
        if existed:
            os.replace(retired, path)
        raise
    remove(retired)


def remove(path: Path) -> None:
    """Remove a file, a link or a folder with all that is in it; what links lead to is left alone."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    elif os.path.lexists(path):
        path.unlink()


def _cannot_write(path: Path, error: OSError) -> InputError:
    reason = error.strerror or str(error)
    return InputError(
        f"cannot write {path}: {reason}; nothing was changed, free some space or choose another place"
    )
