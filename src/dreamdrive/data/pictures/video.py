"""A video file as a source of frames."""

import os
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, islice
from pathlib import Path
from typing import BinaryIO

import av
from av.container import InputContainer
from av.error import FFmpegError
from av.stream import Disposition
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from dreamdrive.data.frames.select import UNBOUNDED, out_of_range
from dreamdrive.data.pictures.images import RawFrame
from dreamdrive.data.pictures.presentation import (
    AS_STORED,
    LOOKED_AT,
    Presentation,
    presentation_of,
    untangled,
)
from dreamdrive.errors import InputError
from dreamdrive.files.paths import open_file

MAX_PIXELS = 36_000_000
"""Pixels that a frame may have, those of 8K video: a decoder keeps up to 16 frames of a video."""
RATES_HZ = (0.01, 1000.0)
"""Rates that a video may have, from time lapse to slow motion; others are damage."""
_FORMATS = (
    "mov,mp4,m4a,3gp,3g2,mj2",
    "matroska,webm",
    *("avi", "asf", "flv", "mpegts", "mpeg", "mpegvideo", "m4v", "h264", "hevc", "ivf", "obu", "mxf", "ogg"),
    *("dv", "gif", "rm", "dhav", "yuv4mpegpipe", "wav", "mp3", "aac", "flac"),
)
"""Formats that FFmpeg may take a file for. Others play text, single pictures, or whatever a list names."""
_BARE = frozenset(("h264", "hevc", "mpegvideo", "m4v", "obu", "vvc", "avs2", "avs3"))
"""Formats of a track without a container: FFmpeg gives them 25 Hz, which nobody said."""
_CODEC = {"max_pixels": str(MAX_PIXELS)}
_OPTIONS = {"format_whitelist": ",".join(_FORMATS), "protocol_whitelist": "file", **_CODEC}

_BOXES_OF_BOXES = frozenset(
    (b"moov", b"trak", b"mdia", b"minf", b"stbl", b"moof", b"traf", b"mvex", b"udta", b"dinf", b"edts")
)
"""Boxes that hold boxes, as FFmpeg reads them."""
_MAX_BOXES = 1_000_000


@dataclass(frozen=True)
class Video:
    """The first track of pictures of a file, decoded as a stream.

    ``rate_hz`` is the mean rate by the file's own account, ``tracks`` the number of tracks of pictures.
    Without a ``clock`` the times of frames are FFmpeg's invention.
    """

    path: Path
    rate_hz: float | None
    tracks: int = 1
    clock: bool = True

    @staticmethod
    def open(path: Path) -> "Video":
        """Look at a file."""
        _check_file(path)
        try:
            with _opened(path) as container:
                stream = _pictures(container, path)
                coded = stream.codec_context
                if coded is None:  # pyright: ignore[reportUnnecessaryComparison]
                    raise InputError(
                        f"{path} holds pictures of a kind that cannot be decoded; expected H.264 or the like"
                    )
                size = coded.width, coded.height
                bare = container.format.name in _BARE
                rate = coded.framerate if bare else stream.average_rate
                tracks = len(_tracks(container))
        except FFmpegError as error:
            raise InputError(
                f"{path} is not a readable video ({error.strerror}): it is cut short, damaged or of another "
                "kind; expected a video such as MP4, or a folder of images"
            ) from error
        if size[0] * size[1] > MAX_PIXELS:
            raise InputError(
                f"{path} has frames of {size[0]}x{size[1]} pixels; expected at most {MAX_PIXELS // 10**6} "
                "megapixels: scale it down"
            )
        rate_hz = float(rate) if rate and RATES_HZ[0] <= rate <= RATES_HZ[1] else None
        return Video(path, rate_hz, tracks, clock=not bare or rate is not None)

    def count(self) -> int:
        """Number of frames, by decoding them all: what the file itself claims is often wrong."""
        return sum(1 for _ in self._decode())

    def claimed_count(self) -> int | None:
        """Number of frames by the file's own account, which may be wrong; None where it says nothing."""
        try:
            with _opened(self.path) as container:
                stream = _pictures(container, self.path)
                if stream.frames:
                    return stream.frames
                duration, base = stream.duration, stream.time_base
                seconds = None if duration is None or base is None else float(duration * base)
        except FFmpegError as error:
            raise InputError(f"{self.path} is not a readable video ({error.strerror})") from error
        return None if seconds is None or self.rate_hz is None else round(seconds * self.rate_hz)

    def read(self, wanted: range) -> Iterator[RawFrame]:
        """The wanted frames in decode order, one at a time; decoding stops behind the last."""
        index, first_s, damaged = -1, None, False
        for index, (frame, shown) in enumerate(self._decode(wanted)):
            now_s = _time_s(frame) if self.clock else None
            first_s = now_s if index == 0 else first_s
            # Only the frame that could not be read is marked; those that refer to it are as bad.
            damaged = frame.is_corrupt or (damaged and not frame.key_frame)
            if index in wanted:
                time_s = None if now_s is None or first_s is None else now_s - first_s
                yield RawFrame(
                    index,
                    f"frame {index}",
                    shown.apply(frame.to_ndarray(format="rgb24")),
                    None,
                    time_s,
                    shown.notes,
                    damaged,
                )
            if index >= wanted[-1]:
                return
        if index < 0:
            raise InputError(f"{self.path}: not a single frame could be read")
        if wanted.stop != UNBOUNDED or index < wanted.start:
            missing = wanted.start if wanted.stop == UNBOUNDED else wanted[-1]
            raise out_of_range(missing, index + 1, str(self.path))

    def _presentation(self, stream: VideoStream, first: Sequence[VideoFrame]) -> Presentation:
        """How to show the pictures, by the header and those at the start."""
        if not first:
            return AS_STORED
        found = presentation_of(stream, first, str(self.path))
        if self.tracks == 1:
            return found
        said = f"The file has {self.tracks} tracks of pictures: the first is read."
        return replace(found, notes=(*found.notes, said))

    def _decode(self, wanted: range | None = None) -> Iterator[tuple[VideoFrame, Presentation]]:
        """The frames and how to show them; as they are stored where none is wanted and all are counted."""
        done = 0
        try:
            with _opened(self.path) as container:
                stream = _pictures(container, self.path)
                stream.codec_context.options = _CODEC
                frames, shown = container.decode(stream), AS_STORED
                if wanted is not None:
                    first, frames = _looked_at(frames)
                    shown = self._presentation(stream, first)
                for frame in untangled(frames, shown.untangler(stream)):
                    yield frame, shown
                    done += 1
        except FFmpegError as error:
            asked = f", frame {wanted[-1]} is asked for" if wanted and wanted.stop != UNBOUNDED else ""
            advice = (
                f"choose among them with --frames, such as 0:{done}" if done > 1 else "copy the file again"
            )
            raise InputError(
                f"{self.path} is cut short or damaged: only {done} frames could be read{asked} "
                f"({error.strerror}); {advice}"
            ) from error


