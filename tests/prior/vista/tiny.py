"""The smallest model of each kind, with random weights, in diffusers' layout or as an official file."""

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import torch
from safetensors.torch import save_file
from torch import Tensor

from dreamdrive.prior.vista.keys import UNET, Part
from dreamdrive.prior.vista.kinds import ACTION_COLUMNS, VISTA, ModelKind
from dreamdrive.prior.vista.networks import make_empty
from dreamdrive.prior.vista.stored import FILES

FRAMES = 6
"""Frames that the UNet sees at once; an official single file does not tell, and counts as 25."""
IMAGE = 16
"""Columns of the context that describe the first frame."""
_DECODER, _CONDITION = "first_stage_model.decoder.", "conditioner.embedders.3.encoder."
_VISUAL = "conditioner.embedders.0.open_clip.model.visual."
_BLOCKS = ("{}BlockSpatioTemporal", "CrossAttn{}BlockSpatioTemporal", "{}BlockSpatioTemporal")


OFFICIAL: dict[Part, dict[str, Any]] = {
    "unet": {
        "in_channels": 8,
        "block_out_channels": [320, 640, 1280, 1280],
        "down_block_types": [*["CrossAttnDownBlockSpatioTemporal"] * 3, "DownBlockSpatioTemporal"],
        "up_block_types": ["UpBlockSpatioTemporal", *["CrossAttnUpBlockSpatioTemporal"] * 3],
        "layers_per_block": 2,
        "cross_attention_dim": 1024 + ACTION_COLUMNS,
        "num_attention_heads": [5, 10, 20, 20],
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
        "projection_dim": 1024,
        "patch_size": 14,
        "image_size": 224,
    },
}
"""Sizes of the published Vista."""


def configs(kind: ModelKind) -> dict[Part, dict[str, Any]]:
    """Of each part: one width, as few layers as there can be with the block that the features come from."""
    return {
        "unet": {
            "block_out_channels": [64, 64, 64],
            "down_block_types": [name.format("Down") for name in _BLOCKS],
            "up_block_types": [name.format("Up") for name in reversed(_BLOCKS)],
            "layers_per_block": 2,
            "cross_attention_dim": IMAGE + (ACTION_COLUMNS if kind is VISTA else 0),
            "num_attention_heads": [1, 1, 1],
            "addition_time_embed_dim": 32,
            "projection_class_embeddings_input_dim": 96,
            "num_frames": FRAMES,
        },
        "vae": {
            "block_out_channels": [32, 32, 32, 32],
            "down_block_types": ["DownEncoderBlock2D"] * 4,
            "layers_per_block": 1,
            "scaling_factor": 0.18215,
        },
        "image_encoder": {
            "hidden_size": 80,
            "intermediate_size": 32,
            "num_hidden_layers": 2,
            "num_attention_heads": 1,
            "projection_dim": IMAGE,
            "patch_size": 56,
            "image_size": 224,
            "hidden_act": "gelu",
        },
    }


@cache
def states(kind: ModelKind, seed: int = 0) -> dict[Part, dict[str, Tensor]]:
    """Random weights of each part: matrices keep the size of what goes through them."""
    draw = torch.Generator().manual_seed(seed)

    def one(name: str, shape: torch.Size) -> Tensor:
        value = torch.randn(shape, generator=draw)
        if len(shape) < 2:
            return 0.1 * value + (1.0 if "norm" in name and name.endswith("weight") else 0.0)
        return value / max(shape[1:].numel(), 1) ** 0.5

    return {
        part: {name: one(name, v.shape) for name, v in make_empty(part, config, kind).state_dict().items()}
        for part, config in configs(kind).items()
    }


def save_folder(folder: Path, kind: ModelKind, seed: int = 0) -> Path:
    """The model in diffusers' layout."""
    for part, state in states(kind, seed).items():
        (folder / part).mkdir(parents=True)
        (folder / part / "config.json").write_text(json.dumps(configs(kind)[part]))
        save_file(state, folder / part / FILES[part][0])
    return folder


def official(kind: ModelKind, seed: int = 0) -> dict[str, Tensor]:
    """The model by the keys of its official file."""
    all_states = states(kind, seed)
    found: dict[str, Tensor] = {}
    for name, value in all_states["unet"].items():
        key = UNET + _unet_key(name)
        if kind is VISTA and re.search(r"attn2\.to_[kv]\.weight", name):
            which = name[-8]
            adapter = key.replace(f"to_{which}.weight", f"{which}_adapter_action_control.weight")
            found[adapter] = value[:, IMAGE:].clone()
            value = value[:, :IMAGE].clone()
        found[key] = value
    for name, value in all_states["vae"].items():
        found[_vae_key(name)] = value[..., None, None] if re.search(r"to_.*weight", name) else value
    found |= _visual_state(all_states["image_encoder"])
    found["conditioner.embedders.0.open_clip.model.logit_scale"] = torch.zeros(())
    return found | _second_encoder(found)


def _second_encoder(found: dict[str, Tensor]) -> dict[str, Tensor]:
    """The encoder without a convolution of its own behind it, which gives what the other one does."""
    first = f"{_CONDITION}encoder."
    second = {key.removeprefix(first): value for key, value in found.items() if key.startswith(first)}
    quant = found[f"{_CONDITION}quant_conv.weight"][..., 0, 0]
    second["conv_out.weight"] = torch.einsum("oc,cikl->oikl", quant, second["conv_out.weight"])
    second["conv_out.bias"] = quant @ second["conv_out.bias"] + found[f"{_CONDITION}quant_conv.bias"]
    return {f"first_stage_model.encoder.{name}": value.clone() for name, value in second.items()}


