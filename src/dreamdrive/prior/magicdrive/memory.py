"""Whether a run fits into memory, before anything is loaded."""

import torch
from torch import nn

from dreamdrive.errors import InputError
from dreamdrive.machine import free_bytes
from dreamdrive.prior.magicdrive.config import Settings

_UNET_TENSORS = 33
"""Tensors of the UNet's first level that live at once, residuals included: counted at the official sizes,
without the weights of attention, which torch does not keep."""
_DECODED_CHANNELS = 800
"""Channels that live at once in the decoder, per pixel of the picture: counted likewise."""
_PROGRAM_BYTES = 1_000_000_000
"""Of Python, the libraries and what convolutions set aside; a guess."""
DECODE_PICTURES = 2
"""Pictures that are decoded at a time."""


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
