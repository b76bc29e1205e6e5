"""Whether the two image encoders of an official single file are one.

The file holds an encoder that tells the network of the first frame, with a 1x1 convolution Q behind it, and
one that encodes known frames, without. Here the first one does both. That is the same where all their tensors
are, but the last convolution: there Q has to be contained in the second one.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import torch
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.files.json_file import read_json
from dreamdrive.prior.vista.stored import NOTE, Stored, open_tensors

FIRST, QUANT = "conditioner.embedders.3.encoder.encoder.", "conditioner.embedders.3.encoder.quant_conv."
SECOND = "first_stage_model.encoder."
_LAST = ("conv_out.weight", "conv_out.bias")
_SAME = 1e-3  # of a tensor's largest number: the rounding of half precision


def notes_of(stored: Stored) -> list[str]:
    """What has to be said of a model's encoders, a sentence each: nothing where one does the work of both."""
    if stored.path.is_dir():
        note = stored.path / NOTE
        said = read_json(note, "--weights").get("notes") if note.is_file() else None
        return [str(each) for each in cast("list[Any]", said)] if isinstance(said, list) else []
    difference = encoder_difference(stored.path)
    if difference is None or difference <= _SAME:
        return []
    return [
        f"The two image encoders of {stored.path.name} differ, by up to {difference:.1%} of a tensor's "
        "largest number; the one of the first frame encodes known frames, too, which is not what the model "
        "was trained with."
    ]


def encoder_difference(path: Path) -> float | None:
    """How far the encoders of a single file are apart: the largest difference over a tensor's largest number.

    None where there is no second encoder.
    """
    shapes, read = open_tensors(path)
    names = {
        prefix: {key.removeprefix(prefix) for key in shapes if key.startswith(prefix)}
        for prefix in (FIRST, SECOND)
    }
    if not names[SECOND]:
        return None
    other = names[FIRST] ^ names[SECOND]
    other |= {n for n in names[FIRST] & names[SECOND] if shapes[FIRST + n] != shapes[SECOND + n]}
    if other or not names[FIRST].issuperset(_LAST):
        raise InputError(
            f"{path}: its two image encoders are of different forms ({min(other or _LAST)}); expected "
            "two of one form: copy the file again"
        )
    apart = [
        _apart(read(FIRST + name).float(), read(SECOND + name).float())
        for name in sorted(names[FIRST].difference(_LAST))
    ]
    last = [read(SECOND + name).float() for name in _LAST]
    apart += [_apart(mine, theirs) for mine, theirs in zip(_with_quant(read), last, strict=True)]
    return max(apart)


def _with_quant(read: Callable[[str], Tensor]) -> tuple[Tensor, Tensor]:
    """Weights and bias of the first encoder's last convolution with Q behind it, as one."""
    weight, bias = (read(FIRST + name).float() for name in _LAST)
    quant = read(f"{QUANT}weight").float()[..., 0, 0]
    return torch.einsum("oc,cikl->oikl", quant, weight), quant @ bias + read(f"{QUANT}bias").float()


def _apart(first: Tensor, second: Tensor) -> float:
    return float((first - second).abs().max() / first.abs().max().clamp(min=1e-12))
