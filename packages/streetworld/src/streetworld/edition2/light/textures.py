"""Pictures of real surfaces, cut from street pictures: what the painted surfaces are mixed with."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, get_args

import cv2
import msgspec
import numpy as np
from jaxtyping import UInt8
from msgspec import Meta

from dreamdrive.errors import InputError
from dreamdrive.files.json_file import JSON_RAISES
from dreamdrive.files.paths import inside, read_bytes, read_text
from streetworld.engine.paint import Image

TextureKind = Literal["facade", "road", "ground", "vegetation", "sky", "clutter"]
KINDS: tuple[TextureKind, ...] = get_args(TextureKind)
INDEX = "index.json"
_MOST_BYTES = 10_000_000
"""Of a JPEG."""
KEPT_OUT = 4
"""Of five textures the one of this remainder is kept for the looks of the same remainder: no street that a
network is trained on shows it, when those looks are left out."""


class Texture(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """One picture of a surface.

    Attributes:
        file: JPEG beside the index.
        kind: What it shows.
        number: Its number among all cuts; those with remainder ``KEPT_OUT`` by 5 are kept out.
        width_m: Estimated width of what is shown; of a sky the angle in degrees.
        source: Where it was cut from.
        licence: Licence of that picture.
    """

    file: str
    kind: TextureKind
    number: int
    width_m: Annotated[float, Meta(gt=0)]
    source: str
    licence: str

    @property
    def kept_out(self) -> bool:
        """Whether only looks of the same remainder use it."""
        return self.number % 5 == KEPT_OUT


@dataclass(frozen=True)
class TextureLibrary:
    """Textures of a folder, still as JPEG."""

    textures: tuple[Texture, ...]
    encoded: tuple[bytes, ...]

    @staticmethod
    def read(folder: Path) -> "TextureLibrary":
        """The textures that ``make_textures`` wrote."""
        index = folder / INDEX
        if not index.is_file():
            raise InputError(f"{folder} has no {INDEX}: textures are made by training/make_textures.py")
        try:
            found = msgspec.json.decode(read_text(index), type=tuple[Texture, ...])
        except JSON_RAISES as error:
            raise InputError(f"{index} is no list of textures ({error}); make them again") from None
        files = (inside(folder, each.file) for each in found)
        return TextureLibrary(found, tuple(read_bytes(file, at_most=_MOST_BYTES) for file in files))

    def pick(self, kind: TextureKind, look: int, rng: np.random.Generator) -> tuple[Image, Texture] | None:
        """A texture of a kind for a look, RGB, or None where there is none of the kind."""
        kept = look % 5 == KEPT_OUT
        pool = [i for i, t in enumerate(self.textures) if t.kind == kind and t.kept_out == kept]
        if not pool:
            return None
        chosen = pool[int(rng.integers(len(pool)))]
        picture = cv2.imdecode(np.frombuffer(self.encoded[chosen], np.uint8), cv2.IMREAD_COLOR)
        if picture is None:
            raise InputError(f"{self.textures[chosen].file} of the textures is no picture; make them again")
        return np.ascontiguousarray(picture[..., ::-1]), self.textures[chosen]


def mirrored_tile(image: Image) -> UInt8[np.ndarray, "2*h 2*w 3"]:
    """The image beside and above its mirror images, which repeats without a seam."""
    twice = np.concatenate([image, image[:, ::-1]], axis=1)
    return np.concatenate([twice, twice[::-1]], axis=0)


_LEVEL = {"facade": 132.0, "road": 96.0, "ground": 118.0, "vegetation": 92.0, "clutter": 115.0}
"""Mean brightness of surfaces in even light, 0..255."""
_NEUTRAL = {"road": 0.75}
"""Share of a tint that is taken off: that of cameras, as asphalt is grey."""


def levelled(image: Image, kind: TextureKind) -> Image:
    """The image about as bright as surfaces of its kind are in even light, and less tinted."""
    mean = np.maximum(image.mean(axis=(0, 1)), 8)
    gain = (_LEVEL.get(kind, 120.0) / max(float(mean.mean()), 12.0)) ** 0.6
    table = np.arange(256)[:, None] * gain * (mean.mean() / mean) ** _NEUTRAL.get(kind, 0.35)
    return cv2.LUT(image, np.clip(table, 0, 255).astype(np.uint8)[None])


def recoloured(rng: np.random.Generator, image: Image, strength: float = 1.0) -> Image:
    """The image a little lighter or darker and of another tint."""
    gain = np.exp(rng.normal(0, 0.16 * strength) + rng.normal(0, 0.05 * strength, 3))
    table = np.clip(np.arange(256)[:, None] * gain, 0, 255).astype(np.uint8)
    return cv2.LUT(image, np.ascontiguousarray(table[None]))
