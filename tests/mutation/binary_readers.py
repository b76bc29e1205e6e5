"""What is no text: pictures, videos, arrays, weights."""

import struct
import zlib
from collections.abc import Callable
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
import torch
from PIL import Image
from safetensors.torch import save_file
from torch import nn

from dreamdrive.data.array_file import read_npy, read_npz
from dreamdrive.data.clip_reader import read_clip
from dreamdrive.data.frames.select import UNBOUNDED
from dreamdrive.data.photo import read_photo
from dreamdrive.data.pictures.images import read_image
from dreamdrive.data.pictures.picture_file import MAX_PIXELS
from dreamdrive.data.pictures.video import RATES_HZ, Video
from dreamdrive.data.splats.glb import pack_glb
from dreamdrive.data.splats.ply import pack_ply
from dreamdrive.data.splats.read_splats import read_splats
from dreamdrive.data.splats.spz import pack_spz
from dreamdrive.geometry.backends.dust3r.network.checkpoint import load_dust3r
from dreamdrive.geometry.backends.feedforward.load import read_stored
from dreamdrive.geometry.backends.files.depth import read_depth
from dreamdrive.models.weights import load_network
from dreamdrive.prior.vista.kinds import SVD
from dreamdrive.prior.vista.stored import open_weights
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.tasks.perception import CrossViewTransformer, load_cvt, save_cvt
from tests.data.splats.some import some
from tests.data.textures import texture, write_video
from tests.geometry.backends.dust3r.network.networks import tiny
from tests.geometry.backends.dust3r.network.test_checkpoint import save_hub, save_pth
from tests.mutation.reader import Reader
from tests.prior.vista.tiny import save_official
from tests.tasks.perception.streets import ON_STREET_TRUNK as TINY

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


def _read_frames(path: Path) -> None:
    sizes = {frame.rgb.shape for frame in Video.open(path).read(range(0, UNBOUNDED))}
    assert all(rows > 0 and columns > 0 for rows, columns, _ in sizes)


def _shown(name: str, **settings: Any) -> Reader:
    """A video that says how its pictures are to be shown."""
    pictures = [texture(48, 64, index) for index in range(6)]
    return Reader(
        f"video-{name}",
        lambda folder: write_video(folder / "v.mp4", pictures, **settings),
        lambda folder: _read_frames(folder / "v.mp4"),
    )


def _turned() -> Reader:
    """A video whose container turns its pictures by a right angle."""

    def write(folder: Path) -> None:
        path = write_video(folder / "v.mp4", [texture(48, 64, index) for index in range(6)])
        data, one = bytearray(path.read_bytes()), 1 << 16
        place = data.index(b"tkhd") + 44  # the matrix of the track, 16.16 fixed point
        data[place : place + 36] = struct.pack(">9i", 0, one, 0, -one, 0, 0, 48 * one, 0, 1 << 30)
        path.write_bytes(data)
        assert next(Video.open(path).read(range(0, 1))).size == (48, 64)

    return Reader("video-turned", write, lambda folder: _read_frames(folder / "v.mp4"))


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


def _avif(folder: Path) -> None:
    Image.fromarray(texture(24, 32)).save(folder / "a.avif", quality=60)


def _read_avif(folder: Path) -> None:
    raw = read_image(folder / "a.avif")
    assert raw.rgb.dtype == np.uint8
    assert raw.rgb.ndim == 3


def _photo(folder: Path) -> None:
    told = Image.Exif()
    told.get_ifd(0x8769)[0xA405] = 28
    told.get_ifd(0x8825).update({1: "N", 2: (48.0, 8.0, 30.5), 3: "E", 4: (11.0, 34.0, 0.5), 17: 90.0})
    told[0x0112] = 6
    Image.fromarray(texture(48, 64)).save(folder / "p.jpg", exif=told)


def _read_photo(folder: Path) -> None:
    photo = read_photo(folder / "p.jpg", (64, 32))
    assert photo.rgb.shape == (32, 64, 3)


_PICTURES = (
    Reader("picture-a.avif", _avif, _read_avif),
    Reader("photo", _photo, _read_photo),
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
    _shown("wide", aspect=Fraction(4, 3)),
    _shown("interlaced", flags="+ildct+ilme", **{"x264-params": "tff=1"}),
    _turned(),
)
_ARRAYS = (
    _depth("a.npz", lambda path: np.savez_compressed(path, depth_m=_DEPTH)),
    _depth("a.npy", lambda path: np.save(path, _DEPTH)),
    _depth("a.png", lambda path: cv2.imwrite(str(path), (_DEPTH * 1000).astype(np.uint16))),
    _depth("a.exr", _write_exr),
    Reader("arrays-npz", _lists, lambda f: read_npz(f / "l.npz", ("u", "v", "depth"))),
    Reader("arrays-npy", lambda f: np.save(f / "a.npy", _DEPTH), lambda f: read_npy(f / "a.npy")),
)


def _read_cvt(folder: Path) -> None:
    load_cvt(folder / "c.safetensors")


_WEIGHTS = (
    _weights("w.pth", torch.save),
    _weights("old.pth", partial(torch.save, _use_new_zipfile_serialization=False)),
    _weights("w.safetensors", save_file),
    Reader(
        "weights-feedforward",
        lambda f: save_file(_Small().state_dict(), f / "model.safetensors"),
        lambda f: read_stored(f, "a model"),
    ),
    Reader("weights-cvt", lambda f: save_cvt(CrossViewTransformer(TINY), f / "c.safetensors"), _read_cvt),
    Reader("weights-dust3r-pth", lambda f: save_pth(f / "m.pth", tiny()), lambda f: load_dust3r(f / "m.pth")),
    Reader("weights-dust3r-hub", lambda f: save_hub(f, tiny()), load_dust3r),
    Reader("weights-svd", lambda f: save_official(f / "svd.safetensors", SVD), open_weights),
)


def _splats(name: str, pack: Callable[[Gaussians], bytes]) -> Reader:
    def write(folder: Path) -> None:
        (folder / name).write_bytes(pack(some(5, 4)))

    def read(folder: Path) -> None:
        assert read_splats(folder / name)[0].problem() is None

    return Reader(f"splats-{name}", write, read)


_SPLATS = _splats("a.ply", pack_ply), _splats("a.spz", pack_spz), _splats("a.glb", pack_glb)
BINARY: tuple[Reader, ...] = (*_PICTURES, *_VIDEOS, *_ARRAYS, *_WEIGHTS, *_SPLATS)
