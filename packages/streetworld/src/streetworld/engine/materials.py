"""Materials of surfaces, and their images, as sharp as the view allows."""

from dataclasses import dataclass, field

import cv2
import numpy as np
from jaxtyping import Float, Int, Shaped, UInt8

from dreamdrive.scene.street.truth import Semantic
from streetworld.engine.columns import picked
from streetworld.engine.paint import Image

_TAPS = 4
_ROW = 4096  # OpenCV limits a row of its sampling maps to 32767 entries


@dataclass
class Textures:
    """Images with their halved copies in one atlas; those that do not repeat continue their last texel."""

    images: list[tuple[UInt8[np.ndarray, "h w 3"], bool]] = field(default_factory=list)
    _atlas: np.ndarray | None = None

    def add(self, image: UInt8[np.ndarray, "h w 3"], *, repeats: bool = False) -> int:
        """Keep an image; its index."""
        self.images.append((image, repeats))
        self._atlas = None
        return len(self.images) - 1

    def lookup(
        self,
        index: Int[np.ndarray, " n"],
        uv: Float[np.ndarray, "n 2"],
        along: Float[np.ndarray, "n 2"],
        width: Float[np.ndarray, " n"],
    ) -> Float[np.ndarray, "n 3"]:
        """Colours in 0..255 of the mean over narrow ellipses on the textures; 0 to 1 is once across.

        ``along`` is half of the long axis, ``width`` the short axis in units of u.
        """
        atlas = self._packed()
        first = index * self._most
        sharp = np.log2(np.maximum(width * self._size[:, 0].take(first), 1e-6))
        most, repeats = self._count.take(index) - 1, self._repeats.take(index)
        total = np.zeros((len(index), 3), dtype=np.float32)
        for tap, rank in enumerate((0, 2, 1, 3)):
            # Each tap takes its own of two neighbouring sizes: their mean blends both.
            level = np.floor(sharp + np.float32((rank + 0.5) / _TAPS)).astype(np.int32)
            tile = first + np.clip(level, 0, most)
            at = uv + np.float32((2 * tap + 1) / _TAPS - 1) * along
            at = np.clip(at - np.floor(at) * repeats[:, None], 0, 1)
            at *= picked(self._size, tile)
            at += picked(self._corner, tile)
            total += sampled(atlas, at - np.float32(0.5))
        return np.asfortranarray(total / np.float32(_TAPS))

    def _packed(self) -> np.ndarray:
        """All sizes of all images in rows, each with a frame of one texel."""
        if self._atlas is not None:
            return self._atlas
        pyramids = [_levels(image) for image, _ in self.images]
        most = max(len(p) for p in pyramids)
        self._count = np.array([len(p) for p in pyramids], dtype=np.int32)
        self._repeats = np.array([repeats for _, repeats in self.images], dtype=np.float32)
        self._most = most
        corner = np.zeros((len(pyramids), most, 2), dtype=np.float32)
        size = np.ones((len(pyramids), most, 2), dtype=np.float32)
        tiles = [(level.shape[0], i, k) for i, p in enumerate(pyramids) for k, level in enumerate(p)]
        width = max(2048, max(p[0].shape[1] for p in pyramids) + 2)
        x = y = row = 0
        for height, i, k in sorted(tiles, reverse=True):
            wide = pyramids[i][k].shape[1]
            if x + wide + 2 > width:
                x, y, row = 0, y + row, 0
            corner[i, k], size[i, k] = (x + 1, y + 1), (wide, height)
            x, row = x + wide + 2, max(row, height + 2)
        self._corner, self._size = (np.asfortranarray(t.reshape(-1, 2)) for t in (corner, size))
        atlas = np.zeros((y + row, width, 3), dtype=np.uint8)
        for (_, repeats), corners, pyramid in zip(self.images, corner, pyramids, strict=True):
            edge = cv2.BORDER_WRAP if repeats else cv2.BORDER_REPLICATE
            for (left, top), level in zip(corners.astype(int), pyramid, strict=False):
                framed = cv2.copyMakeBorder(level, 1, 1, 1, 1, edge)
                atlas[top - 1 : top - 1 + framed.shape[0], left - 1 : left - 1 + framed.shape[1]] = framed
        self._atlas = atlas
        return atlas


@dataclass
class Materials:
    """All materials of a world, by index; gloss is the light mirrored when seen from straight above.

    ``glow`` is the index of the texture of the light a surface sends out at night, -1 where it sends none.
    """

    textures: Textures = field(default_factory=Textures)
    texture: list[int] = field(default_factory=list)
    semantic: list[int] = field(default_factory=list)
    gloss: list[float] = field(default_factory=list)
    glow: list[int] = field(default_factory=list)

    def add(
        self,
        image: Image,
        semantic: Semantic,
        *,
        gloss: float = 0.0,
        repeats: bool = False,
        glow: Image | None = None,
    ) -> int:
        """A new material; its index."""
        self.glow.append(-1 if glow is None else self.textures.add(glow, repeats=repeats))
        self.texture.append(self.textures.add(image, repeats=repeats))
        self.semantic.append(int(semantic))
        self.gloss.append(gloss)
        return len(self.texture) - 1


def sampled(image: Shaped[np.ndarray, "h w c"], place: Float[np.ndarray, "n 2"]) -> Shaped[np.ndarray, "n c"]:
    """Colours between texels at places (N, 2): column and row, counted from the first texel's centre."""
    rows = max(1, -(-len(place) // _ROW))
    maps = np.zeros((2, rows * _ROW), dtype=np.float32)
    maps[:, : len(place)] = place.T
    across, down = maps.reshape(2, rows, _ROW)
    return cv2.remap(image, across, down, cv2.INTER_LINEAR).reshape(-1, image.shape[2])[: len(place)]


def _levels(image: np.ndarray) -> list[np.ndarray]:
    """The image, then each half the size of the one before, down to one texel."""
    levels = [image]
    while max(levels[-1].shape[:2]) > 1:
        height, width = levels[-1].shape[:2]
        half = max(1, width // 2), max(1, height // 2)
        levels.append(cv2.resize(levels[-1], half, interpolation=cv2.INTER_AREA))
    return levels
