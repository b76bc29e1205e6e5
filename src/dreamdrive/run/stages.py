"""Stages whose results are kept: the same input and options are never computed twice."""

import logging
import resource
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, TypeVar, cast, get_args

from dreamdrive.errors import InputError
from dreamdrive.files.digest import digest
from dreamdrive.files.json_file import of_type
from dreamdrive.files.output import remove
from dreamdrive.files.paths import inside
from dreamdrive.names import Stage
from dreamdrive.progress import Progress, StageProgress, Work, trusted
from dreamdrive.run import codec
from dreamdrive.run.program import program_of
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


@dataclass
class Stages:
    """Reads what an earlier run of the same stages left, and leaves what it computes, a folder for each.

    The key of a result holds its options, the keys of all stages before it, and the program that the stage
    is, see ``program_of``: a result is found again only by the program that made it. Those of
    ``recompute_from`` and later stages are not read. ``claim`` is called before something is written, ``say``
    with a sentence for somebody who waits, ``then`` of a stage with a result that was just computed. Records
    are those of each stage that ran.
    """

    folder: Path
    recompute_from: str | None
    progress: StageProgress
    claim: Callable[[], None]
    records: dict[str, StageRecord] = field(default_factory=dict)
    then: dict[str, Callable[[Any], None]] = field(default_factory=dict)
    say: Callable[[str], None] = lambda sentence: None
    _began_s: float = field(default_factory=time.perf_counter, init=False)
    _last: str = field(default="", init=False)
    _told: bool = field(default=False, init=False)

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
        self._last = digest([name, program_of(name), options if given is None else given, self._last])
        return self._kept(name, compute, check) if given is None else given

    @property
    def whole_s(self) -> float:
        """What all of it took until now: this run, and the stages that an earlier one left."""
        kept = sum(record.seconds for record in self.records.values() if record.cached)
        return time.perf_counter() - self._began_s + kept

    def _kept(self, name: str, compute: Callable[[Work], T], check: Callable[[T], None]) -> T:
        folder = inside(self.folder, name)
        fresh = self.recompute_from is not None and STAGES.index(name) >= STAGES.index(self.recompute_from)
        found = None if fresh else _header(folder)
        if found is not None and found.program != program_of(name) and not self._told:
            self._told = True
            self.say(f"The program has changed since: {name} and what rests on it are computed again.")
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
        _store(folder, value, asdict(_Header(key, record.seconds, record.peak_rss_mb, program_of(name))))
        remove(parts)
        stored = cast(T, _load(folder))
        if name in self.then:
            self.then[name](stored)
        return stored


@dataclass(frozen=True)
class _Header:
    """What is noted beside a stage's result."""

    key: str
    seconds: float
    peak_rss_mb: float
    program: str = ""


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


def peak_rss_mb() -> float:
    """Largest memory this process has held so far, in megabytes."""
    unit = 1 if sys.platform == "darwin" else 1024
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6, 1)
