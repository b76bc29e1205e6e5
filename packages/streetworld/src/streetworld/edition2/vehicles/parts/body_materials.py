"""Plain materials of one body."""

import numpy as np

from dreamdrive.scene.street.truth import Semantic
from streetworld.edition2.layouts.variants import Colour, Draw
from streetworld.engine import paint
from streetworld.engine.materials import Materials


class Coats:
    """Adds the materials of one body."""

    def __init__(self, draw: Draw, kind: Semantic, materials: Materials) -> None:
        self._draw, self._kind, self._materials = draw, kind, materials

    def plain(self, colour: Colour, gloss: float = 0.0) -> int:
        """One colour, nearly even."""
        image = colour * self._draw.rng.uniform(0.96, 1.04, (16, 16, 1))
        return self.picture(paint.finished(image), gloss)

    def even(self, level: int) -> int:
        """Grey without a grain: tyres, shade."""
        return self.picture(np.full((8, 8, 3), level, dtype=np.uint8))

    def cloth(self, colour: Colour) -> int:
        """Woven stuff with stripes or checks."""
        return self._materials.add(paint.cloth(self._draw.rng, colour), self._kind, repeats=True)

    def picture(self, image: paint.Image, gloss: float = 0.0) -> int:
        """Something painted."""
        return self._materials.add(image, self._kind, gloss=gloss)
