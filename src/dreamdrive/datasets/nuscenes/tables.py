"""The tables of nuScenes: JSON lists of rows with tokens (Caesar et al. 2020), of which few rows are kept.

The tables of the full data set hold millions of rows in gigabytes. A file is mapped into memory, split into
rows and looked up by tokens; what nobody asks for is never decoded. The devkit is not needed.
"""

import hashlib
import mmap
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Annotated, TypeVar

import msgspec
import numpy as np
from jaxtyping import Int
from msgspec import Meta

from dreamdrive.data.formats.pandaset import Place
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import JSON_RAISES
from dreamdrive.files.paths import open_file

_NEEDED = ("scene", "sample", "sample_data", "ego_pose", "calibrated_sensor", "sensor")
"""Tables without which there are no pictures of a scene."""

Three = tuple[Place, Place, Place]
Unit = Annotated[float, Meta(ge=-1.01, le=1.01)]
Quaternion = tuple[Unit, Unit, Unit, Unit]
Token = Annotated[str, Meta(min_length=1, max_length=200)]
Micros = Annotated[int, Meta(ge=0, le=2**53)]


class Row(msgspec.Struct, frozen=True):
    """Of any table."""

    token: Token


class SceneRow(Row, frozen=True):
    """A drive of some 20 s."""

    name: str
    log_token: str = ""
    description: str = ""


class SampleRow(Row, frozen=True):
    """A time that is labelled; ``timestamp`` counts microseconds."""

    timestamp: Micros
    scene_token: str


class DataRow(Row, frozen=True):
    """A picture or a turn of a lidar."""

    sample_token: str
    ego_pose_token: str
    calibrated_sensor_token: str
    timestamp: Micros
    filename: str
    is_key_frame: bool = False
    width: int = 0
    height: int = 0


class PoseRow(Row, frozen=True):
    """Where the car was: metres, and a quaternion wxyz."""

    translation: Three
    rotation: Quaternion


class CalibratedRow(Row, frozen=True):
    """Where a sensor is mounted, and the matrix K of a camera, which counts pixels from 0."""

    sensor_token: str
    translation: Three
    rotation: Quaternion
    camera_intrinsic: list[list[float]] = []


class SensorRow(Row, frozen=True):
    """A sensor by its channel, such as ``CAM_FRONT``."""

    channel: str
    modality: str = ""


class AnnotationRow(Row, frozen=True):
    """A box in the world; ``size`` is width, length, height."""

    sample_token: str
    instance_token: str
    translation: Three
    size: tuple[
        Annotated[float, Meta(gt=0, le=1000)],
        Annotated[float, Meta(gt=0, le=1000)],
        Annotated[float, Meta(gt=0, le=1000)],
    ]
    rotation: Quaternion
    visibility_token: str = ""
    attribute_tokens: list[str] = []
    num_lidar_pts: int = -1


class InstanceRow(Row, frozen=True):
    """What is labelled over time."""

    category_token: str


class NamedRow(Row, frozen=True):
    """A category or an attribute."""

    name: str


class VisibilityRow(Row, frozen=True):
    """A share that is visible, such as ``v40-60``."""

    level: str


class LogRow(Row, frozen=True):
    """Where a drive was."""

    location: str = ""


class MapRow(Row, frozen=True):
    """A picture of a map."""

    filename: str
    log_tokens: list[str] = []


R = TypeVar("R", bound=Row)


@dataclass
class Tables:
    """Tables of one version of a data set, and what is wrong with them.

    Attributes:
        folder: With the JSON files, such as ``v1.0-mini``.
        root: Of which the names of files in the tables count.
    """

    folder: Path
    root: Path
    _faults: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))

    def has(self, name: str) -> bool:
        """Whether the file of a table is there."""
        return (self.folder / f"{name}.json").is_file()

    def rows(self, name: str, kind: type[R], by: str = "", keys: Collection[str] = ()) -> dict[str, R]:
        """Rows of a table by their tokens that are whole.

        Args:
            name: Of the table.
            kind: What its rows are.
            by: A field; then only rows in which it is one of the ``keys``. The first time all rows are looked
                at, and after that few.
            keys: See there.

        Raises:
            InputError: The file is missing or is no JSON list: it was cut off, or is another file.
        """
        path, found = self.folder / f"{name}.json", dict[str, R]()
        decode = msgspec.json.Decoder(kind).decode
        for number, raw in _rows_by(path, by, keys) if by else enumerate(_split(path)):
            try:
                row = decode(raw)
            except JSON_RAISES as error:
                self.fault(f"{name}.json: rows are damaged and left out", f"row {number}: {error}")
                continue
            if by and getattr(row, by) not in keys:
                continue
            if row.token in found:
                self.fault(f"{name}.json: tokens stand twice; their first rows count", row.token)
                continue
            found[row.token] = row
        return found

    def optional(
        self, name: str, kind: type[R], lost: str, by: str = "", keys: Collection[str] = ()
    ) -> dict[str, R]:
        """The same of a table that may be missing or damaged: there are no ``lost`` then, which is said."""
        if not self.has(name):
            self.fault(f"{name}.json is missing: there are no {lost}")
            return {}
        try:
            return self.rows(name, kind, by, keys)
        except InputError as error:
            self.fault(f"{error}: there are no {lost}")
            return {}

    def linked(
        self, rows: Iterable[R], table: str, other: str, of: Callable[[R], str], known: object
    ) -> list[R]:
        """Those rows of ``table`` that point to a known row of the ``other`` table."""
        assert isinstance(known, dict)
        kept: list[R] = []
        for row in rows:
            if of(row) in known:
                kept.append(row)
            else:
                what = f"{table}.json: rows point to no usable row of {other}.json and are left out"
                self.fault(what, f"{row.token} to {of(row)!r}")
        return kept

    def fault(self, what: str, example: str = "") -> None:
        """Note what is wrong; equal faults become one sentence with their number and the first example."""
        self._faults[what].append(example)

    @property
    def problems(self) -> tuple[str, ...]:
        """What is wrong, in sentences."""
        return tuple(
            f"{what} ({len(each)}, the first: {each[0]})" if each[0] else what
            for what, each in self._faults.items()
        )


