"""MagicDrive's folders with tiny random networks, and what is in the official ones."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from diffusers.models.autoencoders.autoencoder_kl import AutoencoderKL
from safetensors.torch import load_file, save_file
from torch import Tensor
from transformers import CLIPTextConfig, CLIPTextModel

from dreamdrive.prior.magicdrive.config import read_settings
from dreamdrive.prior.magicdrive.networks import BevControlNet, multiview_unet

SIZE = (44, 24)
WIDTH, WORDS = 48, 77
SD15 = {
    "block_out_channels": [320, 640, 1280, 1280],
    "cross_attention_dim": 768,
    "attention_head_dim": 8,
    "down_block_types": [*["CrossAttnDownBlock2D"] * 3, "DownBlock2D"],
    "in_channels": 4,
    "layers_per_block": 2,
    "norm_num_groups": 32,
}
RING = {str(i): [(i - 1) % 6, (i + 1) % 6] for i in range(6)}
NEW = {
    "_class_name": "UNet2DConditionModelMultiview",
    "neighboring_view_pair": RING,
    "neighboring_attn_type": "add",
    "zero_module_type": "zero_linear",
    "crossview_attn_type": "basic",
    "trainable_state": "only_new",
}
TEMPORAL = {
    "temp_attn_type": "_s_ff_t_last",
    "zero_module_type2": "none",
    "temp_pos_emb": "learnable",
    "video_length": 16,
}
CAMERA = {"input_dims": 3, "num_freqs": 4, "include_input": True, "log_sampling": True}


def official_configs(temporal: bool = False) -> tuple[dict[str, Any], dict[str, Any]]:
    """Tables of ``unet/`` and ``controlnet/`` at 224x400."""
    unet = SD15 | NEW | {"img_size": [224, 400]}
    unet |= {"up_block_types": ["UpBlock2D", *["CrossAttnUpBlock2D"] * 3]} | (TEMPORAL if temporal else {})
    return unet, SD15 | _control(768, 512, [16, 32, 96, 256], [8, 200, 200])


def _control(width: int, hidden: int, map_widths: list[int], map_size: list[int]) -> dict[str, Any]:
    boxes = {"n_classes": 10, "class_token_dim": width, "embedder_num_freq": 4, "mode": "all-xyz"}
    boxes |= {"proj_dims": [width, hidden, hidden, width], "minmax_normalize": False}
    return {
        "_class_name": "BEVControlNetModel",
        "map_embedder_cls": None,
        "map_embedder_param": None,
        "map_size": map_size,
        "conditioning_embedding_out_channels": map_widths,
        "use_uncond_map": None,
        "cam_embedder_param": CAMERA,
        "bbox_embedder_param": boxes,
    }


def tiny_configs(temporal: bool = False) -> tuple[dict[str, Any], dict[str, Any]]:
    """Tables of tiny networks for pictures of 44x24, whose map encoder averages as that of 272x736 does.

    They have no more layers than the block needs that the features come from.
    """
    small = {
        "block_out_channels": [8, 16],
        "cross_attention_dim": WIDTH,
        "attention_head_dim": 2,
        "down_block_types": ["CrossAttnDownBlock2D"] * 2,
        "in_channels": 4,
        "layers_per_block": 2,
        "norm_num_groups": 4,
    }
    unet = small | NEW | {"up_block_types": ["CrossAttnUpBlock2D"] * 2}
    unet |= {"img_size": [SIZE[1], SIZE[0]]} | (TEMPORAL if temporal else {})
    controlnet = small | _control(WIDTH, 16, [8, 8, 8, 8], [8, 200, 200])
    controlnet["map_size"] = None
    controlnet["map_embedder_cls"] = "magicdrive.networks.map_embedder.BEVControlNetConditioningEmbeddingPlus"
    controlnet["map_embedder_param"] = {
        "conditioning_embedding_size": [6, 11],
        "conditioning_size": [8, 40, 40],
        "block_out_channels": [8, 8, 8, 8],
    }
    return unet, controlnet


@dataclass(frozen=True)
class Written:
    """A folder and its networks' tables."""

    path: Path
    unet: dict[str, Any]
    controlnet: dict[str, Any]

    def rewrite(self, part: str, **changes: Any) -> None:
        """Change entries of a part's ``config.json``; None takes them out."""
        file = self.path / part / "config.json"
        table = json.loads(file.read_text()) | changes
        file.write_text(json.dumps({key: value for key, value in table.items() if value != "gone"}))

    def weights(self, part: str) -> Path:
        """The file with a part's weights."""
        return next((self.path / part).glob("*.safetensors"))

    def change(self, part: str, **renamed: str) -> None:
        """Give tensors other names; an empty one drops them."""
        file = self.weights(part)
        state = {renamed.get(key, key): value for key, value in load_file(file).items()}
        save_file({key: value for key, value in state.items() if key}, file)


