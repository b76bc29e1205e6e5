"""The output folder: whose it is, what may be replaced, and how a result takes the place of an older one.

What lies in the folder may be damaged or hostile: names in its files count only below it, and links do not.
"""

import json
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from dreamdrive.errors import InputError
from dreamdrive.files.digest import digest
from dreamdrive.files.json_file import read_json
from dreamdrive.files.output import check_writable, new_file, remove
from dreamdrive.files.paths import inside, is_inside

OURS = ("held_out", "report.json", "report.png", "scene", "stages", "video")
"""What ``generate`` puts into an output folder."""

RESULT = ("held_out", "report.png", "scene", "video")
"""What of these is moved there from ``staging``, and removed when a later result lacks it."""

REPORT = "report.json"


@dataclass(frozen=True)
class Workspace:
    """An output folder that may be written to; it need not exist yet.

    ``request`` holds as JSON values what the result is made from.
    """

    out: Path
    request: dict[str, Any]

    @property
    def stages(self) -> Path:
        """Where stages keep their results."""
        return self.out / "stages"

    @property
    def staging(self) -> Path:
        """Where a new result is put together, laid out like ``out``."""
        return self.stages / "result"

    def claim(self) -> None:
        """Make the folder and note what it is for; before this nothing is written."""
        note = self.stages / "request.json"
        if _identity(note) != digest(self.request):
            text = json.dumps({"identity": digest(self.request), "request": self.request}, indent=1)
            with new_file(note) as path:
                path.write_text(text)

    def fresh_staging(self) -> Path:
        """An empty ``staging`` folder."""
        self.claim()
        staging = inside(self.out, "stages/result")
        remove(staging)
        staging.mkdir(parents=True)
        return staging

    def publish(self, report: dict[str, Any]) -> None:
        """Move what lies in ``staging`` to its place and write the report.

        Files of an earlier result that the new one does not have are removed; no other file is touched. The
        report goes away first and comes back last, so a folder with a report holds the whole result of it.
        """
        _check_kinds(self.out)
        moved = sorted(p.relative_to(self.staging) for p in self.staging.rglob("*") if p.is_file())
        replaced = self.stages / "replaced.json"
        if (self.out / REPORT).exists():
            (self.out / REPORT).replace(replaced)
        for path in moved:
            folder = _folder_of(self.out, path)
            folder.mkdir(parents=True, exist_ok=True)
            if (folder / path.name).is_dir() and not (folder / path.name).is_symlink():
                raise InputError(
                    f"{folder / path.name} is a folder where a file of the result belongs; move it"
                )
            (self.staging / path).replace(folder / path.name)
        for name in sorted(set(_files(replaced)) - {p.as_posix() for p in moved}):
            _remove_file(self.out, Path(name))
        names = [p.as_posix() for p in moved]
        document = {**report, "identity": digest(self.request), "files": names}
        text = json.dumps(document, indent=1, allow_nan=False)
        with new_file(self.out / REPORT) as path:
            path.write_text(text + "\n")
        replaced.unlink(missing_ok=True)
        shutil.rmtree(self.staging)


def open_workspace(
    out: Path, request: dict[str, Any], *, force: bool = False, recompute: bool = False
) -> Workspace | None:
    """Check that ``out`` may be written; None if it already holds the finished result of the request.

    ``force`` replaces the result of another request, and tolerates files that are not ours; ``recompute``
    makes a finished result again. ``InputError`` says what is in the way.
    """
    check_writable(out)
    _check_kinds(out)
    entries = sorted(p.name for p in out.iterdir() if not p.name.startswith(".")) if out.is_dir() else []
    finished, begun = _identity(out / REPORT), _identity(out / "stages" / "request.json")
    wanted = digest(request)
    taken = [name for name in entries if name in OURS]
    foreign = [name for name in entries if name not in OURS]
    if taken and finished is None and begun is None:
        raise InputError(
            f"{out} holds {taken[0]}, which dreamdrive did not write and would have to replace; "
            "choose another output folder or move it away"
        )
    if force:
        return Workspace(out, request)
    if finished == wanted and not recompute and all((out / name).exists() for name in _files(out / REPORT)):
        return None
    if foreign:
        raise InputError(
            f"{out} holds files that are not dreamdrive's ({', '.join(foreign[:3])}); choose another output "
            "folder, or give --force to write beside them (they are kept)"
        )
    other = finished if finished is not None else begun
    if other not in (None, wanted):
        raise InputError(
            f"{out} was made from another input or with other options{_difference(out, request)}; "
            "choose another output folder, or give --force to replace the result"
        )
    return Workspace(out, request)


def check_ours(out: Path) -> None:
    """Fail where a folder is not one that ``generate`` wrote."""
    if _identity(out / REPORT) is None and _identity(out / "stages" / "request.json") is None:
        raise InputError(f"{out} is no folder that dreamdrive generate wrote; nothing was removed")


def _check_kinds(out: Path) -> None:
    """What dreamdrive writes to is a folder or file of its own, and no link, which could lead anywhere."""
    for name in OURS:
        path = inside(out, name)
        if path.exists() and path.is_file() != bool(path.suffix):
            raise InputError(
                f"{path} is not a {'file' if path.suffix else 'folder'}, which dreamdrive would have to "
                "replace; choose another output folder or move it away"
            )


def _folder_of(out: Path, name: Path) -> Path:
    """The folder of a result's file; no link on the way."""
    return out if len(name.parts) == 1 else inside(out, name.parent.as_posix())


def _remove_file(out: Path, name: Path) -> None:
    """Remove a file of an earlier result; what has become a folder or lies behind a link is left alone."""
    path = _folder_of(out, name) / name.name
    if path.is_symlink() or path.is_file():
        path.unlink()


def _read(path: Path) -> dict[str, Any]:
    """The JSON object in one of our own files; nothing where it is damaged or something else."""
    try:
        return read_json(path, follow=False)
    except InputError:
        return {}


def _identity(path: Path) -> str | None:
    """What the result or work described by ``path`` was made from, or None where the file is not ours."""
    identity = _read(path).get("identity")
    return identity if isinstance(identity, str) else None


def _files(report: Path) -> list[str]:
    """The files of the result that ``report`` describes; names of anything else do not count."""
    names = _read(report).get("files")
    listed = cast("list[object]", names) if isinstance(names, list) else []
    return [str(name) for name in listed if is_inside(name) and Path(str(name)).parts[0] in RESULT]


def _difference(out: Path, request: dict[str, Any]) -> str:
    """Which parts of the request differ, in words."""
    noted = _read(out / "stages" / "request.json").get("request")
    before = _flat(cast("dict[str, Any]", noted) if isinstance(noted, dict) else {})
    now = _flat(json.loads(json.dumps(request)))
    names = [name for name in now if before.get(name) != now[name]] if before else []
    return f" ({', '.join(names)} differ{'s' if len(names) == 1 else ''})" if names else ""


def _flat(values: dict[str, Any]) -> dict[str, Any]:
    """Values of dictionaries in a dictionary, under their own names."""
    flat: dict[str, Any] = {}
    for name, value in values.items():
        flat |= value if isinstance(value, dict) else {name: value}
    return flat
