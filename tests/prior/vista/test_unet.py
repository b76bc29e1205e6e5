"""The UNet against the public code."""

import pytest
import torch
from tests.prior.vista.conftest import Golden
from tests.prior.vista.golden import Given, golden_unet
from tests.prior.vista.tiny import configs
from torch import Tensor

from dreamdrive.prior.vista.kinds import SVD, VISTA
from dreamdrive.prior.vista.networks import make_empty
from dreamdrive.prior.vista.unet import VideoUNet, watch

ATOL = 1e-5
"""The golden README measures 4e-6, and 7e-5 with diffusers' own normalisations."""


def look(unet: VideoUNet, given: dict[str, Tensor], context: Tensor, *, mask: bool) -> Tensor:
    """Both clips, one after the other: their times differ."""
    frames = int(given["in.num_frames"])
    clips = given["in.x"].unflatten(0, (-1, frames))
    made: list[Tensor] = []
    for i, clip in enumerate(clips):
        own = slice(frames * i, frames * (i + 1))
        unet.add_time_proj = Given(given["in.y"][frames * i])  # type: ignore[assignment]
        fixed = given["in.cond_mask"][own] if mask else None
        time = float(given["in.timesteps"][frames * i])
        made.append(unet(clip[None], time, context[i : i + 1], torch.zeros(1, 3), fixed)[0])
    return torch.cat(made)


@pytest.mark.parametrize(("tokens", "mask"), [("1tok", True), ("1tok", False), ("3tok", True)])
def test_golden_actions_and_fixed_frames(golden: Golden, tokens: str, mask: bool) -> None:
    name = f"out.out_{tokens}_{'mask' if mask else 'nomask'}"
    given = golden.tensors("unet_forward")
    made = look(golden_unet(golden), given, given[f"in.context_{tokens}"], mask=mask)
    torch.testing.assert_close(made, given[name], atol=ATOL, rtol=0)


def test_golden_zero_actions_are_no_actions(golden: Golden) -> None:
    given = golden.tensors("unet_forward")
    context = given["in.context_3tok"].clone()
    context[..., 64:] = 0
    zero = look(golden_unet(golden), given, context, mask=True)
    torch.testing.assert_close(zero, given["out.out_3tok_mask_zeroaction"], atol=ATOL, rtol=0)
    plain = golden_unet(golden, actions=False)
    for mask, name in ((True, "mask"), (False, "nomask")):
        made = look(plain, given, context[..., :64], mask=mask)
        torch.testing.assert_close(made, given[f"out.out_3tok_{name}_noaction"], atol=ATOL, rtol=0)


def test_golden_blocks_hand_over_what_they_make(golden: Golden) -> None:
    given, unet = golden.tensors("unet_forward"), golden_unet(golden)
    places = {
        "input_blocks.0": "conv_in",
        "input_blocks.1": "down_blocks.0.attentions.0",
        "input_blocks.2": "down_blocks.0",
        "input_blocks.3": "down_blocks.1.attentions.0",
        "middle_block": "mid_block",
        "output_blocks.1": "up_blocks.0",
    }
    kept: dict[str, list[Tensor]] = {name: [] for name in places}
    handles = [watch(unet, place, kept[name].append) for name, place in places.items()]
    look(unet, given, given["in.context_1tok"], mask=True)
    for handle in handles:
        handle.remove()
    look(unet, given, given["in.context_1tok"], mask=True)
    for name, parts in kept.items():
        assert len(parts) == 2
        torch.testing.assert_close(torch.cat(parts), given[f"out.feat.{name}"], atol=3e-5, rtol=0)


def test_only_vista_knows_of_fixed_frames() -> None:
    for kind in (SVD, VISTA):
        unet = make_empty("unet", configs(kind)["unet"], kind)
        assert isinstance(unet, VideoUNet)
        assert (unet.cond_time_embedding is not None) == (kind is VISTA)
