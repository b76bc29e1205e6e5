"""What the video model sees in frames: the activations of a block, as features Z_ref. Loads diffusers.

The paper takes features from "early layers" of its diffusion model. Here the finished frames, made or
recorded, get a little noise and go through the UNet once, as in DIFT (Tang et al., NeurIPS 2023); nothing
depends on how they were sampled.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from jaxtyping import Float, Float16, UInt8
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.prior.pca import CHANNELS, reduce
from dreamdrive.prior.protocol import Progress, silent
from dreamdrive.prior.vista.condition import embed_action, numbers_of
from dreamdrive.prior.vista.engine import Engine, counted
from dreamdrive.prior.vista.kinds import KINDS, VISTA, KindName
from dreamdrive.prior.vista.load import start
from dreamdrive.prior.vista.picture import NATIVE, SIDE, check_size, to_images
from dreamdrive.prior.vista.rollout import SCALE, Seen
from dreamdrive.prior.vista.sampler import time_of
from dreamdrive.prior.vista.unet import VideoUNet, watch
from dreamdrive.scene.action import Action

BLOCK = "down_blocks.1.attentions.1"
"""The second level, behind its last transformer over time: 1/16 of the frame's size, mixed over time."""


@dataclass(frozen=True)
class FeatureOptions:
    """Which features.

    Attributes:
        block: Name of a block in the UNet.
        sigma: Standard deviation of the noise on the latents, whose own is about 1.
        channels: Principal components that are kept.
    """

    block: str = BLOCK
    sigma: float = 0.3
    channels: int = CHANNELS


@dataclass(frozen=True)
class VideoFeatures:
    """Features of a clip.

    Attributes:
        name: For ``Clip.features``.
        values: (F, h, w, C), half precision; h and w are a whole fraction of the frames' height and width.
        notes: What the report should say, a sentence each.
    """

    name: str
    values: Float16[np.ndarray, "f h w c"]
    notes: tuple[str, ...]


