"""Features Z_ref of the video model: activations of a block. Loads diffusers.

The paper takes features from "early layers" of its diffusion model. Here the finished frames, made or
recorded, get a little noise and go through the UNet once, as in DIFT (Tang et al., NeurIPS 2023); nothing
depends on how they were sampled.
"""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from jaxtyping import Float, Float16, UInt8
from torch import Tensor

from dreamdrive.compute.device import chosen_device
from dreamdrive.errors import InputError
from dreamdrive.prior.early_features import BLOCK, SIGMA, onto_frames, watch
from dreamdrive.prior.pca import CHANNELS, reduce
from dreamdrive.prior.running import check_finite, counted, enough_memory
from dreamdrive.prior.vista.condition import columns_by_round
from dreamdrive.prior.vista.engine import Engine, RoundConditions
from dreamdrive.prior.vista.kinds import SVD
from dreamdrive.prior.vista.memory import LOOKING, Job, smaller_size
from dreamdrive.prior.vista.picture import NATIVE, check_size, nearest_side, to_images
from dreamdrive.prior.vista.rollout import SCALE
from dreamdrive.prior.vista.sampler import time_of
from dreamdrive.prior.vista.stored import open_weights
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.control import Action, check_action

_BLOCKS = re.compile(r"conv_in|(mid_block|(down|up)_blocks\.\d+)(\.(attentions|resnets)\.\d+)?")
"""What gives activations (B T, C, h, w)."""


@dataclass(frozen=True)
class FeatureOptions:
    """Which features.

    Attributes:
        block: Name of a block in the UNet; what comes out of ``BLOCK`` is mixed over time.
        sigma: Standard deviation of the noise on the latents, whose own is about 1.
        channels: Principal components that are kept.
    """

    block: str = BLOCK
    sigma: float = SIGMA
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


@dataclass(frozen=True)
class Window:
    """Frames that go through the UNet at once, with the columns of their action, None for SVD.

    As many of the first frames as ``fixed`` says count as known.
    """

    span: range
    action: Float[Tensor, " a"] | None
    fixed: int


