"""Materials of what stands beside the road, each painted once a world."""

from collections.abc import Callable

import numpy as np

from dreamdrive.scene.street.truth import Semantic
from streetworld.edition2.light.textures import TextureKind, TextureLibrary, levelled, recoloured
from streetworld.engine import paint
from streetworld.engine.materials import Materials

_ANY: tuple[TextureKind, ...] = ("facade", "road", "ground", "vegetation", "clutter", "sky")
_WRONG = 0.15
"""Share of surfaces that show a picture of something else: shape then says more than texture."""


class Paints:
    """Makes materials and finds them again."""

    def __init__(self, materials: Materials, textures: TextureLibrary | None) -> None:
        self._materials, self._textures = materials, textures
        self._made = dict[tuple[object, ...], int]()

    def get(
        self,
        key: tuple[object, ...],
        kind: Semantic,
        make: Callable[[], paint.Image],
        *,
        gloss: float = 0.0,
        glow: Callable[[], paint.Image] | None = None,
    ) -> int:
        """Index of the material of a key."""
        if key not in self._made:
            light = None if glow is None else glow()
            self._made[key] = self._materials.add(make(), kind, gloss=gloss, repeats=True, glow=light)
        return self._made[key]

    def plain(self, key: tuple[object, ...], kind: Semantic, colour: object, gloss: float = 0.0) -> int:
        """A surface of one colour (0..255) with stains and grain."""
        rng = np.random.default_rng(81)
        return self.get(
            (*key, tuple(np.asarray(colour).astype(int).tolist())),
            kind,
            lambda: paint.plain(rng, 2.0, 2.0, tuple(np.asarray(colour, float).tolist())),
            gloss=gloss,
        )

    def cut(
        self, kind: TextureKind, look: int, rng: np.random.Generator, share: float
    ) -> tuple[paint.Image, float] | None:
        """In a share of the cases a cut picture of a kind, sometimes of another, and its width in metres."""
        if self._textures is None or rng.random() >= share:
            return None
        if rng.random() < _WRONG:
            kind = _ANY[int(rng.integers(len(_ANY)))]
        found = self._textures.pick(kind, look, rng)
        if found is None:
            return None
        width = found[1].width_m if found[1].kind != "sky" else float(rng.uniform(4, 20))
        return recoloured(rng, levelled(found[0], found[1].kind)), width
