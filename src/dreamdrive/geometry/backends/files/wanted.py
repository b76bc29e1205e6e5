"""The selected frames of a clip, as readers look for them in a file."""

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np
from jaxtyping import Float, Int

from dreamdrive.data.pictures.images import ImageFolder, natural_key
from dreamdrive.data.source import open_source
from dreamdrive.errors import InputError
from dreamdrive.scene.clip import Clip


class PosesMissingError(InputError):
    """Some of the selected frames have no pose; ``kept`` are the others (K,), by their place among them."""

    def __init__(self, message: object, kept: Int[np.ndarray, " k"] | None = None) -> None:
        super().__init__(message)
        self.kept = np.zeros(0, dtype=np.int64) if kept is None else kept


@dataclass(frozen=True)
class Wanted:
    """What is known of the frames for which geometry is wanted."""

    index: Int[np.ndarray, " f"]  # in the source
    times_s: Float[np.ndarray, " f"]  # since frame 0 of the source
    names: tuple[str, ...] | None  # of the files, where the source is a folder of images
    folder: str  # name of the source
    picture: tuple[int, int]  # width and height in the source; in the clip where they are not known
    count: Callable[[], int]  # of frames in the source; may take as long as decoding it

    @staticmethod
    def of(clip: Clip, source: Path | None) -> "Wanted":
        """The frames of a clip, of this recording or of the one that it says that it came from."""
        taken = clip.recorded
        index = np.asarray(clip.source_index)
        period = float(np.median(np.diff(clip.times_s) / np.diff(index))) if len(index) > 1 else 0.0
        times_s = clip.times_s + period * index[0]
        # A drawn clip has no recording: its frames are all there are.
        if taken is None:
            return Wanted(index, times_s, None, "", clip.size, lambda: int(index.max()) + 1)
        path = source or Path(taken.path)
        names = None
        if not taken.is_video:
            folder = open_source(path)
            assert isinstance(folder, ImageFolder)
            names = tuple(folder.files[int(i)].name for i in index)
        name = path.resolve().name
        return Wanted(index, times_s, names, name, taken.size, lambda: open_source(path).count())

    @property
    def labels(self) -> tuple[str, ...]:
        """How files that belong to single frames are called: as the image, or its index in four digits."""
        if self.names is None:
            return tuple(f"{int(i):04d}" for i in self.index)
        return tuple(PurePosixPath(name).stem for name in self.names)

    def rows(self, names: Sequence[str], where: str) -> tuple[Int[np.ndarray, " f"], tuple[str, ...]]:
        """The row of each selected frame in a list of named pictures, and what to say about it.

        Names decide, without their folders and then without their endings. Where none is that of a selected
        frame the natural order of the names counts, if there is one for each frame of the source or for each
        selected frame.
        """
        paths = [PurePosixPath(name.replace("\\", "/")) for name in names]
        by_name: dict[str, list[int]] = defaultdict(list)
        by_stem: dict[str, list[int]] = defaultdict(list)
        for row, path in enumerate(paths):
            by_name[path.name].append(row)
            by_stem[path.stem].append(row)
        found: list[int | None] = []
        for name in self.names or ():
            rows = by_name.get(name) or by_stem.get(PurePosixPath(name).stem) or []
            found.append(self._one(rows, paths, name, where))
        if not any(row is not None for row in found):
            return self._in_order(names, where)
        missing = [name for name, row in zip(self.names or (), found, strict=True) if row is None]
        if missing:
            more = f" and {len(missing) - 8} more" if len(missing) > 8 else ""
            raise PosesMissingError(
                f"{where} has no pose for {len(missing)} of the {len(found)} selected frames: "
                f"{', '.join(missing[:8])}{more}",
                np.flatnonzero([row is not None for row in found]),
            )
        return np.array(found, np.intp), ()

    def _one(self, rows: list[int], paths: Sequence[PurePosixPath], wanted: str, where: str) -> int | None:
        """The one of several rows that lies in a folder like the source's."""
        if len(rows) > 1:
            rows = [row for row in rows if paths[row].parent.name == self.folder] or rows
        if len(rows) > 1:
            same = ", ".join(str(paths[row]) for row in rows[:4])
            raise InputError(
                f"{where} has several pictures called {wanted}: {same}; "
                "name the input folder like one of their folders"
            )
        return rows[0] if rows else None

    def _in_order(self, names: Sequence[str], where: str) -> tuple[Int[np.ndarray, " f"], tuple[str, ...]]:
        order = np.array(sorted(range(len(names)), key=lambda row: natural_key(names[row])), np.intp)
        if len(order) == len(self.index):
            meant, chosen = "selected frame", order
        elif len(order) == self.count():
            meant, chosen = "frame of the input", order[self.index]
        else:
            like = f", none of them called like the input's, such as {self.names[0]}" if self.names else ""
            few = ", ".join(names[int(row)] for row in order[:3])
            raise InputError(
                f"{where} has poses for {len(names)} pictures ({few}){like}; expected one for each of the "
                f"{self.count()} frames of the input or of the {len(self.index)} selected ones"
            )
        return chosen, (f"The pictures of {where} count in the order of their names, one for each {meant}.",)