def token(*parts: object) -> str:
    """A token that is the same for the same parts."""
    return hashlib.md5("/".join(map(str, parts)).encode(), usedforsecurity=False).hexdigest()


def find_tables(path: Path) -> list[Path]:
    """Folders with tables: the path itself, or those in it."""
    folders = [path] if _is_version(path) else sorted(path.iterdir()) if path.is_dir() else []
    return [each for each in folders if _is_version(each)]


def open_tables(path: Path) -> Tables:
    """The tables of a data set by its folder or that of a version, such as ``nuscenes/v1.0-mini``."""
    found = find_tables(path)
    if len(found) != 1:
        names = ", ".join(str(each) for each in found) or "none"
        raise InputError(
            f"{path}: expected the tables of one version of nuScenes in a folder of it, such as v1.0-mini "
            f"with scene.json, sample.json and the others; found {names}: give the folder of one version"
        )
    tables = Tables(found[0], found[0].parent)
    if missing := [f"{name}.json" for name in _NEEDED if not tables.has(name)]:
        raise InputError(
            f"{found[0]} lacks {', '.join(missing)}, without which nothing of it can be read; "
            "download the metadata again"
        )
    return tables


def _is_version(folder: Path) -> bool:
    return (folder / "scene.json").is_file() and (folder / "sample.json").is_file()


@dataclass(frozen=True)
class _Index:
    """The rows of a table in the order of one of their fields, by hashes: a full table has 2.6 million.

    Attributes:
        rows: All rows, each still text.
        hashes: Of the field, in their order.
        numbers: Of the rows, in the same order.
        damaged: Numbers of those that lack it.
    """

    rows: list[msgspec.Raw]
    hashes: Int[np.ndarray, " n"]
    numbers: Int[np.ndarray, " n"]
    damaged: list[int]


def _rows_by(path: Path, by: str, keys: Collection[str]) -> Iterator[tuple[int, msgspec.Raw]]:
    """Rows with their numbers in which a field may be one of the keys, and those that lack it."""
    with open_file(path):  # or it is said what is wrong
        changed_ns = path.stat().st_mtime_ns
    index = _index(path, by, changed_ns)
    wanted = np.array([hash(key) for key in keys], dtype=np.int64)
    ends = (np.searchsorted(index.hashes, wanted, side=side) for side in ("left", "right"))
    found = {n for low, high in zip(*ends, strict=True) for n in index.numbers[low:high].tolist()}
    for number in sorted(found.union(index.damaged)):
        yield number, index.rows[number]


@lru_cache(maxsize=6)
def _index(path: Path, by: str, changed_ns: int) -> _Index:
    """Kept for whoever reads several scenes: a full table takes seconds."""
    del changed_ns
    rows, damaged = _split(path), list[int]()
    decode = msgspec.json.Decoder(msgspec.defstruct("Keyed", [(by, str)])).decode
    hashes = np.zeros(len(rows), dtype=np.int64)
    for number, raw in enumerate(rows):
        try:
            hashes[number] = hash(getattr(decode(raw), by))
        except JSON_RAISES:
            damaged.append(number)
    order = np.argsort(hashes, kind="stable")
    return _Index(rows, hashes[order], order, damaged)


def _split(path: Path) -> list[msgspec.Raw]:
    """The rows of a table, each still text."""
    with open_file(path) as file:
        try:
            data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        except ValueError:
            raise InputError(f"{path} is empty; download it again") from None
    try:
        return msgspec.json.decode(data, type=list[msgspec.Raw])
    except JSON_RAISES as error:
        raise InputError(
            f"{path} is damaged or cut off ({error}); expected a JSON list of rows, download it again"
        ) from None