def _looked_at(frames: Iterator[VideoFrame]) -> tuple[list[VideoFrame], Iterator[VideoFrame]]:
    """The frames at the start, and all of them; damage among the first is met where it lies."""
    first = list[VideoFrame]()
    try:
        first += islice(frames, LOOKED_AT)
    except FFmpegError as error:
        return first, chain(first, _failing(error))
    return first, chain(first, frames)


def _failing(error: FFmpegError) -> Iterator[VideoFrame]:
    raise error
    yield  # makes this an iterator, which fails when it is reached


def _check_file(path: Path) -> None:
    """Refuse what is no plain file, is empty, or claims what would fill memory."""
    with open_file(path) as file:
        size = os.fstat(file.fileno()).st_size
        if size == 0:
            raise InputError(f"{path} is empty; expected a video")
        _check_tables(file, size, str(path))


def _check_tables(file: BinaryIO, size: int, where: str) -> None:
    """Refuse tables that claim more samples than the file has bytes; other kinds of files pass."""
    file.seek(0)
    if file.read(8)[4:] not in (b"ftyp", b"moov", b"mdat", b"free", b"wide", b"skip", b"styp"):
        return
    for count, (kind, place) in enumerate(_boxes(file, 0, size)):
        if count > _MAX_BOXES:
            raise InputError(f"{where} is not a readable video: it consists of more than {_MAX_BOXES} parts")
        if kind in (b"stsz", b"trun"):
            file.seek(place)
            content = file.read(12).ljust(12, b"\0")
            each, samples = struct.unpack_from(">II", content, 4)
            if kind == b"trun":
                each, samples = 1, each
            if each * samples > size:
                raise InputError(
                    f"{where} is not a readable video: it claims {samples} samples, more than its "
                    f"{size} bytes can hold; copy it again"
                )


def _boxes(file: BinaryIO, start: int, stop: int) -> Iterator[tuple[bytes, int]]:
    """Kind and place of the content of all boxes, those inside others too."""
    ends = [stop]
    while ends:
        if start + 8 > ends[-1]:
            start = ends.pop()
            continue
        file.seek(start)
        head = file.read(16)
        length, kind = int.from_bytes(head[:4], "big"), head[4:8]
        skip = 8
        if length == 1:
            length, skip = int.from_bytes(head[8:16], "big"), 16
        end = min(start + length, ends[-1]) if length else ends[-1]
        yield kind, start + skip
        if kind in _BOXES_OF_BOXES:
            ends.append(max(end, start + skip))
            start += skip
        else:
            start = max(end, start + skip)


def _opened(path: Path) -> InputContainer:
    # Without the prefix a name such as concat:a would be taken for an address.
    return av.open(f"file:{path}", options=_OPTIONS, metadata_errors="replace")


def _pictures(container: InputContainer, path: Path) -> VideoStream:
    """The first track of pictures that is no cover."""
    for stream in _tracks(container):
        return stream
    raise InputError(f"{path} holds no picture track; expected a video")


def _tracks(container: InputContainer) -> list[VideoStream]:
    return [each for each in container.streams.video if not each.disposition & Disposition.attached_pic]


def _time_s(frame: VideoFrame) -> float | None:
    """Presentation time, or ``None`` where the file has no clock."""
    return None if frame.pts is None or not frame.time_base else float(frame.pts * frame.time_base)