def video_features(
    frames: UInt8[np.ndarray, "f h w 3"],
    weights: Path,
    options: FeatureOptions | None = None,
    *,
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
        size: Width and height at which the network sees the frames, multiples of 64; None takes the nearest.
        action: What the car does, for Vista; each window of frames is told it anew.
        seed: Of the noise.
        progress: Told of every window of frames.

    Raises:
        InputError: The weights, the block or the action cannot be used, or memory does not suffice.
    """
    chosen = options or FeatureOptions()
    height, width = frames.shape[1:3]
    seen_size = size or _nearest((width, height))
    check_size(seen_size)
    engine = Engine(open_weights(weights), chosen_device())
    kind = engine.stored.kind
    _check_block(engine.stored.parts["unet"].shapes, chosen.block)
    if action is not None:
        if kind is SVD:
            raise InputError(f"--action: {kind.title} knows of none; leave it out, or give weights of Vista")
        check_action(action)
    engine.check_fit(Job(seen_size, len(frames), engine.per_round, LOOKING))
    spans = spans_of(len(frames), engine.per_round)
    told = [None] * len(spans) if kind is SVD else columns_by_round(action, len(spans))
    windows = [Window(span, columns, int(kind is not SVD)) for span, columns in zip(spans, told, strict=True)]
    resized = np.stack([_resize(each, seen_size) for each in frames])
    smaller = "x".join(map(str, smaller_size(seen_size)))
    with torch.inference_mode(), enough_memory(f"choose a smaller --size, such as {smaller}"):
        coded = [engine.encode(to_images(resized[i : i + 1])).cpu() for i in range(len(resized))]
        tell = counted(progress, len(windows))
        values = extract(engine, SCALE * torch.cat(coded), resized, windows, chosen, seed=seed, tell=tell)
    engine.free()
    values, said = onto_frames(values, (width, height))
    if seen_size != (width, height):
        shown = f"{seen_size[0]}x{seen_size[1]} instead of {width}x{height}"
        said = (f"The video model saw the frames at {shown}.", *said)
    return VideoFeatures(f"{kind.name}:{chosen.block}", values, tuple(said))


def extract(
    engine: Engine,
    latents: Float[Tensor, "f c h w"],
    frames: UInt8[np.ndarray, "f h2 w2 3"],
    windows: Sequence[Window],
    options: FeatureOptions | None = None,
    *,
    seed: int = 0,
    tell: Callable[[], None] = lambda: None,
) -> Float16[np.ndarray, "f h3 w3 d"]:
    """Principal components of a block's activations.

    ``latents`` of all frames are scaled and clean; of the frames, the first of each window is described. Of
    frames in two windows, which are in order, the first one counts. ``tell`` is called after every window.
    """
    chosen = options or FeatureOptions()
    described = [engine.describe(to_images(frames[w.span.start : w.span.start + 1])) for w in windows]
    noise = torch.randn(latents.shape, generator=torch.Generator().manual_seed(seed))
    made: list[Float16[np.ndarray, "h w c"]] = []
    for window, image in zip(windows, described, strict=True):
        part = slice(window.span.start, window.span.stop)
        seen = RoundConditions(image, latents[window.span.start] / SCALE, window.action)
        values = _activations(engine, seen, latents[part], noise[part], chosen, window.fixed)
        made += list(values[len(made) - window.span.start :])
        tell()
    return reduce(made, chosen.channels)


def spans_of(count: int, length: int) -> list[range]:
    """Windows over all frames; the last one ends with them and so may overlap the one before."""
    starts = [min(start, max(count - length, 0)) for start in range(0, count, length)]
    return [range(start, min(start + length, count)) for start in starts]


def _activations(
    engine: Engine,
    seen: RoundConditions,
    latents: Float[Tensor, "t c h w"],
    noise: Float[Tensor, "t c h w"],
    options: FeatureOptions,
    fixed: int,
) -> Float16[np.ndarray, "t h2 w2 d"]:
    """One window through the UNet, its first frames known as when they are generated."""
    mask = torch.zeros(len(latents))
    mask[:fixed] = 1
    noisy = latents + options.sigma * noise * (1 - mask)[:, None, None, None]
    caught: list[Tensor] = []
    handle = watch(engine.network("unet"), options.block, caught.append)
    try:
        scaled = (noisy / (options.sigma**2 + 1) ** 0.5).to(engine.device)
        engine.predict(seen, scaled, time_of(options.sigma), mask.to(scaled))
    finally:
        handle.remove()
    values = caught[0].permute(0, 2, 3, 1).half()
    check_finite(values, "features")
    return values.cpu().numpy()


def _check_block(weights: Iterable[str], block: str) -> None:
    """Whether activations of a block can be had, by the names of the UNet's weights."""
    matches = (_BLOCKS.match(name) for name in weights)
    names = {name for match in matches if match for name in (match[0], match[1]) if name}
    if block not in names:
        raise InputError(f"--block {block}: the UNet has no such block; it has {', '.join(sorted(names))}")


def _nearest(size: tuple[int, int]) -> tuple[int, int]:
    """Multiples of 64, of no more pixels than the network was trained on."""
    shrink = min(1.0, (NATIVE[0] * NATIVE[1] / (size[0] * size[1])) ** 0.5)
    return nearest_side(shrink * size[0]), nearest_side(shrink * size[1])


def _resize(frame: UInt8[np.ndarray, "h w 3"], size: tuple[int, int]) -> UInt8[np.ndarray, "h2 w2 3"]:
    rule = cv2.INTER_AREA if frame.shape[1] > size[0] else cv2.INTER_CUBIC
    return np.asarray(cv2.resize(frame, size, interpolation=rule), dtype=np.uint8)
