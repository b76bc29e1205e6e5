"""MagicDrive's weights: its own ``unet`` and ``controlnet`` beside the parts of Stable Diffusion 1.5."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from diffusers.models.autoencoders.autoencoder_kl import AutoencoderKL
from diffusers.models.unets.unet_2d_condition import UNet2DConditionModel
from jaxtyping import Float
from torch import Tensor, nn
from transformers import CLIPTextConfig, CLIPTextModel, CLIPTokenizer

from dreamdrive.compute.device import chosen_device
from dreamdrive.compute.machine import free_bytes
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import read_json
from dreamdrive.models import check_sizes, fill, read_state, sha256
from dreamdrive.prior.early_features import BLOCK
from dreamdrive.prior.magicdrive.config import EXPECTED, Settings, read_settings
from dreamdrive.prior.magicdrive.networks import BevControlNet, multiview_unet, plain_settings

_DIFFUSERS = tuple(f"diffusion_pytorch_model.{end}" for end in ("safetensors", "fp16.safetensors", "bin"))
_TEXT = ("model.safetensors", "model.fp16.safetensors", "pytorch_model.bin")
_PARTS = {
    "unet": ("config.json", _DIFFUSERS),
    "controlnet": ("config.json", _DIFFUSERS),
    "vae": ("config.json", _DIFFUSERS),
    "text_encoder": ("config.json", _TEXT),
    "tokenizer": ("vocab.json", ("merges.txt",)),
    "scheduler": ("scheduler_config.json", ()),
}
_OLD_NAME = re.compile(r"(?<=\.)(query|key|value|proj_attn)(?=\.)")
_NEW_NAMES = {"query": "to_q", "key": "to_k", "value": "to_v", "proj_attn": "to_out.0"}
"""Of the attention in autoencoders that were written before 2023, as that of Stable Diffusion 1.5."""
_UNET_TENSORS = 33
"""Tensors of the UNet's first level that live at once, residuals included: counted at the official sizes,
without the weights of attention, which torch does not keep."""
_DECODED_CHANNELS = 800
"""Channels that live at once in the decoder, per pixel of the picture: counted likewise."""
_PROGRAM_BYTES = 1_000_000_000
"""Of Python, the libraries and what convolutions set aside; a guess."""
DECODE_PICTURES = 2
"""Pictures that are decoded at a time."""


@dataclass(frozen=True)
class MagicDriveNetworks:
    """All networks of a folder, ready to run.

    ``scheduler`` is the table of ``scheduler_config.json``, ``digests`` are of the files that are
    MagicDrive's own, and ``words`` gives the tokens of a text.
    """

    settings: Settings
    unet: UNet2DConditionModel
    controlnet: BevControlNet
    vae: AutoencoderKL
    words: "Words"
    scheduler: dict[str, Any]
    digests: dict[str, str]
    device: torch.device

    @property
    def latent_shape(self) -> tuple[int, int, int]:
        """Channels, height and width of a picture's latents."""
        width, height = self.settings.size
        stride = vae_stride(self.vae)
        return self.unet.config["in_channels"], height // stride, width // stride


@dataclass(frozen=True)
class Words:
    """The text encoder with its tokenizer."""

    tokenizer: CLIPTokenizer
    encoder: CLIPTextModel

    @torch.inference_mode()
    def __call__(self, text: str) -> Float[Tensor, "1 l c"]:
        """Tokens of a text, cut or padded to the encoder's length (77)."""
        length = self.encoder.config.max_position_embeddings
        ids = self.tokenizer(
            [text], padding="max_length", max_length=length, truncation=True, return_tensors="pt"
        ).input_ids
        return self.encoder(ids.to(self.encoder.device)).last_hidden_state


def vae_stride(vae: AutoencoderKL) -> int:
    """Pixels per latent."""
    return 2 ** (len(vae.config["block_out_channels"]) - 1)


def read_parts(folder: Path, *, temporal: bool) -> MagicDriveNetworks:
    """Load a folder (see ``EXPECTED``); nothing in it is executed, nothing is fetched.

    On a GPU the networks run in half precision, elsewhere in float32.
    """
    files = _find_parts(folder)
    configs = {
        part: read_json(folder / part / _PARTS[part][0], "--weights")
        for part in _PARTS
        if part != "tokenizer"
    }
    for part, config in configs.items():
        check_sizes(config, f"--weights {folder / part / _PARTS[part][0]}")
    settings = read_settings(configs["unet"], configs["controlnet"])
    _check_variant(settings, temporal)
    device = chosen_device()
    dtype = torch.float16 if device.type == "cuda" else torch.float32
    with torch.device("meta"):
        unet = _built("unet", lambda: multiview_unet(configs["unet"], settings))
        controlnet = _built("controlnet", lambda: BevControlNet(configs["controlnet"], settings))
        vae = _built("vae", lambda: AutoencoderKL(**plain_settings(AutoencoderKL, configs["vae"])))
    # Not on the meta device: it has a buffer that no file holds.
    encoder = _built("text_encoder", lambda: CLIPTextModel(CLIPTextConfig.from_dict(configs["text_encoder"])))
    _check_fit(settings, controlnet, vae, encoder)
    _check_block(unet)
    width = configs["unet"]["block_out_channels"][0]
    check_memory(needed_bytes([unet, controlnet, vae, encoder], settings, width, dtype.itemsize), device)

    def filled(network: nn.Module, part: str) -> Any:
        fill(_core(network), _state(files[part], part), str(files[part]), EXPECTED)
        network.eval().requires_grad_(False)
        return nn.Module.to(network, device, dtype)  # diffusers' own prints a warning about nothing

    return MagicDriveNetworks(
        settings=settings,
        unet=filled(unet, "unet"),
        controlnet=filled(controlnet, "controlnet"),
        vae=filled(vae, "vae"),
        words=Words(_tokenizer(folder / "tokenizer"), filled(encoder, "text_encoder")),
        scheduler=configs["scheduler"],
        digests={part: sha256(files[part]) for part in ("unet", "controlnet")},
        device=device,
    )


