"""The one door for output: files and folders that appear whole or not at all, each in its place alone.

Everything is written into a private folder beside its place, whose name nobody can foresee, and moved there
at the end. A lock keeps a second writer away from the same place meanwhile. What a killed writer left is
removed by the next one. A folder is replaced only if it was made here and holds nothing else. Where something
cannot be written, ``InputError`` says why, and what was there stays.
"""

import errno
import fcntl
import hashlib
import json
import os
import re
import secrets
import shutil
import tempfile
import time
from collections.abc import Generator, Iterable
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from safetensors import SafetensorError

from dreamdrive.errors import InputError
from dreamdrive.files.json_file import read_json
from dreamdrive.files.lock import locked
from dreamdrive.files.undisturbed import held

MARK = ".dreamdrive.json"
"""The file by which a folder that was made here is known: what it is, and the names of all its files."""
_PRIVATE = ".dreamdrive-"
_RETIRED = "retired"
_TEMPORARY, _YOUNG_S = "dreamdrive-", 10.0
_BY_THE_SYSTEM = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})
_NO_ROOM_BYTES = 1_000_000
"""Where so much cannot be written, SQLite's errors of many names mean that the disk is full."""
_PLAIN = re.compile(r"[A-Za-z0-9_+=@-][A-Za-z0-9._+=@-]{0,99}")


@contextmanager
def new_file(path: Path) -> Generator[Path, None, None]:
    """A place to write to, of the same name; on success it becomes ``path``, on any failure it vanishes.

    A link is followed: the file that it leads to is replaced.
    """
    with _private(path) as (place, private):
        check_regular(path)
        yield private / place.name
        os.replace(private / place.name, place)


@contextmanager
def new_folder(path: Path, *, replace: bool, kind: str) -> Generator[Path, None, None]:
    """A folder to fill; on success it becomes ``path``, on any failure it vanishes.

    An existing folder is only replaced if that is asked for and it is empty, or was made here as the same
    ``kind`` and nothing was put into it since. A link is followed: the folder that it leads to is replaced.
    """
    with _private(path) as (place, private):
        check_free(path, replace, kind)
        made = private / "new"
        made.mkdir()
        yield made
        (made / MARK).write_text(json.dumps({"dreamdrive": kind, "files": sorted(_names(made))}) + "\n")
        # Where this is stopped in between, what was put aside comes back.
        if place.exists():
            os.replace(place, private / _RETIRED)
        os.replace(made, place)


@contextmanager
def scratch_beside(path: Path) -> Generator[Path, None, None]:
    """A folder for what is needed only until ``path`` is written; it lies beside that, and vanishes.

    The system's folder for temporary files may be small, or lie in memory: the disk that holds the result has
    room for what it is made of.
    """
    with _private(path, "scratch") as (_, private):
        yield private


@contextmanager
def temporary_folder() -> Generator[Path, None, None]:
    """A folder among the temporary files of the system, for what is small; it vanishes at the end.

    What a killed process left there is removed by the next one, and by the next run in any folder.

    Raises:
        InputError: There is no such place, or no room in it.
    """

    def enter(stack: ExitStack) -> Path:
        try:
            tidy_temporary()
            made = stack.enter_context(tempfile.TemporaryDirectory(prefix=_TEMPORARY))
        except OSError as error:
            raise _no_room("the system's folder", error.strerror or str(error)) from error
        with suppress(OSError):  # where the disk has no locks, nobody removes it either
            stack.enter_context(_in_use(Path(made)))
        return Path(made)

    with held(enter) as folder:
        try:
            yield folder
        except OSError as error:
            if error.errno not in (errno.ENOSPC, errno.EDQUOT):
                raise
            raise _no_room(tempfile.gettempdir(), str(error)) from error
        except RuntimeError as error:  # of SQLite, through pycolmap, in words that say little
            if _has_room(folder):
                raise
            raise _no_room(tempfile.gettempdir(), "the disk is full") from error


