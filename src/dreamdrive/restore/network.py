"""The network that mends a view: it says of each pixel where its colour is copied from."""

from pathlib import Path

import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive import _native
from dreamdrive.compute.device import in_core
from dreamdrive.errors import InputError
from dreamdrive.models import HalfUNet, fill_network, read_state

FRAMES = 2
"""Recorded frames that are carried over to a view."""
OF_VIEW, OF_FRAME = 8, 4
CHANNELS = OF_VIEW + FRAMES * OF_FRAME
"""Of the view its RGB, alpha, inverse depth, share of what moves, error of what it shows in the recorded
views and how little they saw of it; of each recorded frame its RGB and how well it shows the same surface."""
MOVES, ERROR, UNSEEN = 5, 6, 7
"""Where three of the view are: what moves, how far off it is, how little it was seen."""
FIRST_PLANES = range(OF_VIEW, CHANNELS, OF_FRAME)
"""Where each recorded frame begins in these."""
WIDTHS = (16, 48, 96, 192)
EXPECTED = "weights of the restorer, as `dreamdrive train restorer` writes them"
_AROUND = tuple((dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1))
_BESIDE = tuple((0, dx) for dx in (-3, -2, 2, 3))
_TAPS = ((0, 0),), *[_AROUND + _BESIDE] * FRAMES
"""Rows and columns away from a pixel that it may be copied from: of the view, and of each recorded frame.

What is seen from aside and at a wrong depth lies too far left or right.
"""
_PLACES = [(k, shift) for k, shifts in enumerate(_TAPS) for shift in shifts]
"""The same, one by one, each with the number of its picture."""
_DETAIL = _AROUND[:4] + _AROUND[5:] + ((-2, 0), (0, -2), (0, 2), (2, 0))
"""Those in the view whose difference from a pixel is added to it or taken away: it sharpens or smooths."""
_MOST_DETAIL = 0.5
_MOST_PX = 3
_LEAST = 0.02
"""Share of a frame that surely shows something else."""
_FIRM = 4.0
"""Logit of the view's own pixel in an untrained network."""


class RestorerNetwork(HalfUNet):
    """Its answer is how much of each place in the view and in the recorded frames goes into a pixel.

    These shares add up to 1, and what sharpens the view adds 0 to one colour, so that it copies and cannot
    invent: no colour passes through its layers.
    """

    def __init__(self, widths: tuple[int, ...] = WIDTHS) -> None:
        super().__init__(CHANNELS, len(_PLACES) + len(_DETAIL), widths)

    def forward(self, told: Float[Tensor, "n 16 h w"]) -> Float[Tensor, "n 3 h w"]:
        """The mended view in RGB; sides are multiples of 2.

        Who learns has the gradients of torch; where none are wanted on the CPU, the compiled core mixes.
        """
        answer, _ = self.answered(told)
        wide = _wide(told)
        if torch.is_grad_enabled() or not in_core(told):
            return _mixed(answer, wide)
        return torch.stack([_mixed_in_core(*each) for each in zip(answer, wide, strict=True)])


def _wide(told: Float[Tensor, "n 16 h w"]) -> Float[Tensor, "n p 4 h2 w2"]:
    """The view and the carried frames, RGB and how sure each is (0, 1], with a border."""
    planes = [told[:, :3], torch.ones_like(told[:, :1])]
    for first in FIRST_PLANES:
        planes += [told[:, first : first + 3], told[:, first + 3 : first + 4] + _LEAST]
    wide = torch.nn.functional.pad(torch.cat(planes, dim=1), [_MOST_PX] * 4, mode="replicate")
    return wide.unflatten(1, (-1, 4))


def _mixed(answer: Float[Tensor, "n k h w"], wide: Float[Tensor, "n p 4 h2 w2"]) -> Float[Tensor, "n 3 h w"]:
    """Pixels as the network's answer mixes them from the pictures of ``_wide``."""
    logits, signed = answer.split([len(_PLACES), len(_DETAIL)], dim=1)
    # Gently, or the first steps drive it to its ends, where it learns no more.
    detail = _MOST_DETAIL * torch.tanh(signed / _FIRM)
    there = [_shifted(wide[:, k], shift) for k, shift in _PLACES]
    own = torch.zeros(len(_PLACES), 1, 1, device=answer.device)
    own[0] = _FIRM
    known = torch.cat([each[:, 3:] for each in there], dim=1).log()
    shares = torch.softmax(logits + known + own, dim=1)
    said = torch.zeros_like(there[0][:, :3])
    for number, each in enumerate(there):
        said = said + shares[:, number : number + 1] * each[:, :3]
    for number, shift in enumerate(_DETAIL):
        said = said + detail[:, number : number + 1] * (_shifted(wide[:, 0], shift) - there[0])[:, :3]
    return said


def _mixed_in_core(
    answer: Float[Tensor, "k h w"], wide: Float[Tensor, "p 4 h2 w2"]
) -> Float[Tensor, "3 h w"]:
    said = answer.new_empty(3, *answer.shape[1:])
    taps = torch.tensor([(k, *shift) for k, shift in _PLACES], dtype=torch.int32)
    details = torch.tensor(_DETAIL, dtype=torch.int32)
    _native.mix(answer.contiguous(), wide.contiguous(), taps, details, _FIRM, _MOST_DETAIL, _FIRM, said)
    return said


def _shifted(wide: Float[Tensor, "n c h2 w2"], shift: tuple[int, int]) -> Float[Tensor, "n c h w"]:
    """What lies so many rows and columns away, of a padded picture."""
    height, width = (size - 2 * _MOST_PX for size in wide.shape[2:])
    top, left = (_MOST_PX + each for each in shift)
    return wide[..., top : top + height, left : left + width]


def load_restorer(path: Path) -> RestorerNetwork:
    """The network with the weights that ``dreamdrive train restorer`` wrote to a file.

    Raises:
        InputError: There is no such file, or it is of something else.
    """
    if not path.is_file():
        raise InputError(f"{path}: there is no such file; expected {EXPECTED}")
    return fill_network(RestorerNetwork, read_state(path, EXPECTED), str(path), EXPECTED)
