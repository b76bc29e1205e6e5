"""What surfaces are made of."""

from dataclasses import dataclass, field
from enum import IntEnum

from dreamdrive.world.paint import Image
from dreamdrive.world.textures import Textures


class Semantic(IntEnum):
    """Class of a pixel."""

    SKY = 0
    ROAD = 1
    MARKING = 2
    SIDEWALK = 3
    GRASS = 4
    BUILDING = 5
    VEGETATION = 6
    POLE = 7
    SIGN = 8
    CAR = 9
    VAN = 10
    TRUCK = 11
    BICYCLE = 12
    PEDESTRIAN = 13


@dataclass
class Materials:
    """All materials of a world, by index; gloss is the light mirrored when seen from straight above."""

    textures: Textures = field(default_factory=Textures)
    texture: list[int] = field(default_factory=list)
    semantic: list[int] = field(default_factory=list)
    gloss: list[float] = field(default_factory=list)

    def add(self, image: Image, semantic: Semantic, *, gloss: float = 0.0, repeats: bool = False) -> int:
        """A new material; its index."""
        self.texture.append(self.textures.add(image, repeats=repeats))
        self.semantic.append(int(semantic))
        self.gloss.append(gloss)
        return len(self.texture) - 1
