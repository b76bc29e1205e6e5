"""MagicDrive's two networks (Gao et al., ICLR 2024) on diffusers; keys are those of the published folders."""

import inspect
from itertools import pairwise
from typing import Any, cast

import torch
from diffusers.models.attention import BasicTransformerBlock
from diffusers.models.controlnets.controlnet import ControlNetModel
from diffusers.models.transformers.transformer_2d import Transformer2DModel
from diffusers.models.unets.unet_2d_condition import UNet2DConditionModel
from jaxtyping import Bool, Float, Int
from torch import Tensor, nn
from torch.nn import functional

from dreamdrive.prior.magicdrive.blocks import CrossViewBlock, TemporalBlock
from dreamdrive.prior.magicdrive.condition import Conditions
from dreamdrive.prior.magicdrive.config import Settings

FREQUENCIES = 4
"""Octaves of the Fourier features, from 1."""
FEATURES = 3 * (1 + 2 * FREQUENCIES)
"""Fourier features of a point."""
CORNERS = 8
COLUMNS = 7
"""Of a camera's matrix: three of the intrinsics, four of camera to LiDAR."""


def plain_settings(model: type, config: dict[str, Any]) -> dict[str, Any]:
    """Those entries of a ``config.json`` that diffusers' class takes; it warns about all others."""
    known = set(inspect.signature(model.__init__).parameters) - {"self"}
    return {key: value for key, value in config.items() if key in known}


def fourier(points: Float[Tensor, "*b 3"]) -> Float[Tensor, "*b 27"]:
    """Points and the sines and cosines of 1, 2, 4 and 8 times them: v, sin v, cos v, sin 2v, cos 2v, ..."""
    waves = [wave(points * 2**octave) for octave in range(FREQUENCIES) for wave in (torch.sin, torch.cos)]
    return torch.cat([points, *waves], dim=-1)


class BoxEmbedder(nn.Module):
    """One token a box, from its corners and its class (MagicDrive's ``ContinuousBBoxWithTextEmbedding``).

    A class's token is a text encoder's output for its name; the last of the widths is that of a box's token.
    """

    def __init__(self, classes: int, class_width: int, widths: tuple[int, int, int, int]) -> None:
        super().__init__()
        first, second, third, last = widths
        self.bbox_proj = nn.Linear(CORNERS * FEATURES, first)
        self.second_linear = nn.Sequential(
            nn.Linear(first + class_width, second),
            nn.SiLU(),
            nn.Linear(second, third),
            nn.SiLU(),
            nn.Linear(third, last),
        )
        self.register_buffer("_class_tokens", torch.zeros(classes, class_width))
        self.null_class_feature = nn.Parameter(torch.zeros(class_width))
        self.null_pos_feature = nn.Parameter(torch.zeros(CORNERS * FEATURES))

    def forward(
        self,
        corners_m: Float[Tensor, "*b 8 3"],
        classes: Int[Tensor, "*b"],
        present: Bool[Tensor, "*b"],
    ) -> Float[Tensor, "*b c"]:
        """Tokens of boxes; those that are not present get the token of no box, which attention sees as well.

        Corners are in the LiDAR frame, in float32 whatever the network's type is.
        """
        there = present[..., None]
        features = fourier(corners_m.float()).flatten(-2).to(self.null_pos_feature.dtype)
        place = torch.where(there, features, self.null_pos_feature)
        tokens = self.get_buffer("_class_tokens")[classes.clamp(min=0)]
        kind = torch.where(there, tokens, self.null_class_feature)
        place = functional.silu(self.bbox_proj(place))
        return self.second_linear(torch.cat([place, kind], dim=-1))


class MapEncoder(nn.Module):
    """From the raster of the map to the first feature map of the ControlNet, through four levels.

    Of MagicDrive's 272x736 model, the result is averaged to the height and width ``pooled``; the others get
    28x50 from 200x200 cells and 53x100 from 400x400 by their paddings.
    """

    def __init__(
        self, channels: int, widths: tuple[int, ...], out: int, pooled: tuple[int, int] | None = None
    ) -> None:
        super().__init__()
        high = 1 if pooled else 2  # the padding across rows that brings 200 cells to 28
        strides: list[int | tuple[int, int]] = [1 if pooled else 2, *[2] * (len(widths) - 3), (2, 1)]
        self.conv_in = nn.Conv2d(channels, widths[0], 3, padding=1)
        blocks: list[nn.Module] = []
        for level, (narrow, wide) in enumerate(pairwise(widths)):
            last = level == len(strides) - 1
            blocks.append(nn.Conv2d(narrow, narrow, 3, padding=(high if last else 1, 1)))
            blocks.append(nn.Conv2d(narrow, wide, 3, strides[level], padding=(high, 1)))
        if pooled:
            blocks.append(nn.AdaptiveAvgPool2d(pooled))
        self.blocks = nn.ModuleList(blocks)
        self.conv_out = nn.Conv2d(widths[-1], out, 3, padding=1)

    def forward(self, raster: Float[Tensor, "b k x y"]) -> Float[Tensor, "b c h w"]:
        """The feature map; a SiLU follows every layer but the last, the average as well."""
        features = functional.silu(self.conv_in(raster))
        for block in self.blocks:
            features = functional.silu(block(features))
        return self.conv_out(features)


