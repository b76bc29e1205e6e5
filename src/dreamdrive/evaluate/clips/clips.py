"""Sets of clips on disk: what is in a folder, which clips belong together, and their frames."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from dreamdrive.data.frames.select import UNBOUNDED
from dreamdrive.data.pictures.images import SUFFIXES, natural_key
from dreamdrive.data.pictures.video import Video
from dreamdrive.data.source import Source, open_source
from dreamdrive.errors import InputError
from dreamdrive.files.given import CLIPS, check_there

VIDEO_SUFFIXES = (".mp4", ".mov", ".mkv", ".avi", ".webm", ".m4v")
MAX_BYTES = 4_000_000_000
"""Size of the frames of one clip, which are held in memory."""


def open_clips(path: Path) -> dict[str, Source]:
    """The clips of a set by name, in natural order: those in a folder, or a folder of images, or a video."""
    check_there(path, CLIPS)
    if not path.is_dir() or _holds_images(path):
        return {path.stem: open_source(path)}
    inside = sorted((f for f in path.iterdir() if f.name[0] != "."), key=lambda f: natural_key(f.name))
    found = [f for f in inside if (f.is_dir() and _holds_images(f)) or f.suffix.lower() in VIDEO_SUFFIXES]
    if not found:
        raise InputError(
            f"{path} holds no clip: no images ({', '.join(SUFFIXES)}), no sub-folder with images and no "
            f"video ({', '.join(VIDEO_SUFFIXES)})"
        )
    clips: dict[str, Source] = {}
    for file in found:
        name = file.name if file.is_dir() else file.stem
        if name in clips:
            raise InputError(f"{path} holds two clips named {name}; a clip is paired by its name, rename one")
        clips[name] = open_source(file)
    return clips


def pairs_of(real: Mapping[str, Source], fake: Mapping[str, Source]) -> list[tuple[str, str]] | str:
    """Which clips show the same: equal names, or one clip each; otherwise why they cannot be paired."""
    if len(real) == len(fake) == 1:
        return list(zip(real, fake, strict=True))
    lonely = sorted(set(real) ^ set(fake), key=natural_key)
    if lonely:
        side = "real" if lonely[0] in real else "fake"
        return f"the names of the clips differ: {lonely[0]} is in the {side} set only"
    return [(name, name) for name in real]


def read_frames(source: Source) -> UInt8[np.ndarray, "f h w 3"]:
    """All frames of a clip as RGB."""
    frames: list[UInt8[np.ndarray, "h w 3"]] = []
    wanted = range(UNBOUNDED) if isinstance(source, Video) else range(source.count())
    for raw in source.read(wanted):
        if frames and raw.rgb.shape != frames[0].shape:
            (h, w), (h2, w2) = frames[0].shape[:2], raw.rgb.shape[:2]
            raise InputError(f"{source.path}: {raw.name} is {w2}x{h2}, not {w}x{h} as the frames before")
        if (len(frames) + 1) * raw.rgb.nbytes > MAX_BYTES:
            raise InputError(
                f"{source.path}: more than {len(frames)} frames do not fit into {MAX_BYTES / 1e9:g} GB; "
                "cut it into shorter clips"
            )
        frames.append(raw.rgb)
    return np.stack(frames)


def _holds_images(folder: Path) -> bool:
    return any(f.suffix.lower() in SUFFIXES and f.name[0] != "." for f in folder.iterdir())
