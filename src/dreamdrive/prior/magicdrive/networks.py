"""MagicDrive's two networks (Gao et al., ICLR 2024) on diffusers; keys are those of the published folders."""

import inspect
from typing import Any, cast

import torch
from diffusers.models.attention import BasicTransformerBlock
from diffusers.models.controlnets.controlnet import ControlNetModel
from diffusers.models.transformers.transformer_2d import Transformer2DModel
from diffusers.models.unets.unet_2d_condition import UNet2DConditionModel
from jaxtyping import Bool, Float, Int
from torch import Tensor, nn

from dreamdrive.prior.magicdrive.blocks import CrossViewBlock, TemporalBlock
from dreamdrive.prior.magicdrive.config import Settings
from dreamdrive.prior.magicdrive.embed import FEATURES, BoxEmbedder, MapEncoder, fourier

COLUMNS = 7
"""Of a camera's matrix: three of the intrinsics, four of camera to LiDAR."""


def plain_settings(model: type, config: dict[str, Any]) -> dict[str, Any]:
    """Those entries of a ``config.json`` that diffusers' class takes; it warns about all others."""
    known = set(inspect.signature(model.__init__).parameters) - {"self"}
    return {key: value for key, value in config.items() if key in known}


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

    def tokens(
        self,
        text: Float[Tensor, "b l c"],
        cameras: Float[Tensor, "b n 3 7"],
        corners_m: Float[Tensor, "b n k 8 3"],
        classes: Int[Tensor, "b n k"],
        present: Bool[Tensor, "b n k"],
    ) -> Float[Tensor, "bn t c"]:
        """The sequence of each picture, for both networks: its camera, the words, its boxes.

        Units are those of ``Conditions``; k is 0 where no camera has any box.
        """
        camera = self.camera_tokens(cameras)[:, :, None]
        words = text[:, None].expand(-1, self.views, -1, -1)
        parts = [camera, words]
        if present.shape[2]:
            parts.append(self.bbox_embedder(corners_m, classes, present))
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
    """The UNet of Stable Diffusion whose transformer blocks look at neighbouring cameras."""
    unet = UNet2DConditionModel(**plain_settings(UNet2DConditionModel, config))
    for layer in unet.modules():
        if isinstance(layer, Transformer2DModel):
            layer.transformer_blocks = nn.ModuleList(
                _looking_beside(cast(BasicTransformerBlock, block), settings)
                for block in layer.transformer_blocks
            )
    return unet


def _looking_beside(block: BasicTransformerBlock, settings: Settings) -> CrossViewBlock:
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
