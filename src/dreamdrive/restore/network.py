"""The network that mends a view: it takes colours over from recorded frames, and adds a little of its own."""

from pathlib import Path

import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.models import HalfUNet, fill_network, read_state

FRAMES = 2
"""Recorded frames that are carried over to a view."""
OF_VIEW, OF_FRAME = 8, 4
CHANNELS = OF_VIEW + FRAMES * OF_FRAME
"""Of the view its RGB, alpha, inverse depth, share of what moves, error of what it shows in the recorded
views and how little they saw of it; of each recorded frame its RGB and how well it shows the same surface."""
WIDTHS = (24, 48, 96, 192)
EXPECTED = "weights of the restorer, as `dreamdrive train restorer` writes them"
_FILE = Path(__file__).with_name("restorer.safetensors")
_SHY = -2.0  # an untrained network takes little over


class RestorerNetwork(HalfUNet):
    """Its answer is what to add to the view's colours, and how much of each recorded frame to take instead.

    What it takes over it copies pixel by pixel: no detail passes through its layers.
    """

    def __init__(self, widths: tuple[int, ...] = WIDTHS) -> None:
        super().__init__(CHANNELS, 3 + FRAMES, widths)

    def forward(self, told: Float[Tensor, "n 16 h w"]) -> Float[Tensor, "n 3 h w"]:
        """The mended view, RGB about [0, 1]; sides are multiples of 2."""
        answer, _ = self.answered(told)
        said = told[:, :3] + answer[:, :3]
        for frame in range(FRAMES):
            first = OF_VIEW + frame * OF_FRAME
            share = torch.sigmoid(answer[:, 3 + frame : 4 + frame] + _SHY) * told[:, first + 3 : first + 4]
            said = said + share * (told[:, first : first + 3] - told[:, :3])
        return said


def load_restorer(path: Path = _FILE) -> RestorerNetwork:
    """The network with the weights that ship, or those that ``dreamdrive train restorer`` wrote to a file.

    Raises:
        InputError: There is no such file, or it is of something else.
    """
    if not path.is_file():
        raise InputError(f"{path}: there is no such file; expected {EXPECTED}")
    return fill_network(RestorerNetwork, read_state(path, EXPECTED), str(path), EXPECTED)
