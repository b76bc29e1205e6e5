"""Conversion of an official single file to a folder in diffusers' layout, a tensor at a time."""

import json
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.files.output import new_folder
from dreamdrive.names import DtypeName
from dreamdrive.prior.running import counted
from dreamdrive.prior.vista.configs import Shapes
from dreamdrive.prior.vista.keys import IGNORED, PARTS, Part
from dreamdrive.prior.vista.stored import FILES, NOTE, StoredModel, notes_of, open_weights
from dreamdrive.progress import Progress, silent

_DTYPES = {"float16": (torch.float16, "F16"), "float32": (torch.float32, "F32")}
_CLASSES: dict[Part, dict[str, str]] = {
    "unet": {"_class_name": "UNetSpatioTemporalConditionModel"},
    "vae": {"_class_name": "AutoencoderKLTemporalDecoder"},
    "image_encoder": {"model_type": "clip_vision_model"},
}


@dataclass(frozen=True)
class Converted:
    """What was made of which file; how many tensors were left out, by what they are; what to say of it."""

    stored: StoredModel
    ignored: dict[str, int]
    notes: list[str]


def convert(
    file: Path,
    folder: Path,
    dtype: DtypeName = "float16",
    *,
    replace: bool = False,
    progress: Progress = silent,
) -> Converted:
    """Write ``unet``, ``vae``, ``image_encoder``, and ``prior.json``, which says which kind, of a file.

    The folder appears whole or not at all, and one tensor at a time is in memory. LoRA that is not merged yet
    is merged. ``dtype`` is that of UNet and image encoder; the autoencoder needs float32.
    """
    if file.is_dir() and (file / "unet").is_dir():
        raise InputError(f"{file} has diffusers' layout already; --weights takes it as it is")
    stored = open_weights(file)
    notes = notes_of(stored)
    tell = counted(progress, sum(len(stored.parts[part].shapes) for part in PARTS))
    with new_folder(folder, replace=replace, kind="folder of converted weights") as partial:
        for part in PARTS:
            own = stored.parts[part]
            (partial / part).mkdir()
            config = json.dumps(_CLASSES[part] | own.config, indent=1)
            (partial / part / "config.json").write_text(config + "\n")
            stored_as = "float32" if part == "vae" else dtype
            write_tensors(partial / part / FILES[part][0], own.shapes, own.read, stored_as, tell)
        note = {"kind": stored.kind.name, "dtype": dtype, "from": stored.path.name, "notes": notes}
        (partial / NOTE).write_text(json.dumps(note, indent=1) + "\n")
    ignored = {
        what: sum(bool(pattern.match(key)) for key in stored.ignored) for what, pattern in IGNORED.items()
    }
    return Converted(stored, {what: count for what, count in ignored.items() if count}, notes)


def write_tensors(
    path: Path,
    shapes: Shapes,
    read: Callable[[str], Tensor],
    dtype: DtypeName,
    tell: Callable[[], None] = lambda: None,
) -> None:
    """Write a ``.safetensors``: length and text of the header, then the numbers, as each tensor is read.

    The library's own writer wants all tensors at once. ``tell`` is called after each.
    """
    kind, code = _DTYPES[dtype]
    header: dict[str, Any] = {"__metadata__": {"format": "pt"}}
    end = 0
    for name, shape in shapes.items():
        begin, end = end, end + kind.itemsize * torch.Size(shape).numel()
        header[name] = {"dtype": code, "shape": list(shape), "data_offsets": [begin, end]}
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    with path.open("wb") as file:
        file.write(struct.pack("<Q", len(text)) + text)
        for name in shapes:
            value = read(name).to(kind).contiguous()
            if not bool(torch.isfinite(value).all()):
                raise InputError(f"{name} holds numbers that are not finite in {dtype}; try --dtype float32")
            file.write(value.numpy().tobytes())
            tell()