def _find_parts(folder: Path) -> dict[str, Path]:
    """The file with the weights of each part."""
    if not folder.is_dir():
        raise InputError(f"--weights {folder} is no folder; expected {EXPECTED}")
    found: dict[str, Path] = {}
    missing: list[str] = []
    for part, (config, names) in _PARTS.items():
        if not (folder / part / config).is_file():
            missing.append(f"{part}/{config}")
        there = [folder / part / name for name in names if (folder / part / name).is_file()]
        if there:
            found[part] = there[0]
        elif names:
            missing.append(f"{part}/{names[0]}")
    if missing:
        raise InputError(f"--weights {folder} lacks {', '.join(missing)}; expected {EXPECTED}")
    return found


def _check_variant(settings: Settings, temporal: bool) -> None:
    if temporal and settings.temporal is None:
        raise InputError(
            "--prior magicdrive-t: these weights are of single time steps (unet/config.json has no "
            "temp_attn_type); take --prior magicdrive"
        )
    if settings.temporal is not None and not temporal:
        raise InputError(
            f"--prior magicdrive: these weights are of the temporal variant, "
            f"{settings.temporal.frames} frames; take --prior magicdrive-t"
        )


def _check_fit(
    settings: Settings, controlnet: BevControlNet, vae: AutoencoderKL, encoder: CLIPTextModel
) -> None:
    """The parts belong together, as far as shapes tell."""
    width, height = settings.size
    stride = vae_stride(vae)
    latents = (height / stride, width / stride)
    wanted = controlnet.cam2token.out_features
    if encoder.config.hidden_size != wanted:
        raise InputError(
            f"text_encoder/ is {encoder.config.hidden_size} wide, unet/ and controlnet/ take {wanted}; "
            f"expected that of Stable Diffusion 1.5"
        )
    with torch.device("meta"):
        encoded = controlnet.controlnet_cond_embedding(torch.zeros(1, *settings.map_shape))
    if tuple(encoded.shape[2:]) != latents:
        raise InputError(
            f"unet/config.json says pictures of {width}x{height}, whose latents are {latents[1]:g}x"
            f"{latents[0]:g}, but controlnet/ brings the map to {encoded.shape[3]}x{encoded.shape[2]}; "
            f"expected two folders of one model"
        )


def _check_block(unet: UNet2DConditionModel) -> None:
    """The UNet has the block that the features come from."""
    if BLOCK not in dict(unet.named_modules()):
        raise InputError(
            f"unet/config.json builds no block {BLOCK}, whose activations are the features; expected the "
            "levels and layers of Stable Diffusion 1.5"
        )


def _built(part: str, make: Callable[[], Any]) -> Any:
    try:
        return make()
    except (TypeError, ValueError, KeyError, AttributeError, RuntimeError) as error:
        what = f"{type(error).__name__}: {error}"
        raise InputError(f"{part}/config.json builds no network ({what}); expected {EXPECTED}") from None


def _core(network: nn.Module) -> nn.Module:
    """The module whose keys files hold: transformers 4 wraps the text encoder once more than 5."""
    return getattr(network, "text_model", network)


def _state(file: Path, part: str) -> dict[str, Tensor]:
    state = read_state(file, EXPECTED)
    if part == "vae":
        return {_OLD_NAME.sub(lambda match: _NEW_NAMES[match[1]], key): v for key, v in state.items()}
    if part == "text_encoder":
        state = {key.removeprefix("text_model."): value for key, value in state.items()}
        state.pop("embeddings.position_ids", None)  # files of older text encoders hold these counts from 0
    return state


def _tokenizer(folder: Path) -> CLIPTokenizer:
    try:
        return CLIPTokenizer.from_pretrained(str(folder), local_files_only=True)
    except Exception as error:  # the one broad except: tokenizers raises no narrower one
        raise InputError(f"{folder} is no tokenizer of CLIP ({error}); expected {EXPECTED}") from error


def needed_bytes(networks: list[nn.Module], settings: Settings, width: int, element_bytes: int) -> int:
    """Estimate of the peak: all weights, and the larger of one denoising branch and one chunk of the decoder.

    ``width`` is that of the UNet's first level; parameters may be on the meta device.
    """
    pixels = settings.size[0] * settings.size[1]
    parameters = sum(each.numel() for network in networks for each in network.parameters())
    branch = _UNET_TENSORS * width * (pixels // 64) * settings.views * settings.frames
    decoding = _DECODED_CHANNELS * pixels * DECODE_PICTURES
    return element_bytes * (parameters + max(branch, decoding)) + _PROGRAM_BYTES


def check_memory(needed: int, device: torch.device) -> None:
    """Refuse what cannot fit."""
    free = free_bytes(device)
    if free is not None and needed > free:
        where = "the GPU" if device.type == "cuda" else "this machine"
        raise InputError(
            f"MagicDrive needs about {needed / 1e9:.1f} GB with these weights, and {where} has "
            f"{free / 1e9:.1f} GB free; close other programs or take a larger machine"
        )
