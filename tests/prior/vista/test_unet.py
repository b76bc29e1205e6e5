"""The UNet against the public code."""

import re

import pytest
import torch
from diffusers.models.resnet import ResnetBlock2D, TemporalResnetBlock
from torch import Tensor

from dreamdrive.prior.early_features import watch
from dreamdrive.prior.vista.kinds import SVD, VISTA
from dreamdrive.prior.vista.networks import VideoUNet, make_empty
from tests.golden.reading import Table, cases, close, tensors
from tests.prior.vista.networks import Given, golden_unet, unet_config
from tests.prior.vista.tiny import configs

LIMIT = 3e-5
"""Of the largest value; float32 differs by 2e-6 through all layers, and more where they are more."""


def unet_forward() -> Table:
    return tensors("vista/unet_forward.safetensors")


def predict(unet: VideoUNet, given: Table, context: Tensor, *, mask: bool) -> Tensor:
    """All clips, one after the other: their times differ."""
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


@pytest.mark.parametrize(
    "name", cases("vista/unet_forward.safetensors", r"out\.out_(\d+tok_(?:no)?mask(?:_\w+)?)")
)
def test_golden_actions_and_fixed_frames(name: str) -> None:
    """Zero actions are no actions, whether or not there are weights for them."""
    given = unet_forward()
    tokens, mask, *action = name.split("_")
    context = given[f"in.context_{tokens}"].clone()
    image = unet_config()["context_dim"]
    if action == ["noaction"]:
        context = context[..., :image]
    elif action:
        assert action == ["zeroaction"]
        context[..., image:] = 0
    expected = given[f"out.out_{name}"]
    made = predict(golden_unet(actions=action != ["noaction"]), given, context, mask=mask == "mask")
    close(made, expected, LIMIT)


def place_of(block: str, per_level: int) -> str:
    """What diffusers calls the place behind a block of the public code."""
    if block == "middle_block":
        return "mid_block"
    side, index = re.fullmatch(r"(in|out)put_blocks\.(\d+)", block).groups()  # type: ignore[union-attr]
    if block == "input_blocks.0":
        return "conv_in"
    level, number = divmod(int(index) - (side == "in"), per_level + 1)
    place = f"{'down' if side == 'in' else 'up'}_blocks.{level}"
    if number == per_level:  # with the change of size, which comes last
        return place
    attends = any(name.startswith(f"{place}.attentions.") for name in golden_unet().state_dict())
    return f"{place}.{'attentions' if attends else 'resnets'}.{number}"


def test_golden_blocks_hand_over_what_they_make() -> None:
    given, unet = unet_forward(), golden_unet()
    expected = given.under("out.feat.")
    assert expected
    kept: dict[str, list[Tensor]] = {name: [] for name in expected}
    per_level = unet_config()["num_res_blocks"]
    handles = [watch(unet, place_of(name, per_level), kept[name].append) for name in expected]
    predict(unet, given, given["in.context_1tok"], mask=True)
    for handle in handles:
        handle.remove()
    predict(unet, given, given["in.context_1tok"], mask=True)
    for name, parts in kept.items():
        close(torch.cat(parts), expected[name], LIMIT, name)


def test_normalisations_are_those_of_the_public_code() -> None:
    """Which show in the golden numbers by less than rounding may."""
    unet = make_empty("unet", configs(VISTA)["unet"], VISTA)
    blocks = [part for part in unet.modules() if isinstance(part, ResnetBlock2D | TemporalResnetBlock)]
    assert {norm.eps for block in blocks for norm in (block.norm1, block.norm2)} == {1e-5}


def test_only_vista_knows_of_fixed_frames() -> None:
    for kind in (SVD, VISTA):
        unet = make_empty("unet", configs(kind)["unet"], kind)
        assert isinstance(unet, VideoUNet)
        assert (unet.cond_time_embedding is not None) == (kind is VISTA)
