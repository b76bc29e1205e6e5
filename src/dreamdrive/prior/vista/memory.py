"""Memory that a run will take, told before anything is loaded.

One network at a time is in memory. What each needs beside its weights was found by running the networks of
official size without numbers (on torch's meta device) and adding up what lived at once; it grows with the
width of the network's first level, the frames and the pixels. Attention takes no memory of its own in that,
as the fused kernels have it. On a GPU it was not measured.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

from dreamdrive.errors import InputError
from dreamdrive.prior.vista.picture import SIDE, nearest_side
from dreamdrive.prior.vista.stored import StoredModel

CHUNK = 14
"""Frames that Vista decodes at once."""
Step = Literal["image encoder", "encoder", "UNet", "decoder"]
MAKING: tuple[Step, ...] = ("image encoder", "encoder", "UNet", "decoder")
LOOKING: tuple[Step, ...] = ("image encoder", "encoder", "UNet")
"""What features of frames that are there already need."""
_FLOAT = 4
# Numbers that live at once for each channel of the first level and pixel of the latents: for each frame, and
# in the decoder once beside them, for the frame that goes through.
_UNET, _ENCODER, _DECODER, _DECODER_ONCE = 27, 322, 128, 320
_MARGIN = 1.25  # for workspaces of the libraries and what the allocator cannot give back
_RESULT = 3 * _FLOAT + 2 * 3  # bytes a pixel of a decoded frame: as it comes, and twice as bytes


@dataclass(frozen=True)
class Job:
    """What a run does: the decoder makes ``frames`` in all, and the UNet sees those of a round at once."""

    size: tuple[int, int]
    frames: int
    per_round: int
    steps: tuple[Step, ...] = MAKING


@dataclass(frozen=True)
class Free:
    """Bytes that may be taken where networks run, and in main memory for decoded frames; None: nobody knows.

    Where both are the same memory, which is then ``shared``, ``frames`` does not count.
    """

    networks: int | None
    frames: int | None = None
    shared: bool = True


@dataclass(frozen=True)
class MemoryUse:
    """Bytes that each network takes at work, its weights included, and decoded frames in main memory."""

    steps: Mapping[Step, int]
    frames: int

    def peak(self, *, shared: bool) -> int:
        """The most at once where the networks run; decoded frames are there too if it is the main memory."""
        decoding = self.steps.get("decoder", 0) + self.frames if shared else 0
        return max(*self.steps.values(), decoding)

    def fits(self, free: Free) -> bool:
        """Whether it fits, as far as anybody knows."""
        networks = free.networks is None or self.peak(shared=free.shared) <= free.networks
        return networks and (free.shared or free.frames is None or self.frames <= free.frames)

    def __str__(self) -> str:
        steps = ", ".join(f"{step} {_gb(count)}" for step, count in self.steps.items())
        return f"{steps}" + (f", decoded frames {_gb(self.frames)}" if self.frames else "")


def plan_memory(stored: StoredModel, job: Job, *, half: bool) -> MemoryUse:
    """What a run will take; ``half`` is whether the UNet computes in float16."""
    pixels = job.size[0] * job.size[1] // 64
    width = {part: stored.parts[part].config["block_out_channels"][0] for part in ("unet", "vae")}
    bytes_ = 2 if half else _FLOAT
    weights = {part: own.count for part, own in stored.parts.items()}
    vae, alive = _FLOAT * weights["vae"], _MARGIN * _FLOAT * width["vae"] * pixels
    steps: dict[Step, int] = {
        "image encoder": int(_FLOAT * weights["image_encoder"] * _MARGIN),
        "encoder": int(vae + alive * _ENCODER),
        "UNet": int(bytes_ * (weights["unet"] + _MARGIN * _UNET * width["unet"] * pixels * job.per_round)),
        "decoder": int(vae + alive * (_DECODER * min(CHUNK, job.frames) + _DECODER_ONCE)),
    }
    frames = _RESULT * job.frames * job.size[0] * job.size[1] if "decoder" in job.steps else 0
    return MemoryUse({step: steps[step] for step in job.steps}, frames)


def check_memory(stored: StoredModel, job: Job, free: Free, *, half: bool) -> MemoryUse:
    """What a run will take; one that does not fit is refused, naming a size that does.

    With ``half`` the UNet computes in float16.

    Raises:
        InputError: It does not fit.
    """
    plan = plan_memory(stored, job, half=half)
    if plan.fits(free):
        return plan
    found = next(
        (
            size
            for size in _smaller_sizes(job.size)
            if plan_memory(stored, replace(job, size=size), half=half).fits(free)
        ),
        None,
    )
    advice = (
        "no smaller size fits either" if found is None else f"give --size {found[0]}x{found[1]} or smaller"
    )
    fewer = ", or fewer --frames" if job.frames > job.per_round else ""
    there = f"{_gb(free.networks or 0)} are free"
    if not free.shared:
        there = f"{_gb(free.networks or 0)} of the GPU and {_gb(free.frames or 0)} of main memory are free"
    raise InputError(
        f"{stored.kind.title} at {job.size[0]}x{job.size[1]} needs about "
        f"{_gb(plan.peak(shared=free.shared))} at once ({plan}), and {there}: {advice}{fewer}, "
        "or take a machine with more memory"
    )


def smaller_size(size: tuple[int, int]) -> tuple[int, int]:
    """About three quarters of a size, whose sides the network can make."""
    return nearest_side(0.75 * size[0]), nearest_side(0.75 * size[1])


def _smaller_sizes(size: tuple[int, int]) -> list[tuple[int, int]]:
    """All of the same shape, the largest first."""
    widths = range(size[0] - SIDE, 0, -SIDE)
    return [(width, nearest_side(width * size[1] / size[0])) for width in widths]


def _gb(count: int) -> str:
    return f"{count / 1e9:.1f} GB"
