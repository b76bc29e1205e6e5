"""What is no text: pictures, videos, arrays, weights."""

import zlib
from collections.abc import Callable
from functools import partial
from pathlib import Path

import av
import cv2
import numpy as np
import torch
from safetensors.torch import save_file
from torch import nn

from dreamdrive.data.array_file import read_npy, read_npz
from dreamdrive.data.clip_reader import read_clip
from dreamdrive.data.images import read_image
from dreamdrive.data.picture_file import MAX_PIXELS
from dreamdrive.data.select import UNBOUNDED
from dreamdrive.data.video import RATES_HZ, Video
from dreamdrive.geometry.backends.dust3r.network.checkpoint import load_dust3r
from dreamdrive.geometry.backends.feedforward.load import read_stored
from dreamdrive.geometry.backends.files.depth import read_depth
from dreamdrive.models.weights import load_network
from dreamdrive.prior.vista.kinds import SVD
from dreamdrive.prior.vista.stored import open_weights
from tests.data.pictures import texture
from tests.geometry.backends.dust3r.network.networks import tiny
from tests.geometry.backends.dust3r.network.test_checkpoint import save_hub, save_pth
from tests.mutation.reader import Reader
from tests.prior.vista.tiny import save_official

_DEPTH = np.linspace(1, 50, 600, dtype=np.float32).reshape(20, 30)


class _Small(nn.Module):
    def __init__(self) -> None:
        super().__init__()
        self.layer = nn.Linear(4, 3)
        self.bn = nn.BatchNorm1d(3)


def _mend_png(name: str, folder: Path) -> None:
    """Make the checksums of all parts right."""
    data = bytearray((folder / name).read_bytes())
    place = 8
    while place + 12 <= len(data):
        end = place + 8 + int.from_bytes(data[place : place + 4], "big")
        data[end : end + 4] = zlib.crc32(data[place + 4 : end]).to_bytes(4, "big")
        place = end + 4
    (folder / name).write_bytes(data)


def _picture(name: str, image: np.ndarray, *flags: int) -> Reader:
    def read(folder: Path) -> None:
        raw = read_image(folder / name)
        assert raw.rgb.dtype == np.uint8
        assert raw.rgb.shape[2] == 3
        assert raw.rgb.size <= 3 * MAX_PIXELS
        assert raw.opaque is None or raw.opaque.shape == raw.rgb.shape[:2]

    mend = partial(_mend_png, name) if name.endswith(".png") else None
    return Reader(f"picture-{name}", lambda f: cv2.imwrite(str(f / name), image, flags), read, mend=mend)


def _folder(folder: Path) -> None:
    (folder / "frames").mkdir()
    for i in range(3):
        cv2.imwrite(str(folder / "frames" / f"{i}.png"), texture(24, 32, i))


def _read_clip(name: str, folder: Path) -> None:
    clip = read_clip(folder / name)
    assert (np.diff(clip.times_s) > 0).all()
    assert len(clip) >= 2


def _video(name: str, codec: str = "libx264", **options: str) -> Reader:
    def write(folder: Path) -> None:
        with av.open(str(folder / name), "w", options=options) as container:
            stream = container.add_stream(codec, rate=20, options={"g": "4"})
            stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
            for index in range(8):
                container.mux(
                    stream.encode(av.VideoFrame.from_ndarray(texture(48, 64, index), format="rgb24"))
                )
            container.mux(stream.encode())

    def read(folder: Path) -> None:
        video = Video.open(folder / name)
        assert video.rate_hz is None or RATES_HZ[0] <= video.rate_hz <= RATES_HZ[1]
        for frame in video.read(range(0, UNBOUNDED)):
            assert frame.time_s is None or np.isfinite(frame.time_s)

    return Reader(f"video-{Path(name).stem}-{Path(name).suffix[1:]}", write, read)


def _depth(name: str, write: Callable[[Path], object]) -> Reader:
    def read(folder: Path) -> None:
        depth, _ = read_depth(folder / name, None)
        assert np.isfinite(depth).all()
        assert (depth >= 0).all()

    return Reader(f"depth-{name}", lambda f: write(f / name), read)


def _write_exr(path: Path) -> None:
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"Z": _DEPTH}).write(str(path))


def _lists(folder: Path) -> None:
    np.savez(folder / "l.npz", u=np.arange(9), v=np.arange(9.0), depth=np.ones(9, np.float32))


def _weights(name: str, write: Callable[[dict[str, torch.Tensor], Path], object]) -> Reader:
    def read(folder: Path) -> None:
        network = load_network(_Small, folder / name, "small weights")
        assert all(torch.isfinite(value).all() for value in network.state_dict().values())

    return Reader(f"weights-{name}", lambda f: write(_Small().state_dict(), f / name), read)


_PICTURES = (
    _picture("a.png", texture(24, 32)),
    _picture("alpha.png", np.dstack([texture(24, 32), texture(24, 32)[..., 0]])),
    _picture("deep.png", texture(24, 32).astype(np.uint16) * 257),
    _picture("a.jpg", texture(24, 32)),
    _picture("scans.jpg", texture(24, 32), cv2.IMWRITE_JPEG_PROGRESSIVE, 1),
    _picture("a.webp", texture(24, 32), cv2.IMWRITE_WEBP_QUALITY, 60),
    _picture("alpha.webp", np.dstack([texture(24, 32), texture(24, 32)[..., 0]])),
    _picture("a.tif", texture(24, 32)),
    _picture("a.bmp", texture(24, 32)),
    Reader("picture-folder", _folder, partial(_read_clip, "frames")),
)
_VIDEOS = (
    _video("a.mp4"),
    _video("fragments.mp4", movflags="frag_keyframe+empty_moov"),
    _video("a.mkv"),
    _video("a.avi", "mpeg4"),
    _video("a.ts"),
)
_ARRAYS = (
    _depth("a.npz", lambda path: np.savez_compressed(path, depth_m=_DEPTH)),
    _depth("a.npy", lambda path: np.save(path, _DEPTH)),
    _depth("a.png", lambda path: cv2.imwrite(str(path), (_DEPTH * 1000).astype(np.uint16))),
    _depth("a.exr", _write_exr),
    Reader("arrays-npz", _lists, lambda f: read_npz(f / "l.npz", ("u", "v", "depth"))),
    Reader("arrays-npy", lambda f: np.save(f / "a.npy", _DEPTH), lambda f: read_npy(f / "a.npy")),
)
_WEIGHTS = (
    _weights("w.pth", torch.save),
    _weights("old.pth", partial(torch.save, _use_new_zipfile_serialization=False)),
    _weights("w.safetensors", save_file),
    Reader(
        "weights-feedforward",
        lambda f: save_file(_Small().state_dict(), f / "model.safetensors"),
        lambda f: read_stored(f, "a model"),
    ),
    Reader("weights-dust3r-pth", lambda f: save_pth(f / "m.pth", tiny()), lambda f: load_dust3r(f / "m.pth")),
    Reader("weights-dust3r-hub", lambda f: save_hub(f, tiny()), load_dust3r),
    Reader("weights-svd", lambda f: save_official(f / "svd.safetensors", SVD), open_weights),
)
BINARY: tuple[Reader, ...] = (*_PICTURES, *_VIDEOS, *_ARRAYS, *_WEIGHTS)