def write_folder(path: Path, *, temporal: bool = False) -> Written:
    """All parts with random weights, laid out as the official ones."""
    unet, controlnet = tiny_configs(temporal)
    settings = read_settings(unet, controlnet)
    torch.manual_seed(0)
    _write(path / "unet", unet, _random(multiview_unet(unet, settings).state_dict()))
    _write(path / "controlnet", controlnet, _random(BevControlNet(controlnet, settings).state_dict()))
    vae = AutoencoderKL(
        block_out_channels=(8, 8, 8),
        norm_num_groups=4,
        down_block_types=("DownEncoderBlock2D",) * 3,
        up_block_types=("UpDecoderBlock2D",) * 3,
    )
    _write(path / "vae", dict(vae.config), vae.state_dict())
    config = CLIPTextConfig(
        vocab_size=_write_tokenizer(path / "tokenizer"),
        hidden_size=WIDTH,
        intermediate_size=16,
        num_hidden_layers=1,
        num_attention_heads=2,
        max_position_embeddings=WORDS,
        bos_token_id=0,
        eos_token_id=1,
    )
    state = {f"text_model.{key}": value for key, value in CLIPTextModel(config).state_dict().items()}
    state["text_model.embeddings.position_ids"] = torch.arange(WORDS)[None]
    _write(path / "text_encoder", config.to_dict(), state, "model")
    (path / "scheduler").mkdir()
    schedule = {"_class_name": "PNDMScheduler", "beta_start": 0.00085, "beta_end": 0.012, "steps_offset": 1}
    schedule |= {"beta_schedule": "scaled_linear", "num_train_timesteps": 1000, "skip_prk_steps": True}
    (path / "scheduler" / "scheduler_config.json").write_text(json.dumps(schedule))
    return Written(path, unet, controlnet)


def _write(
    folder: Path, config: dict[str, Any], state: dict[str, Tensor], name: str = "diffusion_pytorch_model"
) -> None:
    folder.mkdir(parents=True)
    (folder / "config.json").write_text(json.dumps(config))
    save_file({key: value.contiguous() for key, value in state.items()}, folder / f"{name}.safetensors")


def _random(state: dict[str, Tensor]) -> dict[str, Tensor]:
    """Layers that start at zero are given weights, so that every part has a say."""
    return {
        key: value if value.std() > 0 or "norm" in key else 0.1 * torch.randn_like(value)
        for key, value in state.items()
    }


def _write_tokenizer(folder: Path) -> int:
    """A tokenizer of single letters."""
    folder.mkdir(parents=True)
    letters = [chr(code) for code in range(33, 127)]
    names = ["<|startoftext|>", "<|endoftext|>", *letters, *[f"{letter}</w>" for letter in letters]]
    (folder / "vocab.json").write_text(json.dumps({name: index for index, name in enumerate(names)}))
    (folder / "merges.txt").write_text("#version: 0.2\n")
    table = {"model_max_length": WORDS, "tokenizer_class": "CLIPTokenizer", "pad_token": "<|endoftext|>"}
    (folder / "tokenizer_config.json").write_text(json.dumps(table))
    return len(names)
