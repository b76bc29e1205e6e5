"""The decoder a frame at a time: what it makes of all frames at once, in a third of the memory.

Most of its layers see one frame. The others mix a frame with its two neighbours after a normalisation over
all frames, whose mean and spread are taken first. So no more than two maps of each frame live at once, beside
what one frame needs.
"""

from collections.abc import Callable, Iterator
from typing import Any

import torch
from diffusers.models.autoencoders.autoencoder_kl_temporal_decoder import TemporalDecoder
from diffusers.models.resnet import SpatioTemporalResBlock
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn.functional import conv2d, silu

Frames = list[Float[Tensor, "1 _c _h _w"]]
"""A map for each frame. What a function replaces in the list is no longer held."""


def decode_by_frames(
    decoder: TemporalDecoder, latents: Float[Tensor, "t 4 h w"]
) -> Float[Tensor, "t 3 h2 w2"]:
    """Frames of latents that are not scaled; all of them are mixed, as in the decoder's own ``forward``."""
    frames: Frames = list(latents.split(1))
    alone: list[Callable[[Tensor], Tensor]] = [decoder.conv_in]
    for layer in _layers(decoder):
        if not isinstance(layer, SpatioTemporalResBlock):
            alone.append(layer)
            continue
        # Between two mixtures each frame goes through on its own: a map at full width is never there of all.
        _each(frames, [*alone, lambda frame, block=layer.spatial_res_block: block(frame, None)])
        _mix(frames, layer)
        alone = []
    _each(frames, [*alone, decoder.conv_norm_out, decoder.conv_act, decoder.conv_out])
    made = decoder.time_conv_out(torch.stack(frames, dim=2))
    return made[0].transpose(0, 1)


def _layers(decoder: TemporalDecoder) -> Iterator[Any]:
    """All between the first convolution and the last, in their order."""
    middle: Any = decoder.mid_block
    levels: Any = decoder.up_blocks
    yield middle.resnets[0]
    for attention, block in zip(middle.attentions, middle.resnets[1:], strict=False):
        yield from (attention, block)
    for level in levels:
        yield from level.resnets
        yield from level.upsamplers or ()


def _each(frames: Frames, layers: list[Callable[[Tensor], Tensor]]) -> None:
    """Put every frame through the layers."""
    for k in range(len(frames)):
        for layer in layers:
            frames[k] = layer(frames[k])


def _mix(frames: Frames, block: SpatioTemporalResBlock) -> None:
    """The temporal half of a block: a residual of each frame and its neighbours, blended in."""
    temporal, known = block.temporal_res_block, frames[0].new_zeros(1, 1)
    hidden = list(_through_time(frames, temporal.norm1, temporal.conv1, keep=True))
    for k, change in enumerate(_through_time(hidden, temporal.norm2, temporal.conv2, keep=False)):
        frame = frames[k].unsqueeze(2)
        change = frame + change.unsqueeze(2)
        frames[k] = block.time_mixer(x_spatial=frame, x_temporal=change, image_only_indicator=known)[:, :, 0]


def _through_time(
    frames: Frames, norm: nn.GroupNorm, conv: nn.Conv3d, *, keep: bool
) -> Iterator[Float[Tensor, "1 c h w"]]:
    """Normalised over all frames, activated, and each convolved with its neighbours; nothing beyond the ends.

    Without ``keep`` a frame leaves the list once it has been normalised.
    """
    scale, shift = _normalisation(frames, norm)
    count = len(frames)
    before, here, after = (conv.weight[:, :, k] for k in range(3))
    seen: dict[int, Tensor] = {}
    for k in range(count):
        for near in range(k, min(k + 2, count)):
            if near not in seen:
                seen[near] = silu((frames[near] * scale).add_(shift), inplace=True)
                if not keep:
                    frames[near] = scale.new_empty(0)
        made = conv2d(seen[k], here, conv.bias)
        if k > 0:
            made += conv2d(seen.pop(k - 1), before)
        if k + 1 < count:
            made += conv2d(seen[k + 1], after)
        yield made


def _normalisation(
    frames: Frames, norm: nn.GroupNorm
) -> tuple[Float[Tensor, "1 c 1 1"], Float[Tensor, "1 c 1 1"]]:
    """What to multiply by and to add, by the mean and variance of each group over all frames."""
    of_each = [torch.var_mean(f.reshape(norm.num_groups, -1), dim=1, correction=0) for f in frames]
    variances, means = (torch.stack(part) for part in zip(*of_each, strict=True))
    mean = means.mean(dim=0)
    spread = (variances.mean(dim=0) + (means - mean).square().mean(dim=0) + norm.eps).rsqrt()
    mean, spread = (part.repeat_interleave(norm.num_channels // norm.num_groups) for part in (mean, spread))
    scale = spread * norm.weight
    return scale[None, :, None, None], (norm.bias - mean * scale)[None, :, None, None]
