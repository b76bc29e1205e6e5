"""Cross-View Transformers: the street from above out of the pictures of any number of cameras.

Zhou and Krähenbühl 2022. The original is bradyz/cross_view_transformers; keys of weights are its own.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import torch
from jaxtyping import Float, UInt8
from torch import Tensor, nn

from dreamdrive.tasks.perception.network.backbone import EfficientNetFront
from dreamdrive.tasks.perception.network.constants import MEAN, SPREAD
from dreamdrive.tasks.perception.network.cross_view import BevEmbedding, CrossView
from dreamdrive.tasks.perception.network.decoder import BevDecoder, Bottleneck
from dreamdrive.tasks.perception.network.street_trunk import StreetTrunk
from dreamdrive.tasks.perception.options import BevClass, CvtOptions

CHANNELS: dict[BevClass, int] = {"vehicle": 2, "road": 1}
"""Of the answer for each class: a vehicle's are occupancy and how near its centre is."""


@runtime_checkable
class Backbone(Protocol):
    """What gives maps of features of pictures; a module of torch.

    Attributes:
        channels: Of each map, in the order in which the street from above looks at them.
    """

    channels: tuple[int, ...]

    def __call__(self, pictures: Tensor, /) -> list[Tensor]:
        """Maps of features (n, channels, h, w) of pictures (n, 3, h, w), normalised as for ImageNet."""
        ...


@dataclass(frozen=True)
class BevPrediction:
    """Logits of each cell; None for what the network does not segment.

    Attributes:
        vehicle: That a vehicle covers it.
        centre: How near the centre of a vehicle is.
        road: That it is road: a lane or a road segment.
    """

    vehicle: Float[Tensor, "b rows columns"] | None = None
    centre: Float[Tensor, "b rows columns"] | None = None
    road: Float[Tensor, "b rows columns"] | None = None


class _Encoder(nn.Module):
    """From pictures to the coarse street from above."""

    mean: Tensor
    spread: Tensor

    def __init__(self, options: CvtOptions, backbone: nn.Module, channels: Iterable[int]) -> None:
        super().__init__()
        image = options.image.height_px, options.image.width_px
        sizes = image, options.dim, options.heads, options.head_dim
        self.backbone = backbone
        self.cross_views = nn.ModuleList(CrossView(each, *sizes) for each in channels)
        self.bev_embedding = BevEmbedding(options.dim, options.embedding, options.grid)
        self.layers = nn.ModuleList(
            nn.Sequential(*(Bottleneck(options.dim) for _ in range(count))) for count in options.bottlenecks
        )
        for name, values in (("mean", MEAN), ("spread", SPREAD)):
            self.register_buffer(name, torch.tensor(values)[:, None, None], persistent=False)

    def features(self, pictures: Float[Tensor, "b n 3 h w"]) -> list[Float[Tensor, "b n _ _ _"]]:
        """Maps of features of pictures in [0, 1]."""
        return [each.unflatten(0, pictures.shape[:2]) for each in self.backbone(self.normalised(pictures))]

    def normalised(self, pictures: Float[Tensor, "b n 3 h w"]) -> Float[Tensor, "bn 3 h w"]:
        """Pictures in [0, 1] as a backbone takes them, those of all samples in a row."""
        return (pictures.flatten(0, 1) - self.mean) / self.spread

    def forward(
        self,
        features: list[Float[Tensor, "b n _ _ _"]],
        camera_from_pixel: Float[Tensor, "b n 3 3"],
        ego_from_camera: Float[Tensor, "b n 4 4"],
    ) -> Float[Tensor, "b dim rows columns"]:
        """See ``CrossViewTransformer.answer``."""
        b = len(camera_from_pixel)
        x = self.bev_embedding.learned_features.expand(b, -1, -1, -1)
        for look, layer, seen in zip(self.cross_views, self.layers, features, strict=True):
            x = layer(look(x, self.bev_embedding.grid, seen, camera_from_pixel, ego_from_camera))
        return x


class CrossViewTransformer(nn.Module):
    """The whole network; 1.08 million parameters for one class of the published sizes.

    Args:
        options: Sizes.
        backbone: What gives features; the trunk of the options where none is given.
    """

    def __init__(self, options: CvtOptions | None = None, backbone: nn.Module | None = None) -> None:
        super().__init__()
        self.options = options = options or CvtOptions()
        trunk = _trunk(options) if backbone is None else backbone
        channels = trunk.channels if isinstance(trunk, Backbone) else ()
        if len(channels) != len(options.bottlenecks):
            raise ValueError(
                f"a backbone with {len(channels)} maps of features; expected {len(options.bottlenecks)}, one "
                "for each entry of bottlenecks, and their channels in its attribute channels"
            )
        self.encoder = _Encoder(options, trunk, channels)
        self.decoder = BevDecoder(options.dim, options.decoder)
        self.to_logits = nn.Sequential(
            nn.Conv2d(options.decoder[-1], options.head, 3, padding=1, bias=False),
            nn.BatchNorm2d(options.head),
            nn.ReLU(),
            nn.Conv2d(options.head, sum(CHANNELS[each] for each in options.classes), 1),
        )

    def forward(
        self,
        pictures: Float[Tensor, "b n 3 h w"] | UInt8[Tensor, "b n 3 h w"],
        pixel_from_camera: Float[Tensor, "b n 3 3"],
        camera_from_ego: Float[Tensor, "b n 4 4"],
    ) -> BevPrediction:
        """Segment the street.

        Args:
            pictures: RGB of n cameras, as bytes or in [0, 1], of the size in the options.
            pixel_from_camera: Intrinsics in pixels of these pictures.
            camera_from_ego: Extrinsics. The camera is x right, y down, z ahead; the ego frame x ahead,
                y left, z up, and level.

        Returns:
            Logits in float32.
        """
        image = self.options.image
        if pictures.shape[-2:] != (image.height_px, image.width_px):
            raise ValueError(
                f"pictures of {tuple(pictures.shape[-2:])}, expected {(image.height_px, image.width_px)}"
            )
        if not pictures.is_floating_point():
            pictures = pictures.float() / 255
        features = self.encoder.features(pictures)
        return self.answer(features, torch.linalg.inv(pixel_from_camera), torch.linalg.inv(camera_from_ego))

    def answer(
        self,
        features: list[Float[Tensor, "b n _ _ _"]],
        camera_from_pixel: Float[Tensor, "b n 3 3"],
        ego_from_camera: Float[Tensor, "b n 4 4"],
    ) -> BevPrediction:
        """Segment the street out of features of the encoder, with matrices that are inverted already.

        Nothing here waits for a device.
        """
        decoded = self.decoder(self.encoder(features, camera_from_pixel, ego_from_camera))
        said = self.to_logits(decoded).float()
        parts = iter(said.unbind(dim=1))
        found: dict[str, Tensor] = {}
        for each in self.options.classes:
            found[each] = next(parts)
            if each == "vehicle":
                found["centre"] = next(parts)
        return BevPrediction(**found)


def _trunk(options: CvtOptions) -> nn.Module:
    return EfficientNetFront(options.trunk_width) if options.trunk == "b4" else StreetTrunk()