class BevControlNet(ControlNetModel):
    """The plain ControlNet with the map in place of a picture, and tokens of cameras and boxes."""

    def __init__(self, config: dict[str, Any], settings: Settings) -> None:
        super().__init__(**plain_settings(ControlNetModel, config))
        width = int(config["cross_attention_dim"])
        first = int(config["block_out_channels"][0])
        self.views = settings.views
        self.controlnet_cond_embedding = MapEncoder(
            settings.map_shape[0], settings.map_widths, first, settings.map_pooled
        )
        self.cam2token = nn.Linear(COLUMNS * FEATURES, width)
        self.uncond_cam = nn.Embedding(1, 3 * COLUMNS)
        self.bbox_embedder = BoxEmbedder(settings.box_classes, settings.box_class_width, settings.box_widths)

    @property
    def null_camera(self) -> Float[Tensor, "3 7"]:
        """What stands for no camera in the unconditional branch."""
        return self.uncond_cam.weight.reshape(3, COLUMNS)

    def camera_tokens(self, cameras: Float[Tensor, "b n 3 7"]) -> Float[Tensor, "b n c"]:
        """A token a camera: Fourier features of the columns, one after the other, from float32."""
        features = fourier(cameras.float().transpose(-1, -2)).flatten(-2)
        return self.cam2token(features.to(self.cam2token.weight.dtype))

    def tokens(self, seen: Conditions) -> Float[Tensor, "bn t c"]:
        """The sequence of each picture, for both networks: its camera, the words, and boxes, if any."""
        camera = self.camera_tokens(seen.cameras)[:, :, None]
        words = seen.text.to(camera.dtype)[:, None].expand(-1, self.views, -1, -1)
        parts = [camera, words]
        if seen.present.shape[2]:
            parts.append(self.bbox_embedder(seen.corners_m, seen.classes, seen.present))
        return torch.cat(parts, dim=2).flatten(0, 1)

    def residuals(
        self,
        latents: Float[Tensor, "bn c h w"],
        time: Tensor,
        tokens: Float[Tensor, "bn t e"],
        raster: Float[Tensor, "b k x y"],
    ) -> tuple[list[Tensor], Tensor]:
        """What is added to the skip connections of the UNet, and to its middle."""
        down, middle = self.forward(
            latents,
            time,
            encoder_hidden_states=tokens,
            controlnet_cond=raster.repeat_interleave(self.views, dim=0),
            return_dict=False,
        )
        return cast(list[Tensor], down), cast(Tensor, middle)


def multiview_unet(config: dict[str, Any], settings: Settings) -> UNet2DConditionModel:
    """The UNet of Stable Diffusion whose transformer blocks attend to neighbouring cameras."""
    unet = UNet2DConditionModel(**plain_settings(UNet2DConditionModel, config))
    for layer in unet.modules():
        if isinstance(layer, Transformer2DModel):
            layer.transformer_blocks = nn.ModuleList(
                _with_attention_beside(cast(BasicTransformerBlock, block), settings)
                for block in layer.transformer_blocks
            )
    return unet


def _with_attention_beside(block: BasicTransformerBlock, settings: Settings) -> CrossViewBlock:
    if settings.temporal is None:
        return CrossViewBlock(block, settings.views)
    return TemporalBlock(block, settings.views, settings.temporal)


def denoised(
    unet: UNet2DConditionModel,
    latents: Float[Tensor, "bn c h w"],
    time: Tensor,
    tokens: Float[Tensor, "bn t e"],
    residuals: tuple[list[Tensor], Tensor] | None,
) -> Float[Tensor, "bn c h w"]:
    """The noise that the UNet sees in the latents."""
    down, middle = residuals if residuals is not None else (None, None)
    return unet(
        latents,
        time,
        encoder_hidden_states=tokens,
        down_block_additional_residuals=down,
        mid_block_additional_residual=middle,
        return_dict=False,
    )[0]
