"""Stages whose results are kept: the same input and options are never computed twice."""

import hashlib
import json
import logging
import resource
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, field, fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any, Protocol, TypeVar, cast, get_args, runtime_checkable

import numpy as np
import torch

from dreamdrive import _native
from dreamdrive.choices import Stage
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import of_type
from dreamdrive.files.output import remove
from dreamdrive.files.paths import inside, open_file
from dreamdrive.progress import Progress, StageProgress, Work
from dreamdrive.run import codec
from dreamdrive.stored import load_scene, save_scene

STAGES: tuple[str, ...] = get_args(Stage)
"""All stages in their order; each result depends on some of those before it."""

T = TypeVar("T")
U = TypeVar("U")
_log = logging.getLogger("dreamdrive")


@dataclass(frozen=True)
class StageRecord:
    """What a stage cost when it was computed; memory is the process's largest until then."""

    seconds: float
    peak_rss_mb: float
    cached: bool


_SCENE = "fit"
"""The stage whose result is a scene, which ``codec`` does not know."""


def trusted(value: object) -> None:
    """No check."""


@runtime_checkable
class Run(Protocol):
    """What gives the result of a stage: ``call`` computes it, ``Stages`` keeps it on disk."""

    def __call__(
        self,
        name: str,
        options: object,
        compute: Callable[[Work], T],
        *,
        check: Callable[[T], None] = trusted,
        given: T | None = None,
    ) -> T:
        """The result of one of ``STAGES``, unless it is given.

        It depends on the options and the results before it, nothing else; ``check`` raises ``ValueError``
        where a stored result does not belong to these.
        """
        ...


def call(
    name: str,
    options: object,
    compute: Callable[[Work], T],
    *,
    check: Callable[[T], None] = trusted,
    given: T | None = None,
) -> T:
    """A ``Run`` that keeps nothing."""
    return compute(Work()) if given is None else given


@dataclass
class Stages:
    """Reads what an earlier run of the same stages left, and leaves what it computes, a folder for each.

    The key of a result holds its options, the keys of all stages before it, and a digest of the program: a
    result is found again only by the program that made it. Those of ``recompute_from`` and later stages are
    not read. ``claim`` is called before something is written. Records and results are those of each stage
    that ran.
    """

    folder: Path
    recompute_from: str | None
    progress: StageProgress
    claim: Callable[[], None]
    records: dict[str, StageRecord] = field(default_factory=dict)
    results: dict[str, Any] = field(default_factory=dict)
    _last: str = field(default="", init=False)

    def __call__(
        self,
        name: str,
        options: object,
        compute: Callable[[Work], T],
        *,
        check: Callable[[T], None] = trusted,
        given: T | None = None,
    ) -> T:
        """See ``Run``; a computed result is stored and read back, so that what follows sees no difference."""
        self._last = digest([name, program_digest(), options if given is None else given, self._last])
        value = self._kept(name, compute, check) if given is None else given
        self.results[name] = value
        return value

    def _kept(self, name: str, compute: Callable[[Work], T], check: Callable[[T], None]) -> T:
        folder = inside(self.folder, name)
        fresh = self.recompute_from is not None and STAGES.index(name) >= STAGES.index(self.recompute_from)
        found = None if fresh else _header(folder)
        if found is not None and found.key == self._last:
            try:
                value = cast(T, _load(folder))
                check(value)
            except ValueError as error:
                _log.warning("%s is computed again: %s", name, error)
            else:
                self.records[name] = StageRecord(found.seconds, found.peak_rss_mb, cached=True)
                self.progress(name, 1, 1)
                return value
        return self._compute(name, self._last, compute)

    def measure(self, name: str, compute: Callable[[Progress], T]) -> T:
        """Run something that is not kept, and record what it cost."""
        at, whole = 0, 1

        def tell(done: int, total: int) -> None:
            nonlocal at, whole
            at, whole = done, total or 1
            self.progress(name, done, total)

        tell(0, 0)
        start = time.perf_counter()
        value = compute(tell)
        self.records[name] = StageRecord(round(time.perf_counter() - start, 2), peak_rss_mb(), cached=False)
        if at < whole:
            tell(whole, whole)
        return value

    def _compute(self, name: str, key: str, compute: Callable[[Work], T]) -> T:
        parts = inside(self.folder, f"{name}.parts")

        def keep(name: str, compute: Callable[[], U]) -> U:
            place = parts / name
            found = _header(place)
            if found is not None and found.key == key:
                with suppress(InputError):
                    return cast(U, codec.read(place))
            value = compute()
            self.claim()
            codec.write(place, value, asdict(_Header(key, 0, 0)))
            return cast(U, codec.read(place))

        value = self.measure(name, lambda tell: compute(Work(tell, keep)))
        record = self.records[name]
        self.claim()
        folder = inside(self.folder, name)
        _store(folder, value, asdict(_Header(key, record.seconds, record.peak_rss_mb)))
        remove(parts)
        return cast(T, _load(folder))


