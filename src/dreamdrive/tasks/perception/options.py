"""Sizes of a Cross-View Transformer."""

from dataclasses import dataclass, field, replace
from typing import Literal

from dreamdrive.errors import InputError
from dreamdrive.tasks.perception.grid import BevGrid

BevClass = Literal["vehicle", "road"]
"""What is segmented."""
Trunk = Literal["b4", "street"]
"""What gives features: EfficientNet-B4's front end, as published, or the street network's."""


@dataclass(frozen=True)
class ImageSize:
    """How a camera's picture becomes the network's: it is resized, then rows above the horizon are cut off.

    Attributes:
        height_px: What is left of the height.
        width_px: Width.
        cropped_px: Rows that are cut off at the top after resizing.
    """

    height_px: int = 224
    width_px: int = 480
    cropped_px: int = 46

    def __post_init__(self) -> None:
        if min(self.height_px, self.width_px) < 1 or self.cropped_px < 0:
            raise InputError(f"{self} is no size of a picture; expected sides above 0 and no negative crop")


@dataclass(frozen=True)
class CvtOptions:
    """The network's sizes; those of the published one by default.

    Attributes:
        image: Size of the pictures.
        grid: Cells of the answer.
        classes: What is segmented, each once. The original trains one network a class.
        trunk: What gives features.
        trunk_width: Channels of the trunk "b4" as a share of EfficientNet-B4's; 1 is the original.
        dim: Channels of the street from above.
        heads: Of each attention.
        head_dim: Channels of each head.
        bottlenecks: ResNet bottlenecks behind the attention to each map of features.
        decoder: Channels of the decoder's blocks, each of which doubles rows and columns.
        head: Channels before the logits.
    """

    image: ImageSize = field(default_factory=ImageSize)
    grid: BevGrid = field(default_factory=BevGrid)
    classes: tuple[BevClass, ...] = ("vehicle",)
    trunk: Trunk = "b4"
    trunk_width: float = 1.0
    dim: int = 128
    heads: int = 4
    head_dim: int = 32
    bottlenecks: tuple[int, ...] = (2, 2)
    decoder: tuple[int, ...] = (128, 128, 64)
    head: int = 64

    def __post_init__(self) -> None:
        factor = 2 ** len(self.decoder)
        if self.grid.rows % factor or self.grid.columns % factor:
            raise InputError(
                f"a grid of {self.grid.rows} x {self.grid.columns} cells; expected multiples of {factor}, "
                f"for the decoder doubles {len(self.decoder)} times"
            )
        if not self.classes or len(set(self.classes)) != len(self.classes):
            raise InputError(f"classes {self.classes}; expected vehicle, road or both")
        if self.trunk_width <= 0 or (self.trunk != "b4" and self.trunk_width != 1):
            raise InputError(
                f"trunk_width {self.trunk_width} of {self.trunk}; expected more than 0, and 1 for street"
            )
        if self.dim % 4 or self.dim < 4:
            raise InputError(f"dim {self.dim}; expected a multiple of 4, to which bottlenecks narrow it")

    @property
    def embedding(self) -> tuple[int, int]:
        """Rows and columns of the street from above before the decoder."""
        factor = 2 ** len(self.decoder)
        return self.grid.rows // factor, self.grid.columns // factor


SMALL = CvtOptions(
    image=ImageSize(96, 208, 21), grid=BevGrid(104, 104, 100.0, 100.0), classes=("vehicle", "road")
)
"""The published trunk and attention on small pictures and cells of 0.96 m, both classes in one network.

On two cores 4.5 samples a second are learned from, with six cameras, in bfloat16.
"""
QUICK = replace(SMALL, trunk="street")
"""``SMALL`` on the street network's trunk, which is trained already: ``load_street`` puts its weights in.

On two cores with AMX 8.5 samples a second are learned from, in bfloat16, while the first two layers of the
trunk stay as they are; 6.8 where all of it learns, in float32 3.4 and 2.4.
"""
