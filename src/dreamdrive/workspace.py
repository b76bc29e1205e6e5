"""The output folder: whose it is, what may be replaced, and how a result takes the place of an older one."""

import json
import os
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dreamdrive.errors import InputError
from dreamdrive.scene.atomic import new_file
from dreamdrive.stages import digest

OURS = ("held_out", "report.json", "report.png", "scene", "stages", "video")
"""What ``generate`` puts into an output folder."""

REPORT = "report.json"


@dataclass(frozen=True)
class Workspace:
    """An output folder that may be written to.

    Attributes:
        out: The folder; it need not exist yet.
        request: What the result is made from: digest of the input and the options, as JSON values.
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
        shutil.rmtree(self.staging, ignore_errors=True)
        self.staging.mkdir(parents=True)
        return self.staging

    def publish(self, report: dict[str, Any]) -> None:
        """Move what lies in ``staging`` to its place and write the report.

        Files of an earlier result that the new one does not have are removed; no other file is touched. The
        report goes away first and comes back last, so a folder with a report holds the whole result of it.
        """
        moved = sorted(p.relative_to(self.staging) for p in self.staging.rglob("*") if p.is_file())
        replaced = self.stages / "replaced.json"
        if (self.out / REPORT).exists():
            (self.out / REPORT).replace(replaced)
        for path in moved:
            target = self.out / path
            target.parent.mkdir(parents=True, exist_ok=True)
            (self.staging / path).replace(target)
        for name in set(_files(replaced)) - {p.as_posix() for p in moved}:
            (self.out / name).unlink(missing_ok=True)
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
    """Check that ``out`` may be written for ``request``.

    Args:
        out: The output folder.
        request: What the result is made from.
        force: Replace the result of another request, and tolerate files that are not ours.
        recompute: A finished result of the same request is to be made again.

    Returns:
        None if ``out`` already holds the finished result of the request and neither flag is set.

    Raises:
        InputError: The folder cannot be written, holds something else, or the result of another request.
    """
    _check_writable(out)
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


def _check_writable(out: Path) -> None:
    """Fail before the work rather than after it."""
    existing = out
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    if not existing.is_dir():
        raise InputError(f"cannot write to {out}: {existing} is a file, and a folder is needed there")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise InputError(f"cannot write to {out}: no permission to write in {existing}")


def _read(path: Path) -> dict[str, Any]:
    try:
        document = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return {}
    return document if isinstance(document, dict) else {}


def _identity(path: Path) -> str | None:
    """What the result or work described by ``path`` was made from, or None where the file is not ours."""
    identity = _read(path).get("identity")
    return identity if isinstance(identity, str) else None


def _files(report: Path) -> list[str]:
    """The files of the result that ``report`` describes."""
    names = _read(report).get("files", [])
    return [name for name in names if isinstance(name, str) and Path(name).parts[0] in OURS]


def _difference(out: Path, request: dict[str, Any]) -> str:
    """Which parts of the request differ, in words."""
    before = _flat(_read(out / "stages" / "request.json").get("request", {}))
    now = _flat(json.loads(json.dumps(request)))
    names = [name for name in now if before.get(name) != now[name]] if before else []
    return f" ({', '.join(names)} differ{'s' if len(names) == 1 else ''})" if names else ""


def _flat(values: dict[str, Any]) -> dict[str, Any]:
    """Values of dictionaries in a dictionary, under their own names."""
    flat: dict[str, Any] = {}
    for name, value in values.items():
        flat |= value if isinstance(value, dict) else {name: value}
    return flat
