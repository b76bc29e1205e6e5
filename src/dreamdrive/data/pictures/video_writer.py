"""Writer of MP4 videos."""

from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from av.error import FFmpegError
from av.video.reformatter import Colorspace
from jaxtyping import Float, UInt8

from dreamdrive.errors import InputError
from dreamdrive.files.output import new_file

Frame = UInt8[np.ndarray, "h w 3"] | Float[np.ndarray, "h w 3"]

# Constant rate factor of x264; 18 is commonly taken as visually lossless. Without the macroblock tree 17.5
# has the PSNR of 18 with it (43.6 and 43.7 dB recorded, 43.2 and 43.1 dB drawn), in files 2 to 3 % larger.
_QUALITY = "17.5"
# One thread: x264's output depends on how many there are. No macroblock tree: with AVX-512 it reads memory
# that nothing was written to, and five writes of the same frames gave four files.
_OPTIONS = {"crf": _QUALITY, "preset": "medium", "threads": "1", "x264-params": "mbtree=0"}


def write_video(path: Path, frames: Iterable[Frame], fps: float) -> int:
    """Write frames as H.264 in MP4 (yuv420p, BT.709), and count them; equal frames give equal bytes.

    The file appears when it is whole; a failure leaves what was there. An odd width or height is padded by
    one column or row, since yuv420p has none. Frames of one size, RGB in uint8 or float in [0, 1], are
    consumed one at a time.
    """
    if not fps > 0:
        raise ValueError(f"{path.name}: fps must be positive, got {fps}")
    with new_file(path) as partial:
        # PyAV would hide the reason of a failed open.
        partial.touch()
        try:
            count = _encode(partial, frames, fps)
        except FFmpegError as error:
            raise InputError(
                f"cannot write {path}: {error}; free some space or choose another place"
            ) from error
        if count == 0:
            raise ValueError(f"{path.name}: a video needs at least one frame")
    return count


def _encode(path: Path, frames: Iterable[Frame], fps: float) -> int:
    count, size = 0, None
    flags = {"movflags": "+faststart", "fflags": "+bitexact"}
    with av.open(str(path), "w", format="mp4", options=flags) as container:
        stream = container.add_stream(
            "libx264", rate=Fraction(fps).limit_denominator(100_000), options=_OPTIONS
        )
        stream.pix_fmt = "yuv420p"
        context = stream.codec_context
        context.colorspace = context.color_primaries = context.color_trc = 1  # BT.709

        def encode(image: np.ndarray, pts: int) -> None:
            picture = av.VideoFrame.from_ndarray(image, format="rgb24")
            picture = picture.reformat(format="yuv420p", dst_colorspace=Colorspace.ITU709)
            picture.pts = pts
            container.mux(stream.encode(picture))

        # One frame is encoded while the next is made: a renderer leaves a core idle about half of the time.
        with ThreadPoolExecutor(max_workers=1) as worker:
            encoding: Future[None] | None = None
            for frame in frames:
                image = _even(_bytes(frame))
                if size is None:
                    size = image.shape
                    stream.height, stream.width = size[:2]
                if image.shape != size:
                    raise ValueError(f"{path.name}: frame {count} is {image.shape}, the first one {size}")
                if encoding is not None:
                    encoding.result()
                encoding = worker.submit(encode, image, count)
                count += 1
            if encoding is not None:
                encoding.result()
                container.mux(stream.encode(None))
    return count


def _bytes(frame: Frame) -> np.ndarray:
    if frame.dtype == np.uint8:
        return frame
    return np.rint(np.clip(frame, 0, 1) * 255).astype(np.uint8)


def _even(image: np.ndarray) -> np.ndarray:
    """Pad to even sizes by repeating the last column and row."""
    height, width = image.shape[:2]
    return np.pad(image, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