@contextmanager
def _in_use(folder: Path) -> Generator[None, None, None]:
    """Hold a lock on a folder itself, which ends with this process."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if os.fstat(handle).st_uid != os.getuid():
            raise PermissionError(errno.EPERM, "the folder is another user's")
        yield
    finally:
        os.close(handle)


def tidy_temporary() -> None:
    """Remove temporary folders that killed processes left; young ones may be about to be held."""
    for left in Path(tempfile.gettempdir()).glob(f"{_TEMPORARY}*"):
        with suppress(OSError):
            if time.time() - left.lstat().st_mtime > _YOUNG_S:
                with _in_use(left):
                    remove(left)


def _has_room(folder: Path) -> bool:
    """Whether something small can be written there."""
    try:
        with (folder / "room").open("wb") as file:
            file.write(bytes(_NO_ROOM_BYTES))
    except OSError:
        return False
    return True


def _no_room(where: str, reason: str) -> InputError:
    return InputError(
        f"no room for temporary files in {where}: {reason}; free some space there, or name a folder on "
        "another disk in TMPDIR"
    )


def claim_folder(path: Path, kind: str) -> None:
    """Make a folder that work of a kind fills, and goes on in later, or find that it is one.

    Raises:
        InputError: It holds something and was not made for that: what is in it may be the user's.
    """
    names = [each.name for each in path.iterdir()] if path.is_dir() else []
    names = [name for name in names if not name.startswith(".dreamdrive") or name == MARK]
    if names and _listed(path, kind) is None:
        raise InputError(
            f"{path} holds other files ({', '.join(sorted(names)[:3])}) and no {kind} of dreamdrive; choose "
            "another folder"
        )
    if not names:
        with new_file(path / MARK) as partial:
            partial.write_text(json.dumps({"dreamdrive": kind, "files": []}) + "\n")


def check_free(path: Path, replace: bool, kind: str) -> None:
    """Fail before the work where ``new_folder``, of the same arguments, would fail after it."""
    if not path.exists() or (path.is_dir() and not any(path.iterdir())):
        return
    if not path.is_dir():
        raise InputError(f"{path} is a file, expected a folder or a new name; choose another place")
    listed = _listed(path, kind)
    if listed is None:
        raise InputError(
            f"{path} holds other files (it is no {kind} of dreamdrive's), and is not replaced; choose "
            "another place, or remove it yourself"
        )
    foreign = sorted(set(_names(path)) - listed - {MARK})
    foreign = [name for name in foreign if name.rpartition("/")[2] not in _BY_THE_SYSTEM]
    if foreign:
        raise InputError(
            f"{path} holds other files ({', '.join(foreign[:3])}), and is not replaced; move them, or choose "
            "another place"
        )
    if not replace:
        raise InputError(
            f"{path} exists already; choose another place or ask for it to be replaced (--force)"
        )


def check_new_file(path: Path, replace: bool) -> None:
    """Fail before the work where a file would take the place of something that is not to be replaced."""
    if path.is_dir():
        raise InputError(f"{path} is a folder, expected a file or a new name; choose another place")
    if path.exists() and not replace:
        raise InputError(
            f"{path} exists already; choose another place or ask for it to be replaced (--force)"
        )


def check_regular(path: Path) -> None:
    """Fail before the work where ``new_file`` would fail after it, as what is there is no file."""
    place = _place(path)
    if place.exists() and not place.is_file():
        raise InputError(f"{path} is no regular file, and is not replaced; choose another name")


def check_place(out: Path, source: Path | None) -> None:
    """Fail before the work where the output folder is the input, or cannot be written."""
    if source is not None and os.path.realpath(out) == os.path.realpath(source):
        raise InputError(f"{out} is the input itself; choose another output folder")
    check_writable(out)


def check_writable(out: Path) -> None:
    """Fail before the work rather than after it."""
    existing = out
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    if not existing.is_dir():
        raise InputError(f"cannot write to {out}: {existing} is a file, and a folder is needed there")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise InputError(f"cannot write to {out}: no permission to write in {existing}")


def check_ending(path: Path, *endings: str) -> None:
    """Fail before the work where a name says that the file is of another kind, such as a letter."""
    if path.suffix.lower() not in endings:
        wanted = f"{' or '.join(endings)}, such as {path.stem}{endings[0]}"
        raise InputError(f"{path}: expected a name that ends in {wanted}")


def plain_name(name: str) -> str:
    """A name from data as that of a file: itself where it is plain, else the like of it, and no other's.

    Names in data are written by others, and may lead anywhere.
    """
    if _PLAIN.fullmatch(name):
        return name
    like = re.sub(r"[^A-Za-z0-9._+=@-]", "_", name).lstrip(".")[:60]
    return f"{like}-{hashlib.sha256(name.encode('utf-8', 'surrogatepass')).hexdigest()[:8]}"


def remove(path: Path) -> None:
    """Remove a file, a link or a folder with all that is in it; what links lead to is left alone."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    elif os.path.lexists(path):
        path.unlink()


