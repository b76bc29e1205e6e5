"""A video file as a source of frames."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import av
import numpy as np
from av.error import FFmpegError
from av.video.frame import VideoFrame

from dreamdrive.data.frame import RawFrame
from dreamdrive.data.select import UNBOUNDED, out_of_range
from dreamdrive.errors import InputError

_NOT_VIDEO = ("tty", "image2")
"""Formats that FFmpeg plays as video although they are text or a single picture."""


@dataclass(frozen=True)
class Video:
    """The first video track of a file, decoded as a stream.

    Attributes:
        path: The file.
        rate_hz: Mean frame rate by the file's own account, or ``None``.
    """

    path: Path
    rate_hz: float | None

    @staticmethod
    def open(path: Path) -> "Video":
        """Look at a file.

        Raises:
            InputError: It is empty, cut short before its index, or no video.
        """
        if path.stat().st_size == 0:
            raise InputError(f"{path} is empty; expected a video")
        try:
            with av.open(str(path)) as container:
                if container.format.name in _NOT_VIDEO or container.format.name.endswith("_pipe"):
                    raise InputError(f"{path} is not a video ({container.format.long_name})")
                if not container.streams.video:
                    raise InputError(f"{path} holds no picture track; expected a video")
                rate = container.streams.video[0].average_rate
        except FFmpegError as error:
            raise InputError(
                f"{path} is not a readable video ({error.strerror}): it is cut short, damaged or of another "
                "kind; expected a video such as MP4, or a folder of images"
            ) from error
        return Video(path, float(rate) if rate else None)

    def count(self) -> int:
        """Number of frames, by decoding them all: what the file itself claims is often wrong.

        Raises:
            InputError: Decoding breaks off.
        """
        return sum(1 for _ in self._decode())

    def read(self, wanted: range) -> Iterator[RawFrame]:
        """The wanted frames in decode order, one at a time; decoding stops behind the last.

        Raises:
            InputError: The file ends or breaks off before the last wanted frame.
        """
        index, first_s, damaged = -1, None, False
        for index, frame in enumerate(self._decode(wanted)):
            first_s = _time_s(frame) if index == 0 else first_s
            # Only the frame that could not be read is marked; those that refer to it are as bad.
            damaged = frame.is_corrupt or (damaged and not frame.key_frame)
            if index in wanted:
                yield _raw(frame, index, first_s, damaged)
            if index >= wanted[-1]:
                return
        if index < 0:
            raise InputError(f"{self.path}: not a single frame could be read")
        if wanted.stop != UNBOUNDED or index < wanted.start:
            missing = wanted.start if wanted.stop == UNBOUNDED else wanted[-1]
            raise out_of_range(missing, index + 1, str(self.path))

    def _decode(self, wanted: range | None = None) -> Iterator[VideoFrame]:
        done = 0
        try:
            with av.open(str(self.path)) as container:
                for frame in container.decode(video=0):
                    yield frame
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


def _raw(frame: VideoFrame, index: int, first_s: float | None, damaged: bool) -> RawFrame:
    rgb = frame.to_ndarray(format="rgb24")
    quarters = round(frame.rotation / 90) % 4
    notes: list[str] = []
    if quarters:
        rgb = np.ascontiguousarray(np.rot90(rgb, quarters))
        notes.append("The video is turned upright as its header asks.")
    now_s = _time_s(frame)
    time_s = None if now_s is None or first_s is None else now_s - first_s
    return RawFrame(index, f"frame {index}", rgb, None, time_s, tuple(notes), damaged)


def _time_s(frame: VideoFrame) -> float | None:
    """Presentation time, or ``None`` where the file has no clock."""
    return None if frame.pts is None or not frame.time_base else float(frame.pts * frame.time_base)
