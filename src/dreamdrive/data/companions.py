"""Files beside the frames of a folder: masks, depth, the same pictures again, other cameras."""

import filecmp
import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from dreamdrive.errors import InputError

_WORD = (
    "(?:masks?|alpha|matte|depth|disp|disparity|normals?|flow|conf|seg|segmentation|semantics?|instances?|labels?|"
    "panoptic|labelids|labeltrainids|instanceids|sky|dynamic|overlay|preview|thumbnail)"
)
"""Words by which names tell what is no frame."""
_BEHIND = re.compile(rf"(?:(?:[^a-z0-9]+|(?<=\d)){_WORD})+$")
_BEFORE = re.compile(rf"^(?:{_WORD}(?:[^a-z0-9]+|(?=\d)))+")
_COPY = re.compile(
    r"^(?:copy (?:\(\d+\) )?of (?P<a>.+)"
    r"|(?P<b>.+?)(?: \(\d+\)|(?: - |[ _-])(?:copy|kopie|copie|copia)(?:[ _-]?\(?\d+\)?)?))$"
)
"""Names that file managers give to copies."""
_KEPT = (".png", ".tif", ".tiff", ".bmp", ".webp", ".avif", ".jpg", ".jpeg")
"""Of the same picture in several kinds, the first of these is read: what loses nothing comes first."""
_NAMED = 3


@dataclass(frozen=True)
class Listed:
    """The files that are frames, and a sentence for the report about those that are not."""

    files: tuple[Path, ...]
    notes: tuple[str, ...] = ()


def frames_among(files: Sequence[Path]) -> Listed:
    """Those of the images of a folder that are frames, in the same order.

    An image beside a frame is none where its name is that of the frame with a word such as ``mask`` or
    ``depth``, where it is the same name in another kind of file, or a copy of it by its name and its bytes.

    Raises:
        InputError: The images are several series with the same numbers, such as those of two cameras.
    """
    stems: dict[str, list[Path]] = defaultdict(list)
    for file in files:
        stems[file.stem.casefold()].append(file)
    bare = {stem for stem in stems if _frame_of(stem) == stem}
    beside = [
        file for file in files if (stem := file.stem.casefold()) not in bare and _frame_of(stem) in bare
    ]
    left_out = set(beside)
    kept = [file for file in files if file not in left_out]
    best = {id(_best(twins)) for twins in stems.values()}
    again = [file for file in kept if id(file) not in best]
    copies = [file for file in kept if _is_copy(file, stems)]
    without = {*again, *copies}
    frames = [file for file in kept if file not in without]
    notes = [
        f"{len(out)} images beside the frames are {what} and left out, such as "
        f"{', '.join(file.name for file in out[:_NAMED])}."
        for out, what in (
            (beside, "no frames by their names"),
            (again, "the same ones in another kind of file"),
            (copies, "copies of others in the folder"),
        )
        if out
    ]
    _check_one_series(frames)
    return Listed(tuple(frames), tuple(notes))


def _frame_of(stem: str) -> str:
    """The name without the words at its end or start that tell of no frame."""
    return _BEFORE.sub("", _BEHIND.sub("", stem))


def _is_copy(file: Path, stems: Mapping[str, Sequence[Path]]) -> bool:
    """Whether its name says that it is a copy of one of the others, and it is."""
    match = _COPY.match(file.stem.casefold())
    first = stems.get(match["a"] or match["b"], ()) if match else ()
    return any(filecmp.cmp(file, other, shallow=False) for other in first)


def _best(twins: Sequence[Path]) -> Path:
    return min(twins, key=lambda file: _KEPT.index(file.suffix.lower()))


def _check_one_series(files: Sequence[Path]) -> None:
    """Refuse several series of names that count the same numbers."""
    series: dict[str, list[str]] = defaultdict(list)
    for file in files:
        parts = re.split(r"(\d+)", file.stem)
        if len(parts) > 1:
            series[f"{''.join(parts[:-2])}#{parts[-1]}"].append(parts[-2])
    groups = [(name, numbers) for name, numbers in series.items() if len(numbers) > 1]
    if len(groups) < 2 or sum(len(numbers) for _, numbers in groups) != len(files):
        return
    if all(set(numbers) == set(groups[0][1]) for _, numbers in groups):
        names = ", ".join(name for name, _ in groups[:_NAMED])
        raise InputError(
            f"{files[0].parent} holds {len(groups)} series of images with the same numbers ({names}); "
            "expected those of one camera: move each series into a folder of its own"
        )