@dataclass(frozen=True)
class _Header:
    """What is noted beside a stage's result."""

    key: str
    seconds: float
    peak_rss_mb: float


def _header(folder: Path) -> _Header | None:
    """What is noted beside the result in a folder; None where there is none, or no such note."""
    try:
        return of_type(codec.read_header(folder), _Header, str(folder))
    except InputError:
        return None


def _store(folder: Path, value: Any, header: dict[str, Any]) -> None:
    if folder.name != _SCENE:
        codec.write(folder, value, header)
        return
    # A folder without a header holds nothing, so that a kill on the way leaves no mixture behind.
    (folder / codec.JSON_NAME).unlink(missing_ok=True)
    save_scene(value, folder / "value", replace=True)
    codec.write(folder, None, header)


def _load(folder: Path) -> object:
    return load_scene(inside(folder, "value")) if folder.name == _SCENE else codec.read(folder)


def digest(value: object) -> str:
    """SHA-256 of JSON values, arrays, paths, which count by their content, and dataclasses of them."""
    text = json.dumps(value, sort_keys=True, default=_plain)
    return hashlib.sha256(text.encode()).hexdigest()


def _plain(value: object) -> object:
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: getattr(value, field.name) for field in fields(value)}
    if isinstance(value, Path):
        return file_digest(value, deep=True)
    if isinstance(value, torch.Tensor):
        value = value.detach().cpu().numpy()
    if isinstance(value, np.ndarray):
        whole = np.ascontiguousarray(value)
        return [str(whole.dtype), list(whole.shape), hashlib.sha256(whole.data).hexdigest()]
    if isinstance(value, torch.nn.Module):
        return dict(value.state_dict())
    raise TypeError(f"a stage's options hold a {type(value).__name__}")


@cache
def program_digest() -> str:
    """SHA-256 of the package's sources and of its compiled core: another program keeps other results."""
    package = Path(__file__).resolve().parents[1]
    files = [*package.rglob("*.py"), Path(_native.__file__)]
    return digest([[file.name, hashlib.sha256(file.read_bytes()).hexdigest()] for file in sorted(files)])


def file_digest(path: Path, *, deep: bool = False) -> str:
    """SHA-256 of a file's content, or of names and contents of the files in a folder.

    Hidden files in it do not count, the folders in it if ``deep``. Links are followed.
    """
    if not path.is_dir():
        with open_file(path) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    files = sorted(file for file in _files(path, deep) if not file.name.startswith("."))
    return digest([[f.relative_to(path).as_posix(), file_digest(f)] for f in files])


def _files(folder: Path, deep: bool, within: frozenset[Path] = frozenset()) -> Iterator[Path]:
    """Files of a folder, those behind links too; ``within`` are the folders that lead there.

    ``Path.rglob`` does not enter folders that are links, which is how weights of several places are joined.
    """
    real = folder.resolve()
    if real in within:
        return
    for entry in folder.iterdir():
        if entry.is_file():
            yield entry
        elif deep and entry.is_dir():
            yield from _files(entry, deep, within | {real})


def stage_seed(seed: int, name: str) -> int:
    """A stage's own seed: results do not depend on which other stages ran before it."""
    return int(digest([seed, name])[:8], 16) % 2**31


def peak_rss_mb() -> float:
    """Largest memory this process has held so far, in megabytes."""
    unit = 1 if sys.platform == "darwin" else 1024
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6, 1)