def _place(path: Path) -> Path:
    """Where a path leads: links are followed, so that they stay and what they lead to is replaced."""
    place = Path(os.path.realpath(path))
    if path.is_symlink() and (place.is_symlink() or not place.parent.is_dir()):
        raise InputError(f"{path} is a link to {os.readlink(path)}, which leads nowhere; remove it")
    return place


@contextmanager
def _private(path: Path, purpose: str = "") -> Generator[tuple[Path, Path], None, None]:
    """The place that a path means, and a folder beside it for its one writer, which goes away at the end.

    Folders of another ``purpose`` may be there at the same time.
    """

    def enter(stack: ExitStack) -> tuple[Path, Path]:
        place = _place(path)
        key = _PRIVATE + hashlib.sha256(os.fsencode(place.name + purpose)).hexdigest()[:12]
        private = place.parent / f"{key}-{secrets.token_hex(8)}"
        stack.enter_context(made_folder(place.parent))
        # What lies in a private folder has one writer already.
        if not any(part.startswith(_PRIVATE) for part in place.parts):
            stack.enter_context(locked(place.parent / f"{key}.lock", path))
            _tidy(place, place.parent.glob(f"{key}-*"))
        stack.callback(_tidy, place, [private])
        private.mkdir(mode=0o700)
        return place, private

    try:
        with held(enter) as found:
            yield found
    except OSError as error:
        raise _cannot_write(path, error) from error
    except SafetensorError as error:
        if "I/O error" not in str(error):
            raise
        raise _cannot_write(path, OSError(str(error).partition("I/O error: ")[2])) from error


@contextmanager
def made_folder(path: Path) -> Generator[None, None, None]:
    """A folder, with those above it; at the end those of them that were made here and are empty go away.

    A link is followed: the folder that it leads to is made.
    """
    path = Path(os.path.realpath(path))
    made = [folder for folder in (path, *path.parents) if not folder.exists()]
    try:
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise _cannot_write(path, error) from error
        yield
    finally:
        for folder in made:
            with suppress(OSError):
                folder.rmdir()


def _tidy(place: Path, left: Iterable[Path]) -> None:
    """Remove what writers leave; what one had put aside and did not replace comes back."""
    for private in left:
        aside = private / _RETIRED
        if not private.is_symlink() and aside.is_dir() and not os.path.lexists(place):
            os.replace(aside, place)
        remove(private)


def _names(folder: Path) -> list[str]:
    """All files below a folder, and its empty folders, by their path in it."""
    found: list[str] = []
    for place, folders, files in os.walk(folder):
        below = Path(place).relative_to(folder)
        found += [(below / name).as_posix() for name in files]
        found += [(below / name).as_posix() for name in folders if (Path(place) / name).is_symlink()]
    return found


def _listed(folder: Path, kind: str) -> set[str] | None:
    """The files that a folder of this kind was made with; None of any other folder."""
    try:
        mark = read_json(folder / MARK, follow=False)
    except InputError:
        return None
    names = mark.get("files")
    if mark.get("dreamdrive") != kind or not isinstance(names, list):
        return None
    return {str(name) for name in names}


def _cannot_write(path: Path, error: OSError) -> InputError:
    reason = "it is no folder" if isinstance(error, FileExistsError) else error.strerror or str(error)
    return InputError(
        f"cannot write {path}: {reason}; nothing was changed, free some space or choose another place"
    )
