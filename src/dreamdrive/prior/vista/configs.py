"""The networks' configurations from the shapes of their weights, for files that state none."""

from collections.abc import Mapping
from typing import Any

from dreamdrive.prior.vista.keys import Part

Shapes = Mapping[str, tuple[int, ...]]
"""Shapes of a part's tensors by name."""
_HEAD, _CLIP_HEAD = 64, 80
"""Widths of an attention head in the UNet and in the image encoder, which no weight tells."""


def config_of(part: Part, shapes: Shapes, head: int = _HEAD) -> dict[str, Any]:
    """The configuration of a part from its tensors by the names of diffusers and transformers.

    ``head`` is the width of an attention head in the UNet.
    """
    if part == "unet":
        return _unet(shapes, head)
    return _autoencoder(shapes) if part == "vae" else _image_encoder(shapes)


def _levels(shapes: Shapes, prefix: str) -> int:
    return 1 + max(
        (int(key.split(".")[prefix.count(".")]) for key in shapes if key.startswith(prefix)), default=0
    )


def _unet(shapes: Shapes, head: int) -> dict[str, Any]:
    levels = _levels(shapes, "down_blocks.")
    widths = [shapes[f"down_blocks.{i}.resnets.0.spatial_res_block.conv1.weight"][0] for i in range(levels)]
    attends = [any(key.startswith(f"down_blocks.{i}.attentions.") for key in shapes) for i in range(levels)]
    context = shapes["mid_block.attentions.0.transformer_blocks.0.attn2.to_k.weight"][1]
    names = {True: "CrossAttn{}BlockSpatioTemporal", False: "{}BlockSpatioTemporal"}
    ids = shapes["add_embedding.linear_1.weight"][1]
    return {
        "in_channels": shapes["conv_in.weight"][1],
        "out_channels": shapes["conv_out.weight"][0],
        "block_out_channels": widths,
        "down_block_types": [names[a].format("Down") for a in attends],
        "up_block_types": [names[a].format("Up") for a in reversed(attends)],
        "layers_per_block": _levels(shapes, "down_blocks.0.resnets."),
        "transformer_layers_per_block": _levels(shapes, "mid_block.attentions.0.transformer_blocks."),
        "cross_attention_dim": context,
        "num_attention_heads": [width // head for width in widths],
        "addition_time_embed_dim": ids // 3,
        "projection_class_embeddings_input_dim": ids,
        "num_frames": 25,
    }


def _autoencoder(shapes: Shapes) -> dict[str, Any]:
    levels = _levels(shapes, "encoder.down_blocks.")
    return {
        "block_out_channels": [
            shapes[f"encoder.down_blocks.{i}.resnets.0.conv1.weight"][0] for i in range(levels)
        ],
        "down_block_types": ["DownEncoderBlock2D"] * levels,
        "layers_per_block": _levels(shapes, "encoder.down_blocks.0.resnets."),
        "latent_channels": shapes["quant_conv.weight"][0] // 2,
        "scaling_factor": 0.18215,
        "force_upcast": True,
    }


def _image_encoder(shapes: Shapes) -> dict[str, Any]:
    width, _, patch, _ = shapes["vision_model.embeddings.patch_embedding.weight"]
    places = shapes["vision_model.embeddings.position_embedding.weight"][0] - 1
    return {
        "hidden_size": width,
        "intermediate_size": shapes["vision_model.encoder.layers.0.mlp.fc1.weight"][0],
        "num_hidden_layers": _levels(shapes, "vision_model.encoder.layers."),
        "num_attention_heads": max(width // _CLIP_HEAD, 1),
        "projection_dim": shapes["visual_projection.weight"][0],
        "patch_size": patch,
        "image_size": patch * round(places**0.5),
        "hidden_act": "gelu",  # OpenCLIP's, not the approximation that OpenAI's CLIP has
        "layer_norm_eps": 1e-5,
    }