def video_features(
    frames: UInt8[np.ndarray, "f h w 3"],
    weights: Path,
    options: FeatureOptions | None = None,
    *,
    kind: KindName | None = None,
    size: tuple[int, int] | None = None,
    action: Action | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> VideoFeatures:
    """Features of any frames, such as those of a recorded clip.

    Args:
        frames: RGB (F, H, W, 3) of one camera, at about the model's rate (Vista 10 Hz, SVD 7 Hz).
        weights: Of SVD or Vista, see ``stored.EXPECTED``.
        options: Which features.
        kind: Which model it must be; None takes both.
        size: Width and height at which the network sees the frames, multiples of 64; None takes the nearest.
        action: What the car does, for Vista.
        seed: Of the noise.
        progress: Told of every window of frames.

    Raises:
        InputError: The weights cannot be used, or memory does not suffice.
    """
    height, width = frames.shape[1:3]
    seen_size = size or _nearest((width, height))
    check_size(seen_size)
    networks, _, count = start(weights, None if kind is None else KINDS[kind], seen_size, len(frames))
    engine = Engine(networks)
    resized = np.stack([_resize(each, seen_size) for each in frames])
    with torch.inference_mode():
        latents = SCALE * engine.encode(to_images(resized)).cpu()
        columns = None if action is None else embed_action(numbers_of(action))
        values = extract(
            engine, latents, resized, count, options, action=columns, seed=seed, progress=progress
        )
    notes = (
        []
        if seen_size == (width, height)
        else [f"The video model saw the frames at {seen_size[0]}x{seen_size[1]} instead of {width}x{height}."]
    )
    values, said = _onto_clip(values, (width, height))
    chosen = options or FeatureOptions()
    return VideoFeatures(f"{networks.stored.kind.name}:{chosen.block}", values, (*notes, *said))


def extract(
    engine: Engine,
    latents: Float[Tensor, "f c h w"],
    frames: UInt8[np.ndarray, "f h2 w2 3"],
    window: int,
    options: FeatureOptions | None = None,
    *,
    action: Float[Tensor, " a"] | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> Float16[np.ndarray, "f h3 w3 d"]:
    """Principal components of a block's activations.

    Args:
        engine: The networks.
        latents: Scaled clean latents of all frames.
        frames: The frames, of which the first of each window is described.
        window: Frames that the UNet sees at once.
        options: Which features.
        action: Columns of the action.
        seed: Of the noise.
        progress: Told of every window.

    Raises:
        InputError: The UNet has no such block.
    """
    chosen = options or FeatureOptions()
    vista = engine.networks.stored.kind is VISTA
    spans = windows(len(latents), window)
    described = [engine.describe(to_images(frames[span.start : span.start + 1])) for span in spans]
    columns = (embed_action({}) if action is None else action) if vista else None
    draw = torch.Generator().manual_seed(seed)
    noise = torch.randn(latents.shape, generator=draw)
    made: list[Float16[np.ndarray, "h w c"]] = []
    tell = counted(progress, len(spans))
    for span, image in zip(spans, described, strict=True):
        part = slice(span.start, span.stop)
        seen = Seen(image, latents[span.start] / SCALE, columns)
        values = _activations(engine, seen, latents[part], noise[part], chosen, fixed=vista)
        made += list(values[len(made) - span.start :])
        tell()
    return reduce(made, chosen.channels)


def windows(count: int, length: int) -> list[range]:
    """Windows over all frames; the last one ends with them and so may overlap the one before."""
    starts = [min(start, max(count - length, 0)) for start in range(0, count, length)]
    return [range(start, min(start + length, count)) for start in starts]


def _activations(
    engine: Engine,
    seen: Seen,
    latents: Float[Tensor, "t c h w"],
    noise: Float[Tensor, "t c h w"],
    options: FeatureOptions,
    *,
    fixed: bool,
) -> Float16[np.ndarray, "t h2 w2 d"]:
    """One window through the UNet, its first frame known as when it is generated."""
    unet = engine.networks.unet()
    mask = torch.zeros(len(latents))
    mask[0] = float(fixed)
    noisy = latents + options.sigma * noise * (1 - mask)[:, None, None, None]
    caught: list[Tensor] = []
    handle = watch(unet, _known(unet, options.block), caught.append)
    try:
        scaled = (noisy / (options.sigma**2 + 1) ** 0.5).to(engine.networks.device)
        engine.look(seen, scaled, time_of(options.sigma), mask.to(scaled))
    finally:
        handle.remove()
    return caught[0].permute(0, 2, 3, 1).cpu().numpy().astype(np.float16)


def _known(unet: VideoUNet, block: str) -> str:
    """The name of a block.

    Raises:
        InputError: There is none of that name.
    """
    names = [name for name, _ in unet.named_modules() if name.count(".") in (1, 3) and "attentions" in name]
    if block not in dict(unet.named_modules()):
        raise InputError(f"the UNet has no block {block!r}; such as {', '.join(names[:6])}")
    return block


def _nearest(size: tuple[int, int]) -> tuple[int, int]:
    """Multiples of 64, of no more pixels than the network was trained on."""
    shrink = min(1.0, (NATIVE[0] * NATIVE[1] / (size[0] * size[1])) ** 0.5)
    width, height = (max(SIDE, SIDE * round(shrink * side / SIDE)) for side in size)
    return width, height


def _resize(frame: UInt8[np.ndarray, "h w 3"], size: tuple[int, int]) -> UInt8[np.ndarray, "h2 w2 3"]:
    rule = cv2.INTER_AREA if frame.shape[1] > size[0] else cv2.INTER_CUBIC
    return np.asarray(cv2.resize(frame, size, interpolation=rule), dtype=np.uint8)


def _onto_clip(
    values: Float16[np.ndarray, "f h w c"], size: tuple[int, int]
) -> tuple[Float16[np.ndarray, "f h2 w2 c"], Sequence[str]]:
    """The features on a grid that divides the frames, and what to say about it."""
    height, width = (_divisor(side, own) for side, own in zip(size[::-1], values.shape[1:3], strict=True))
    if (height, width) == values.shape[1:3]:
        return values, ()
    resized = [
        np.asarray(cv2.resize(one.astype(np.float32), (width, height)), dtype=np.float16) for one in values
    ]
    note = (
        f"The features of the video model are resized from {values.shape[2]}x{values.shape[1]} to "
        f"{width}x{height}, which divides the frames."
    )
    return np.stack(resized).reshape(len(values), height, width, -1), (note,)


def _divisor(side: int, wanted: int) -> int:
    """The divisor of a side that is nearest to the wanted number."""
    return min((n for n in range(1, side + 1) if side % n == 0), key=lambda n: (abs(n - wanted), -n))
