"""The networks of the golden numbers."""

from typing import Any

from tests.prior.vista.conftest import Golden
from torch import Tensor, nn

from dreamdrive.prior.vista.configs import config_of
from dreamdrive.prior.vista.keys import UNET, Part, recipes_of
from dreamdrive.prior.vista.kinds import VISTA
from dreamdrive.prior.vista.networks import make_empty
from dreamdrive.prior.vista.unet import VideoUNet

HEAD = 16
"""Width of a head in the golden UNet."""


def build(part: Part, state: dict[str, Tensor]) -> Any:
    """A part from tensors by their official keys."""
    recipes = recipes_of(state)
    assert not recipes.unknown
    shapes = recipes.shapes(part, {key: tuple(value.shape) for key, value in state.items()})
    network = make_empty(part, config_of(part, shapes, HEAD), VISTA)
    made = {name: recipe.make(state.__getitem__) for name, recipe in recipes.parts[part].items()}
    network.load_state_dict(made, assign=True)
    return network.eval().requires_grad_(False)


def golden_unet(golden: Golden, *, actions: bool = True) -> VideoUNet:
    state = {UNET + key: value.float() for key, value in golden.tensors("tiny_unet_state_fp16").items()}
    return build("unet", {k: v for k, v in state.items() if actions or "action_control" not in k})


class Given(nn.Module):
    """Stands in for the encoding of frame rate, motion and noise: the golden vectors are random."""

    def __init__(self, vector: Tensor) -> None:
        super().__init__()
        self.vector = vector

    def forward(self, ids: Tensor) -> Tensor:
        return self.vector.expand(len(ids) // 3, -1)
