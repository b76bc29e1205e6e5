"""What the table of readers is made of."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from dreamdrive.errors import InputError


@dataclass(frozen=True)
class Reader:
    """A reader and a sample that it takes.

    Attributes:
        name: What to call it.
        write: Writes a small valid sample into an empty folder; empty files in it are never spoilt.
        read: Reads the sample in a folder, and may assert what has to hold of the result.
        refusals: What it may raise of a spoilt sample.
        mend: Makes checksums in the folder right again, where without that all damage looks alike.
        names_file: Whether a refusal has to name the file or its folder.
        spoils: Pattern of the names of the files that are spoilt.
    """

    name: str
    write: Callable[[Path], object]
    read: Callable[[Path], object]
    refusals: tuple[type[Exception], ...] = (InputError,)
    mend: Callable[[Path], object] | None = None
    names_file: bool = True
    spoils: str = "*"
