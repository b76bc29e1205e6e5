"""The one door for output: files and folders that appear whole or not at all, each in its place alone.

Everything is written into a private folder beside its place, whose name nobody can foresee, and moved there
at the end. A lock keeps a second writer away from the same place meanwhile. What a killed writer left is
removed by the next one. A folder is replaced only if it was made here and holds nothing else. Where something
cannot be written, ``InputError`` says why, and what was there stays.
"""

import hashlib
import json
import os
import re
import secrets
import shutil
from collections.abc import Generator, Iterable
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from dreamdrive.errors import InputError
from dreamdrive.files.json_file import read_json
from dreamdrive.files.lock import locked

MARK = ".dreamdrive.json"
"""The file by which a folder that was made here is known: what it is, and the names of all its files."""
_PRIVATE = ".dreamdrive-"
_RETIRED = "retired"
_BY_THE_SYSTEM = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})
_PLAIN = re.compile(r"[A-Za-z0-9_+=@-][A-Za-z0-9._+=@-]{0,99}")


@contextmanager
def new_file(path: Path) -> Generator[Path, None, None]:
    """A place to write to, of the same name; on success it becomes ``path``, on any failure it vanishes.

    A link is followed: the file that it leads to is replaced.
    """
    with _private(path) as (place, private):
        if place.exists() and not place.is_file():
            raise InputError(f"{path} is no regular file, and is not replaced; choose another name")
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


def check_ending(path: Path, *endings: str) -> None:
    """Fail before the work where a name says that the file is of another kind, such as a letter."""
    if path.suffix.lower() not in endings:
        raise InputError(f"{path}: expected a name that ends in {' or '.join(endings)}")


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
def _private(path: Path) -> Generator[tuple[Path, Path], None, None]:
    """The place that a path means, and a folder beside it for its one writer, which goes away at the end."""
    try:
        place = _place(path)
        key = _PRIVATE + hashlib.sha256(os.fsencode(place.name)).hexdigest()[:12]
        private = place.parent / f"{key}-{secrets.token_hex(8)}"
        with ExitStack() as stack:
            stack.enter_context(made_folder(place.parent))
            # What lies in a private folder has one writer already.
            if not any(part.startswith(_PRIVATE) for part in place.parts):
                stack.enter_context(locked(place.parent / f"{key}.lock", path))
                _tidy(place, place.parent.glob(f"{key}-*"))
            stack.callback(_tidy, place, [private])
            private.mkdir(mode=0o700)
            yield place, private
    except OSError as error:
        raise _cannot_write(path, error) from error


@contextmanager
def made_folder(path: Path) -> Generator[None, None, None]:
    """A folder, with those above it; at the end those of them that were made here and are empty go away."""
    made = [folder for folder in (path, *path.parents) if not folder.exists()]
    try:
        path.mkdir(parents=True, exist_ok=True)
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
    reason = error.strerror or str(error)
    return InputError(
        f"cannot write {path}: {reason}; nothing was changed, free some space or choose another place"
    )
