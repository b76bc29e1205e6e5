"""Where the results of ``render`` go."""

import os
from collections.abc import Sequence
from pathlib import Path

from dreamdrive.drive import Drive
from dreamdrive.errors import InputError
from dreamdrive.files.paths import inside
from dreamdrive.show.rendering import Look

_FILES = (".mp4", ".png", ".npz")


def places(out: Path, output: Path | None, drives: Sequence[Drive], look: Look) -> list[Path]:
    """Where each drive goes: ``-o``, or ``video`` in the output folder, where no link leads elsewhere.

    ``-o`` is the result of a single drive, or the folder for those of several. What is not all colours is
    part of the default name.
    """
    if output is not None:
        _check_place(out, output)
        if len(drives) == 1:
            return [_single(output, look)]
        if output.suffix.lower() in _FILES:
            raise InputError(
                f"-o {output}: expected a folder for {len(drives)} trajectories, not the name of a file"
            )
    kind = "" if look.show == "colour" else f"_{look.show}"
    kind += {"mp4": ".mp4", "png": "", "npz": "_npz"}[look.format]
    names = [f"{drive.name}{kind}" for drive in drives]
    if output is not None:
        return [inside(output, name) for name in names]
    return [inside(out, f"video/{name}") for name in names]


def _single(output: Path, look: Look) -> Path:
    if look.format == "mp4" and output.suffix.lower() != ".mp4":
        raise InputError(f"-o {output}: expected a name that ends in .mp4")
    if look.format != "mp4" and output.suffix.lower() in _FILES:
        raise InputError(f"-o {output}: expected a folder for --format {look.format}, not the name of a file")
    if output.name in ("", ".."):
        raise InputError(f"-o {output}: expected the name of a new folder")
    return output


def _check_place(out: Path, output: Path) -> None:
    """What lies among its results stops ``generate`` from working there again."""
    place, home = (Path(os.path.realpath(path)) for path in (output, out))
    if place.is_relative_to(home) and not place.is_relative_to(home / "video"):
        raise InputError(
            f"-o {output} lies in {out}, where generate would refuse to go on beside it; choose "
            f"{out / 'video'} or another place"
        )