def save_official(path: Path, kind: ModelKind, seed: int = 0) -> Path:
    """The model as an official file."""
    save_file({key: value.contiguous() for key, value in official(kind, seed).items()}, path)
    return path


_INNER = {
    "norm1": "in_layers.0",
    "conv1": "in_layers.2",
    "time_emb_proj": "emb_layers.1",
    "norm2": "out_layers.0",
    "conv2": "out_layers.3",
    "conv_shortcut": "skip_connection",
}
_STEMS = {
    "time_embedding.linear_1": "time_embed.0",
    "time_embedding.linear_2": "time_embed.2",
    "cond_time_embedding.linear_1": "cond_time_stack_embed.0",
    "cond_time_embedding.linear_2": "cond_time_stack_embed.2",
    "add_embedding.linear_1": "label_emb.0.0",
    "add_embedding.linear_2": "label_emb.0.2",
    "conv_in": "input_blocks.0.0",
    "conv_norm_out": "out.0",
    "conv_out": "out.2",
}


def _unet_key(name: str) -> str:
    stem, _, kind = name.rpartition(".")
    if stem in _STEMS:
        return f"{_STEMS[stem]}.{kind}"
    side, rest = name.split(".", 1)
    if side == "mid_block":
        what, index, rest = rest.split(".", 2)
        place = "middle_block." + ("1" if what == "attentions" else str(2 * int(index)))
    else:
        level, what, index, rest = rest.split(".", 3)
        down = side == "down_blocks"
        if "samplers" in what:
            spot = 3 * int(level) + (3 if down else 2)
            attends = not down and int(level) == 1
            inner = rest.replace("conv.", "op.") if down else rest
            return f"{'input' if down else 'output'}_blocks.{spot}.{0 if down else 1 + attends}.{inner}"
        spot = 3 * int(level) + int(index) + down
        place = f"{'input' if down else 'output'}_blocks.{spot}.{1 if what == 'attentions' else 0}"
    if what == "attentions":
        rest = rest.replace("temporal_transformer_blocks.", "time_stack.")
        rest = re.sub(r"time_pos_embed\.linear_(\d)", lambda m: f"time_pos_embed.{2 * int(m[1]) - 2}", rest)
        return f"{place}.{rest}"
    return f"{place}.{_residual_key(rest, '')}"


def _residual_key(rest: str, mixer: str) -> str:
    if rest.startswith("time_mixer"):
        return rest if not mixer else "mix_factor"
    half, stem, kind = rest.rsplit(".", 2)
    if half == "temporal_res_block":
        return f"time_stack.{_INNER[stem]}.{kind}"
    return f"{stem if mixer else _INNER[stem]}.{kind}".replace("conv_shortcut", "nin_shortcut")


def _vae_key(name: str) -> str:
    half, rest = name.split(".", 1)
    if half == "quant_conv":
        return f"{_CONDITION}{name}"
    prefix = _DECODER if half == "decoder" else f"{_CONDITION}encoder."
    if match := re.match(r"mid_block\.attentions\.0\.(.*)\.(weight|bias)", rest):
        names = {"group_norm": "norm", "to_q": "q", "to_k": "k", "to_v": "v", "to_out.0": "proj_out"}
        return f"{prefix}mid.attn_1.{names[match[1]]}.{match[2]}"
    if match := re.match(r"(mid_block|(down|up)_blocks\.(\d))\.resnets\.(\d)\.(.*)", rest):
        side, level, index, inner = match[2], match[3], match[4], match[5]
        place = f"mid.block_{int(index) + 1}"
        if side:
            place = f"{side}.{int(level) if side == 'down' else 3 - int(level)}.block.{index}"
        inner = _residual_key(inner, "mix") if half == "decoder" else inner.replace("conv_sh", "nin_sh")
        return f"{prefix}{place}.{inner}"
    if match := re.match(r"(down|up)_blocks\.(\d)\.\w+samplers\.0\.(.*)", rest):
        level = int(match[2]) if match[1] == "down" else 3 - int(match[2])
        return f"{prefix}{match[1]}.{level}.{match[1]}sample.{match[3]}"
    return prefix + rest.replace("conv_norm_out", "norm_out").replace(
        "time_conv_out", "conv_out.time_mix_conv"
    )


def _visual_state(state: dict[str, Tensor]) -> dict[str, Tensor]:
    names = {
        "vision_model.embeddings.class_embedding": "class_embedding",
        "vision_model.embeddings.patch_embedding.weight": "conv1.weight",
        "vision_model.embeddings.position_embedding.weight": "positional_embedding",
    }
    inner = {"layer_norm1": "ln_1", "layer_norm2": "ln_2", "mlp.fc1": "mlp.c_fc", "mlp.fc2": "mlp.c_proj"}
    found: dict[str, Tensor] = {}
    for name, value in state.items():
        key = names.get(name, name)
        if name == "visual_projection.weight":
            key, value = "proj", value.T
        elif match := re.match(r"vision_model\.encoder\.layers\.(\d+)\.(.*)\.(weight|bias)", name):
            place, kind = f"transformer.resblocks.{match[1]}", match[3]
            if qkv := re.match(r"self_attn\.([qkv])_proj", match[2]):
                if qkv[1] != "q":
                    continue
                own = [state[name.replace("q_proj", f"{which}_proj")] for which in "qkv"]
                key, value = f"{place}.attn.in_proj_{kind}", torch.cat(own)
            else:
                stem = inner.get(match[2], match[2].replace("self_attn", "attn"))
                key = f"{place}.{stem}.{kind}"
        key = re.sub(r"^vision_model\.(pre|post)_laye?rnorm", r"ln_\1", key)
        found[_VISUAL + key] = value
    return found
