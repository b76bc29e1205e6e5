"""Pictures of a video as it wants them shown: square pixels, upright, one moment each."""

import struct
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from itertools import chain, pairwise

import cv2
import numpy as np
from av.filter import Graph
from av.video.frame import VideoFrame
from av.video.stream import VideoStream
from jaxtyping import Int, UInt8

from dreamdrive.errors import InputError

LOOKED_AT = 6
"""Frames at the start that are looked at."""
_ASPECTS = Fraction(1, 4), Fraction(4)
"""Shapes of pixels, width over height, that a camera may have; others are damage."""
_CELL_PX = 16
_TEXTURE = 8.0
_COMBED = 1.1
_COMBED_SHARE = 0.08
"""Share of cells with two moments in them from which on pictures are interlaced: at most 0.05 on 38 recorded
drives, at least 0.09 on the same ones with every other line of the frame behind."""
_NO_PINHOLE = {"SPHERICAL": "a 360 degree picture", "STEREO3D": "two pictures, one for each eye"}


@dataclass(frozen=True)
class Presentation:
    """What is done to decoded pictures before anything else.

    Attributes:
        aspect: Width of a stored pixel over its height.
        axes: Image axes (x, y) of the upright picture by those stored (2, 2): entries are -1, 0 and 1.
        lines: Whether each picture holds two moments: of none, of those that say so, or of all.
        notes: Sentences for the report.
    """

    aspect: Fraction = Fraction(1)
    axes: tuple[tuple[int, int], tuple[int, int]] = ((1, 0), (0, 1))
    lines: str = "none"
    notes: tuple[str, ...] = ()

    def size(self, width: int, height: int) -> tuple[int, int]:
        """Width and height of what is shown of pictures stored at a size; no pixel gets lost."""
        if self.aspect >= 1:
            width = round(width * self.aspect)
        else:
            height = round(height / self.aspect)
        return (width, height) if self.axes[0][0] else (height, width)

    def apply(self, rgb: UInt8[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "h2 w2 3"]:
        """The picture as it is to be shown."""
        height, width = rgb.shape[:2]
        if self.aspect != 1:
            square = Presentation(self.aspect).size(width, height)
            rgb = np.asarray(cv2.resize(rgb, square, interpolation=cv2.INTER_LINEAR))
        (across, _), (_, down) = self.axes
        if not across:
            rgb = rgb.transpose(1, 0, 2)
            across, down = self.axes[0][1], self.axes[1][0]
        return np.ascontiguousarray(rgb[::down, ::across])

    def untangler(self, stream: VideoStream) -> Graph | None:
        """FFmpeg's filter that makes one moment of every interlaced picture; None where there is none."""
        if self.lines == "none":
            return None
        graph = Graph()
        parts = [
            graph.add_buffer(template=stream),
            graph.add("yadif", f"mode=send_frame:deint={'all' if self.lines == 'all' else 'interlaced'}"),
            graph.add("buffersink"),
        ]
        for first, second in pairwise(parts):
            first.link_to(second)
        graph.configure()
        return graph


AS_STORED = Presentation()


def presentation_of(stream: VideoStream, frames: Sequence[VideoFrame], where: str) -> Presentation:
    """What the header of a video, and a few frames at its start, ask for.

    Raises:
        InputError: The pictures are of no pinhole, by their header.
    """
    first, notes = frames[0], list[str]()
    check_flat([name for name in _NO_PINHOLE if first.side_data.get(name) is not None], where)
    aspect = _aspect(stream)
    width, height = Presentation(aspect).size(first.width, first.height)
    if aspect != 1:
        notes.append(
            f"The video's pixels are {float(aspect):.3g} times as wide as high: {first.width}x{first.height} "
            f"are shown as {width}x{height}."
        )
    axes = _axes(first)
    if axes != AS_STORED.axes:
        notes.append("The video is turned upright as its header asks.")
    if width == 2 * height and axes[0][0]:
        notes.append(
            "The pictures are twice as wide as high: if they are panoramas of 360 degrees, cut a view out of "
            "them first, such as with FFmpeg's filter v360."
        )
    combed = _combed_share(frames) > _COMBED_SHARE
    said = any(frame.interlaced_frame for frame in frames)
    lines = "none" if not combed else "flagged" if said else "all"
    if combed:
        notes.append(
            "The video is interlaced: every picture holds two moments. The lines of one are kept, the others "
            "filled in."
        )
    return Presentation(aspect, axes, lines, tuple(notes))


def check_flat(told: Iterable[str], where: str) -> None:
    """Refuse pictures of no pinhole, by what a header tells of them."""
    for each in told:
        if each in _NO_PINHOLE:
            raise InputError(
                f"{where} holds {_NO_PINHOLE[each]}, by its header; expected pictures of one pinhole camera: "
                "cut a view out of it, such as with FFmpeg's filters v360 or crop"
            )


def untangled(frames: Iterator[VideoFrame], graph: Graph | None) -> Iterator[VideoFrame]:
    """The frames through the filter, in their order; as they are without one."""
    if graph is None:
        yield from frames
        return
    for frame in chain(frames, [None]):
        graph.push(frame)
        with suppress(BlockingIOError, EOFError):
            while isinstance(shown := graph.pull(), VideoFrame):
                yield shown


def _aspect(stream: VideoStream) -> Fraction:
    """Shape of a stored pixel by the container, or by the stream; square where neither says a usable one."""
    said = stream.sample_aspect_ratio or stream.codec_context.sample_aspect_ratio
    return Fraction(said) if said and _ASPECTS[0] <= said <= _ASPECTS[1] else Fraction(1)


def _axes(frame: VideoFrame) -> tuple[tuple[int, int], tuple[int, int]]:
    """The display matrix, (x', y') = (a x + c y, b x + d y), without its scale; none if it is oblique."""
    data = frame.side_data.get("DISPLAYMATRIX")
    if data is None:
        return AS_STORED.axes
    a, b, _, c, d = struct.unpack_from("=5i", bytes(data))
    signs = np.sign([[a, c], [b, d]]) * (np.abs([[a, c], [b, d]]) > 0.5 * max(map(abs, (a, b, c, d, 1))))
    if (np.abs(signs).sum(axis=0) != 1).any() or (np.abs(signs).sum(axis=1) != 1).any():
        return AS_STORED.axes
    return tuple(signs[0].tolist()), tuple(signs[1].tolist())


def _combed_share(frames: Sequence[VideoFrame]) -> float:
    """Of the cells with texture, those where lines are nearer to the line after the next than to the next.

    Lines of one moment are nearest to their neighbours; where something moved between two moments, each line
    is nearer to those of its own.
    """
    combed = textured = 0
    for frame in frames:
        grey = frame.to_ndarray(format="gray").astype(np.int16)
        beside, after = (_cells(np.abs(grey[:-2] - grey[k : len(grey) - 2 + k])) for k in (1, 2))
        counts = beside + after > _TEXTURE
        textured += int(counts.sum())
        combed += int((counts & (beside > _COMBED * after)).sum())
    return combed / max(textured, 1)


def _cells(values: Int[np.ndarray, "h w"]) -> np.ndarray:
    rows, columns = (length // _CELL_PX for length in values.shape)
    cut = values[: rows * _CELL_PX, : columns * _CELL_PX]
    return cut.reshape(rows, _CELL_PX, columns, _CELL_PX).mean(axis=(1, 3))
