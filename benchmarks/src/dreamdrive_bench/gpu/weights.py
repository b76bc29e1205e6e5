"""Networks of published sizes with random weights, made where they run, and tiny ones to try the code."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import torch
from torch import Tensor, nn

from dreamdrive.prior.vista.keys import Part
from dreamdrive.prior.vista.kinds import ACTION_COLUMNS, VISTA, ModelKind
from dreamdrive.prior.vista.networks import make_empty
from dreamdrive.prior.vista.stored import StoredModel, StoredPart

Network = TypeVar("Network", bound=nn.Module)
Configs = dict[Part, dict[str, Any]]


def video_model_configs(kind: ModelKind, *, tiny: bool) -> Configs:
    """Configurations of SVD's or Vista's networks."""
    image = 16 if tiny else 1024
    context = image + (ACTION_COLUMNS if kind is VISTA else 0)
    return _tiny(context, image) if tiny else _published(context, image)


def _published(context: int, image: int) -> Configs:
    return {
        "unet": {
            "in_channels": 8,
            "block_out_channels": [320, 640, 1280, 1280],
            "down_block_types": [*["CrossAttnDownBlockSpatioTemporal"] * 3, "DownBlockSpatioTemporal"],
            "up_block_types": ["UpBlockSpatioTemporal", *["CrossAttnUpBlockSpatioTemporal"] * 3],
            "layers_per_block": 2,
            "cross_attention_dim": context,
            "num_attention_heads": [5, 10, 20, 20],
            "num_frames": 25,
        },
        "vae": {
            "block_out_channels": [128, 256, 512, 512],
            "down_block_types": ["DownEncoderBlock2D"] * 4,
            "layers_per_block": 2,
        },
        "image_encoder": {
            "hidden_size": 1280,
            "intermediate_size": 5120,
            "num_hidden_layers": 32,
            "num_attention_heads": 16,
            "projection_dim": image,
            "patch_size": 14,
            "image_size": 224,
            "hidden_act": "gelu",
        },
    }


def _tiny(context: int, image: int) -> Configs:
    blocks = ("{}BlockSpatioTemporal", "CrossAttn{}BlockSpatioTemporal", "{}BlockSpatioTemporal")
    return {
        "unet": {
            "block_out_channels": [64, 64, 64],
            "down_block_types": [name.format("Down") for name in blocks],
            "up_block_types": [name.format("Up") for name in reversed(blocks)],
            "layers_per_block": 2,
            "cross_attention_dim": context,
            "num_attention_heads": [1, 1, 1],
            "addition_time_embed_dim": 32,
            "projection_class_embeddings_input_dim": 96,
            "num_frames": 6,
        },
        "vae": {
            "block_out_channels": [32] * 4,
            "down_block_types": ["DownEncoderBlock2D"] * 4,
            "layers_per_block": 1,
        },
        "image_encoder": {
            "hidden_size": 80,
            "intermediate_size": 32,
            "num_hidden_layers": 2,
            "num_attention_heads": 1,
            "projection_dim": image,
            "patch_size": 56,
            "image_size": 224,
            "hidden_act": "gelu",
        },
    }


def video_model(kind: ModelKind, device: torch.device, *, tiny: bool) -> StoredModel:
    """The model as if it lay on disk; a tensor is made on the device when it is read."""
    configs = video_model_configs(kind, tiny=tiny)
    parts = {part: _stored(part, config, kind, device) for part, config in configs.items()}
    return StoredModel(Path("random weights"), kind, parts)


def _stored(part: Part, config: dict[str, Any], kind: ModelKind, device: torch.device) -> StoredPart:
    empty = make_empty(part, config, kind)
    shapes = {name: tuple(value.shape) for name, value in empty.state_dict().items()}
    defaults = dict(empty.config) if part != "image_encoder" else {}
    return StoredPart(defaults | config, shapes, lambda name: random_value(name, shapes[name], device))


def random_value(name: str, shape: tuple[int, ...], device: torch.device) -> Tensor:
    """Random weights that keep the size of what goes through them; norms change nothing."""
    if len(shape) < 2:
        return torch.full(shape, 1.0 if "norm" in name and name.endswith("weight") else 0.0, device=device)
    return torch.randn(shape, device=device) / torch.Size(shape[1:]).numel() ** 0.5


def filled(make: Callable[[], Network], device: torch.device, dtype: torch.dtype = torch.float32) -> Network:
    """A network with random weights, made without weights on the CPU."""
    from accelerate import init_empty_weights

    with init_empty_weights():
        network = make()
    values: Mapping[str, Tensor] = network.state_dict()
    random = {
        name: random_value(name, tuple(value.shape), device).to(dtype if value.is_floating_point() else None)
        for name, value in values.items()
        if value.is_floating_point()
    }
    network.load_state_dict(random, strict=False, assign=True)
    return nn.Module.to(network, device, dtype).eval().requires_grad_(False)
