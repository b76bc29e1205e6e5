"""The networks of the golden numbers."""

from typing import Any

import torch
from torch import Tensor, nn

from dreamdrive.prior.vista.configs import config_of
from dreamdrive.prior.vista.keys import UNET, Part, recipes_of
from dreamdrive.prior.vista.kinds import VISTA
from dreamdrive.prior.vista.networks import VideoUNet, make_empty
from tests.golden import reading

_STATE = "vista/tiny_unet_state_fp16.safetensors"


def unet_config() -> dict[str, Any]:
    """Arguments of the authors' UNet."""
    return reading.values("vista/tiny_unet_config.json")


def build(part: Part, state: dict[str, Tensor], head: int = 64) -> Any:
    """A part from tensors by their official keys.

    Args:
        part: Which.
        state: The tensors.
        head: Width of an attention head in the UNet.
    """
    recipes = recipes_of(state)
    assert not recipes.unknown
    shapes = recipes.shapes(part, {key: tuple(value.shape) for key, value in state.items()})
    network = make_empty(part, config_of(part, shapes, head), VISTA)
    made = {name: recipe.make(state.__getitem__) for name, recipe in recipes.parts[part].items()}
    network.load_state_dict(made, assign=True)
    return network.eval().requires_grad_(False)


def golden_unet(*, actions: bool = True) -> VideoUNet:
    """The UNet, with or without the weights of actions."""
    state = {UNET + key: value.float() for key, value in reading.tensors(_STATE).items()}
    if reading.is_cut():
        shapes = reading.values("vista/tiny_unet_left_out.json")
        state |= {UNET + key: torch.zeros(shape) for key, shape in shapes.items()}
    kept = {k: v for k, v in state.items() if actions or "action_control" not in k}
    return build("unet", kept, unet_config()["num_head_channels"])


class Given(nn.Module):
    """Stands in for the encoding of frame rate, motion and noise: the golden vectors are random."""

    def __init__(self, vector: Tensor) -> None:
        super().__init__()
        self.vector = vector

    def forward(self, ids: Tensor) -> Tensor:
        return self.vector.expand(len(ids) // 3, -1)
