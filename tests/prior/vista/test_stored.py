"""Weights on disk are checked before they are read."""

import json
import shutil
from pathlib import Path

import pytest
import torch
from safetensors.torch import save_file
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.prior.vista.keys import PARTS
from dreamdrive.prior.vista.kinds import SVD, VISTA
from dreamdrive.prior.vista.stored import NOTE, open_weights
from tests.prior.vista.tiny import official, save_official


@pytest.fixture(scope="module")
def whole() -> dict[str, Tensor]:
    return {key: value.contiguous() for key, value in official(VISTA).items()}


def save(path: Path, state: dict[str, Tensor]) -> Path:
    save_file(state, path)
    return path


def test_file_and_folder_hold_the_same(vista_file: Path, vista_dir: Path) -> None:
    file, folder = open_weights(vista_file, VISTA), open_weights(vista_dir, VISTA)
    assert open_weights(vista_file.parent).path == vista_file
    for part in PARTS:
        assert file.parts[part].shapes == folder.parts[part].shapes
        name = next(iter(file.parts[part].shapes))
        assert torch.equal(file.parts[part].read(name), folder.parts[part].read(name))
    second = [key for key in file.ignored if key.startswith("first_stage_model.encoder.")]
    assert len(file.ignored) == len(second) + 1


@pytest.mark.parametrize(
    ("begins", "named"),
    [
        ("model.diffusion_model.output_blocks.", "the UNet does not fit"),
        ("first_stage_model.decoder.", "the VAE does not fit"),
        ("conditioner.embedders.3.", "the VAE lacks"),
        ("conditioner.embedders.0.open_clip.model.visual.", "the image encoder is missing altogether"),
        ("conditioner.embedders.0.open_clip.model.visual.ln_post", "the image encoder does not fit"),
        ("model.diffusion_model.cond_time_stack_embed.", "the UNet's second time embedding"),
        ("model.diffusion_model.", "the UNet is missing altogether"),
    ],
)
def test_a_missing_part_is_named(tmp_path: Path, whole: dict[str, Tensor], begins: str, named: str) -> None:
    rest = {key: value for key, value in whole.items() if not key.startswith(begins)}
    if begins == "model.diffusion_model.":
        rest = {key: value for key, value in rest.items() if "action_control" not in key}
    with pytest.raises(InputError, match=named):
        open_weights(save(tmp_path / "part.safetensors", rest))


def test_missing_action_adapters_are_named(tmp_path: Path, whole: dict[str, Tensor]) -> None:
    none = {key: value for key, value in whole.items() if "action_control" not in key}
    with pytest.raises(InputError, match="the action adapters"):
        open_weights(save(tmp_path / "none.safetensors", none))
    some = {key: v for key, v in whole.items() if not ("action_control" in key and "output_blocks" in key)}
    with pytest.raises(InputError, match="the set of action adapters does not fit"):
        open_weights(save(tmp_path / "some.safetensors", some))


def test_the_other_model_is_recognised(tmp_path: Path, vista_file: Path) -> None:
    svd = save_official(tmp_path / "svd.safetensors", SVD)
    assert open_weights(svd).kind is SVD
    with pytest.raises(InputError, match="holds Stable Video Diffusion, not Vista: use --prior svd"):
        open_weights(svd, VISTA)
    with pytest.raises(InputError, match="holds Vista, not Stable Video Diffusion: use --prior vista"):
        open_weights(vista_file, SVD)


def test_wrong_and_damaged_files_are_refused(tmp_path: Path, vista_file: Path, vista_dir: Path) -> None:
    cut = tmp_path / "cut.safetensors"
    cut.write_bytes(vista_file.read_bytes()[:-100])
    with pytest.raises(InputError, match="is cut short"):
        open_weights(cut)
    cut.write_text("no weights")
    with pytest.raises(InputError, match=r"is no \.safetensors"):
        open_weights(cut)
    with pytest.raises(InputError, match=r"unknown tensors: layer\.weight"):
        open_weights(save(cut, {"layer.weight": torch.zeros(2)}))
    with pytest.raises(InputError, match="does not exist"):
        open_weights(tmp_path / "none.safetensors")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="holds no unet/ and 0 files"):
        open_weights(tmp_path / "empty")
    folder = tmp_path / "folder"
    shutil.copytree(vista_dir, folder)
    config = folder / "vae" / "config.json"
    for text, said in (
        ("{", "is not JSON"),
        ("[]", "expected a JSON object"),
        ('{"size": 3}', "does not tell block_out_channels"),
        ('{"block_out_channels": [32, 32, 32, 32], "down_block_types": ["None"]}', "is of no use"),
        (
            '{"block_out_channels": [320, 320, 320, 320]}',
            r"config\.json of the VAE states block_out_channels \[320, 320, 320, 320\], the tensors have "
            r"\[32, 32, 32, 32\]; take both from one model",
        ),
        ('{"block_out_channels": [32, 10000000]}', "block_out_channels is 10000000; expected at most 65536"),
        (
            '{"block_out_channels": [32, 32], "layers_per_block": 9999}',
            "layers_per_block is 9999; expected at most 1000",
        ),
    ):
        config.write_text(text)
        with pytest.raises(InputError, match=said):
            open_weights(folder)
    config.unlink()
    with pytest.raises(InputError, match=r"lacks config\.json"):
        open_weights(folder)


def test_a_context_of_another_width_is_refused(tmp_path: Path, svd_dir: Path) -> None:
    folder = tmp_path / "folder"
    shutil.copytree(svd_dir, folder)
    (folder / NOTE).write_text(json.dumps({"kind": "vista"}))
    with pytest.raises(InputError, match="the UNet does not fit"):
        open_weights(folder)
