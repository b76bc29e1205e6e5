"""What memory a run will take, told before anything is loaded.

One network at a time is in memory. What each needs beside its weights was found by running the networks of
official size without numbers (on torch's meta device) and adding up what lived at once; it grows with the
width of the network's first level, the frames and the pixels. Attention takes no memory of its own in that,
as the fused kernels have it. On a GPU it was not measured.
"""

from dataclasses import dataclass

from dreamdrive.errors import InputError
from dreamdrive.prior.vista.decode import CHUNK
from dreamdrive.prior.vista.keys import Part
from dreamdrive.prior.vista.picture import SIDE
from dreamdrive.prior.vista.stored import Stored

LEAST_CHUNK = 4
"""Frames that must be decoded at once: three shared with the chunk before, and one."""
_FLOAT = 4
# Numbers that live at once for each channel of the first level, frame and pixel of the latents.
_UNET, _DECODER, _ENCODER = 27, 512, 322
_MARGIN = 1.25  # for workspaces of the libraries and what the allocator cannot give back
_RESULT = 3 * _FLOAT + 3  # bytes a pixel of a decoded frame


@dataclass(frozen=True)
class Plan:
    """Bytes that each part of a run takes, its weights included.

    Attributes:
        image_encoder: Describing the first frame.
        encoder: Encoding frames.
        unet: Sampling and features.
        decoder: Decoding.
        chunk: Frames decoded at once.
    """

    image_encoder: int
    encoder: int
    unet: int
    decoder: int
    chunk: int

    @property
    def peak(self) -> int:
        """The most at once."""
        return max(self.image_encoder, self.encoder, self.unet, self.decoder)

    def __str__(self) -> str:
        return (
            f"{_gb(self.peak)} (image encoder {_gb(self.image_encoder)}, encoder {_gb(self.encoder)}, UNet "
            f"{_gb(self.unet)}, decoder {_gb(self.decoder)} for {self.chunk} frames at once)"
        )


def plan_memory(
    stored: Stored, size: tuple[int, int], frames: int, per_round: int, available: int | None, *, half: bool
) -> Plan:
    """What a run will take, with as many frames decoded at once as fit.

    Args:
        stored: The model.
        size: Width and height of the frames.
        frames: How many are made in all.
        per_round: How many the UNet sees at once.
        available: Bytes that may be taken; None where nobody knows.
        half: Whether the UNet computes in float16.

    Raises:
        InputError: It does not fit; the message names a size that does.
    """
    plans = [
        _plan(stored, size, frames, per_round, chunk, half) for chunk in range(CHUNK, LEAST_CHUNK - 1, -1)
    ]
    fitting = [plan for plan in plans if available is None or plan.peak <= available]
    if fitting:
        return fitting[0]
    smaller = [
        (size[0] - SIDE * i, _side((size[0] - SIDE * i) * size[1] / size[0]))
        for i in range(1, size[0] // SIDE)
    ]
    suits = (
        each
        for each in smaller
        if _plan(stored, each, frames, per_round, LEAST_CHUNK, half).peak <= (available or 0)
    )
    found = next(suits, None)
    advice = (
        "no smaller size fits either" if found is None else f"give --size {found[0]}x{found[1]} or smaller"
    )
    raise InputError(
        f"{stored.kind.title} at {size[0]}x{size[1]} needs about {plans[-1]}, and {_gb(available or 0)} are "
        f"free: {advice}, or take a machine with more memory"
    )


def _plan(stored: Stored, size: tuple[int, int], frames: int, per_round: int, chunk: int, half: bool) -> Plan:
    pixels = size[0] * size[1] // 64
    width = {part: stored.parts[part].config["block_out_channels"][0] for part in ("unet", "vae")}
    bytes_ = 2 if half else _FLOAT
    weights: dict[Part, int] = {part: own.count for part, own in stored.parts.items()}
    vae = _FLOAT * weights["vae"]
    made = _RESULT * frames * size[0] * size[1]
    return Plan(
        image_encoder=int(_FLOAT * weights["image_encoder"] * _MARGIN),
        encoder=int(vae + _MARGIN * _FLOAT * _ENCODER * width["vae"] * pixels),
        unet=int(bytes_ * (weights["unet"] + _MARGIN * _UNET * width["unet"] * pixels * per_round)),
        decoder=int(vae + made + _MARGIN * _FLOAT * _DECODER * width["vae"] * pixels * min(chunk, frames)),
        chunk=chunk,
    )


def _side(length: float) -> int:
    return max(SIDE, SIDE * round(length / SIDE))


def _gb(count: int) -> str:
    return f"{count / 1e9:.1f} GB"
