"""Pictures of surfaces for drawn streets, cut from real street pictures along outlines drawn by hand."""

from pathlib import Path
from typing import Annotated

import cv2
import msgspec
import numpy as np
from jaxtyping import Float
from msgspec import Meta

from dreamdrive.data.pictures.picture_file import write_picture
from dreamdrive.errors import InputError
from streetworld.edition2.light.textures import INDEX, Texture, TextureKind

_LONGEST_PX = 384
_QUALITY = 92
_BRIGHT, _BLUE = 165, 90  # of a pixel of foliage from which on it is sky, in 0..255
_LICENCES = {
    "osv5m": "CC BY-SA 4.0",
    "global_streetscapes": "CC BY-SA 4.0",
    "zod": "CC BY-SA 4.0",
    "sully_chen": "MIT",
    "comma10k": "MIT",
    "opensfm": "BSD-2-Clause",
}
"""Of the folders that textures may be cut from."""

Share = Annotated[float, Meta(ge=0, le=1)]


class TextureCut(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A quadrilateral of a picture.

    Attributes:
        picture: Path below the folder of training pictures.
        number: Number of that picture; all its cuts have the same, so that one kept out is so wholly.
        kind: What is shown.
        corners: Upper left, upper right, lower right and lower left, in shares of the picture.
        width_m: Estimated width of what is shown; of a sky the angle in degrees.
    """

    picture: str
    number: int
    kind: TextureKind
    corners: Annotated[list[tuple[Share, Share]], Meta(min_length=4, max_length=4)]
    width_m: Annotated[float, Meta(gt=0)]


def make_textures(cuts_file: Path, data_dir: Path, out_dir: Path) -> tuple[Texture, ...]:
    """Cut the listed pieces, put them straight and write them with their index; ``TextureLibrary`` reads it.

    ``data_dir`` holds the folders of training pictures whose licences are known.
    """
    cuts = msgspec.json.decode(cuts_file.read_bytes(), type=list[TextureCut])
    out_dir.mkdir(parents=True, exist_ok=True)
    made: list[Texture] = []
    for count, cut in enumerate(cuts):
        folder = cut.picture.split("/", maxsplit=1)[0]
        if folder not in _LICENCES:
            raise InputError(f"{cut.picture}: textures are cut from {', '.join(_LICENCES)} only")
        picture = cv2.imread(str(data_dir / cut.picture), cv2.IMREAD_COLOR)
        if picture is None:
            raise InputError(f"{data_dir / cut.picture} cannot be read as a picture")
        name = f"{cut.kind}-{count:04d}.jpg"
        piece = _straight(picture, cut)
        if cut.kind == "vegetation":
            _without_sky(piece, np.random.default_rng(count))
        write_picture(out_dir / name, piece, quality=_QUALITY)
        made.append(Texture(name, cut.kind, cut.number, cut.width_m, cut.picture, _LICENCES[folder]))
    (out_dir / INDEX).write_bytes(msgspec.json.format(msgspec.json.encode(made), indent=1) + b"\n")
    return tuple(made)


def _straight(picture: np.ndarray, cut: TextureCut) -> np.ndarray:
    """The piece as a rectangle; what was seen aslant is widened."""
    height, width = picture.shape[:2]
    corners = np.array(cut.corners, np.float32) * [width, height]
    shape = _size(corners, level=cut.kind in ("road", "ground"))
    target = np.array([[0, 0], [shape[0], 0], shape, [0, shape[1]]], np.float32)
    matrix = cv2.getPerspectiveTransform(corners.astype(np.float32), target)
    return cv2.warpPerspective(picture, matrix, shape, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)


def _size(corners: Float[np.ndarray, "4 2"], *, level: bool) -> tuple[int, int]:
    """Width and height in pixels of the rectangle that a quadrilateral shows."""
    edges = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    top, right, low, left = (float(e) for e in edges)
    across, down = max(top, low), max(right, left)
    if level:
        # A square on the ground whose far edge looks shorter by a ratio is that much deeper than it looks.
        down = min(down * across / max(min(top, low), 1), 1.5 * across)
    else:
        across *= max(right, left) / max(min(right, left), 1)
    scale = min(1.3, _LONGEST_PX / max(across, down))
    return max(8, round(across * scale)), max(8, round(down * scale))


def _without_sky(piece: np.ndarray, rng: np.random.Generator) -> None:
    """Foliage in place of the sky seen through it, in place (BGR)."""
    blue, green, red = (piece[..., k].astype(np.int32) for k in range(3))
    bright = np.minimum(np.minimum(blue, green), red) > _BRIGHT
    sky = bright | ((blue > 1.08 * green) & (blue > 1.08 * red) & (blue > _BLUE))
    sky = cv2.dilate(sky.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
    leaves = piece[~sky]
    if len(leaves):
        piece[sky] = leaves[rng.integers(len(leaves), size=int(sky.sum()))]
