"""The kind of an input path: a video, a folder of images, or something that is no recording."""

from pathlib import Path

from dreamdrive.data.pictures.images import SUFFIXES, UNREAD, ImageFolder
from dreamdrive.data.pictures.video import Video
from dreamdrive.errors import InputError
from dreamdrive.files.given import CLIP, check_there

Source = ImageFolder | Video
"""A numbered sequence of pictures."""


def open_source(path: Path) -> Source:
    """Open a recording; of a folder with ``frames`` in it, as ``world make`` writes, the images there."""
    check_there(path, CLIP)
    if path.is_dir():
        frames = path / "frames"
        return ImageFolder.open(frames if frames.is_dir() else path)
    if path.suffix.lower() in SUFFIXES:
        raise one_frame(path)
    if path.suffix.lower() in UNREAD:
        raise InputError(f"{path} is a picture of a kind that is not read; save it as JPEG or PNG")
    if path.suffix.lower() == ".json":
        raise InputError(f"{path} is a JSON file, not a recording; a layout is taken by --prior street-world")
    return Video.open(path)


def one_frame(path: Path) -> InputError:
    """The error for an input of one picture."""
    return InputError(
        f"{path} gives a single frame, and a recorded clip needs at least two. One photo is taken by the "
        "priors vista, svd, cosmos and diffusers, which need weights: --prior vista --weights PATH"
    )
