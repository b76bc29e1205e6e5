"""From the official file to a folder."""

import gc
import json
import weakref
from pathlib import Path

import pytest
import torch
from diffusers import AutoencoderKLTemporalDecoder
from safetensors.torch import load_file, save_file
from torch import Tensor
from transformers import CLIPVisionModelWithProjection

from dreamdrive.errors import InputError
from dreamdrive.prior.vista.convert import convert, write_tensors
from dreamdrive.prior.vista.keys import PARTS
from dreamdrive.prior.vista.kinds import SVD, VISTA
from dreamdrive.prior.vista.stored import FILES, NOTE, open_weights
from tests.prior.vista.tiny import official, save_official, states


def test_the_folder_holds_the_model(tmp_path: Path, vista_file: Path) -> None:
    told: list[tuple[int, int]] = []
    made = convert(vista_file, tmp_path / "model", progress=lambda done, total: told.append((done, total)))
    assert made.ignored.keys() == {"the text half of CLIP", "a second encoder"}
    assert not made.notes
    assert told[-1][0] == told[-1][1] == len(told)
    again = open_weights(tmp_path / "model", VISTA)
    for part, state in states(VISTA).items():
        file = load_file(tmp_path / "model" / part / FILES[part][0])
        dtype = torch.float32 if part == "vae" else torch.float16
        assert file.keys() == state.keys() == again.parts[part].shapes.keys()
        assert all(torch.equal(file[name], value.to(dtype)) for name, value in state.items())
    note = json.loads((tmp_path / "model" / NOTE).read_text())
    assert note == {"kind": "vista", "dtype": "float16", "from": "vista.safetensors", "notes": []}


def test_diffusers_and_transformers_read_it(tmp_path: Path) -> None:
    convert(save_official(tmp_path / "svd.safetensors", SVD), tmp_path / "model", "float32")
    vae = AutoencoderKLTemporalDecoder.from_pretrained(tmp_path / "model" / "vae", low_cpu_mem_usage=True)
    clip = CLIPVisionModelWithProjection.from_pretrained(tmp_path / "model" / "image_encoder")
    for part, network in (("vae", vae), ("image_encoder", clip)):
        expected = states(SVD)[part]  # type: ignore[index]
        assert all(torch.equal(value, expected[name]) for name, value in network.state_dict().items())


def test_one_tensor_is_held_at_a_time(tmp_path: Path, vista_file: Path) -> None:
    stored = open_weights(vista_file)
    alive: weakref.WeakSet[Tensor] = weakref.WeakSet()
    most = 0

    for part in PARTS:
        own = stored.parts[part]

        def read(name: str, read: object = own.read) -> Tensor:
            nonlocal most
            gc.collect(0)
            value = read(name)  # type: ignore[operator]
            alive.add(value)
            most = max(most, len(alive))
            return value

        names = dict(list(own.shapes.items())[:20])
        write_tensors(tmp_path / f"{part}.safetensors", names, read, "float16")
    assert 1 <= most <= 2


def test_nothing_is_left_of_a_failure(tmp_path: Path, vista_file: Path) -> None:
    state = {key: value.contiguous() for key, value in official(VISTA).items()}
    state["model.diffusion_model.out.2.bias"] = torch.tensor([1e6, 0, 0, 0])
    save_file(state, tmp_path / "large.safetensors")
    with pytest.raises(InputError, match=r"conv_out.bias holds numbers that are not finite in float16"):
        convert(tmp_path / "large.safetensors", tmp_path / "model")
    assert [path.name for path in tmp_path.iterdir()] == ["large.safetensors"]
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("keep")
    with pytest.raises(InputError, match="holds other files"):
        convert(vista_file, tmp_path / "mine")
    (tmp_path / "mine" / "unet").mkdir()
    with pytest.raises(InputError, match="diffusers' layout already"):
        convert(tmp_path / "mine", tmp_path / "model")
