"""Reading the folder of weights, and what is refused."""

import pickle
from pathlib import Path
from typing import Any

import pytest
import torch
from diffusers.models.unets.unet_2d_condition import UNet2DConditionModel
from safetensors.torch import load_file, save_file

from dreamdrive.errors import InputError
from dreamdrive.prior.magicdrive import folder as weights
from dreamdrive.prior.magicdrive.folder import MagicDriveNetworks, read_parts
from dreamdrive.prior.magicdrive.networks import plain_settings
from tests.prior.magicdrive.tiny import WORDS, Written, write_folder

CPU = torch.device("cpu")


def read(folder: Written, temporal: bool = False) -> MagicDriveNetworks:
    return read_parts(folder.path, temporal=temporal)


def refused(folder: Written, message: str, temporal: bool = False) -> None:
    with pytest.raises(InputError, match=message) as caught:
        read(folder, temporal)
    assert "\n" not in str(caught.value)


def test_all_parts_are_loaded_as_they_are_stored(folder: Written) -> None:
    parts = read(folder)
    for name, network in (("unet", parts.unet), ("controlnet", parts.controlnet), ("vae", parts.vae)):
        stored = load_file(folder.weights(name))
        assert stored.keys() == network.state_dict().keys()
        assert all(torch.equal(stored[key], value) for key, value in network.state_dict().items())
        assert not any(p.requires_grad for p in network.parameters())
    assert parts.latent_shape == (4, 6, 11)
    assert (parts.settings.frames, parts.settings.views) == (1, 6)
    words = parts.words("Rain")
    assert words.shape == (1, WORDS, 48)
    assert not torch.equal(words, parts.words(""))
    assert torch.equal(words[:, 0], parts.words("")[:, 0])  # the token that starts every text


def test_torch_files_of_older_versions_are_read(folder: Written) -> None:
    """``.bin`` files, and the autoencoder's former names."""
    before = read(folder)
    for part in ("unet", "controlnet", "vae"):
        file = folder.weights(part)
        state = load_file(file)
        if part == "vae":
            for new, old in {
                "to_q": "query",
                "to_k": "key",
                "to_v": "value",
                "to_out.0": "proj_attn",
            }.items():
                state = {key.replace(f".{new}.", f".{old}."): value for key, value in state.items()}
        torch.save(state, file.with_suffix(".bin"))
        file.unlink()
    after = read(folder)
    for part in ("unet", "controlnet", "vae"):
        wanted = getattr(before, part).state_dict()
        assert all(torch.equal(wanted[k], v) for k, v in getattr(after, part).state_dict().items())


def test_missing_parts_are_named_together(folder: Written) -> None:
    (folder.path / "tokenizer" / "merges.txt").unlink()
    (folder.path / "scheduler" / "scheduler_config.json").unlink()
    folder.weights("controlnet").unlink()
    refused(
        folder,
        "lacks controlnet/diffusion_pytorch_model.safetensors, tokenizer/merges.txt, "
        "scheduler/scheduler_config.json; expected a folder with unet/",
    )


def test_plain_stable_diffusion_is_told_apart(folder: Written) -> None:
    """By its table; and by its tensors, where only these were put in."""
    plain = UNet2DConditionModel(**plain_settings(UNet2DConditionModel, folder.unet))
    save_file(plain.state_dict(), folder.weights("unet"))
    refused(folder, r"unet/.* does not fit \(99 missing: .*attn4.*; expected a folder with unet/")
    folder.rewrite("unet", neighboring_view_pair="gone")
    refused(folder, "has no neighboring_view_pair: this is plain Stable Diffusion")


def test_a_plain_controlnet_is_told_apart(folder: Written) -> None:
    folder.rewrite("controlnet", bbox_embedder_param="gone")
    refused(folder, "has no bbox_embedder_param: this is plain Stable Diffusion")


def test_damaged_files_are_refused(folder: Written) -> None:
    file = folder.weights("unet")
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 2])
    refused(folder, r"unet/diffusion_pytorch_model\.safetensors is missing or damaged")
    file.write_bytes(whole)
    (folder.path / "vae" / "config.json").write_text("{")
    refused(folder, r"vae/config\.json is not JSON")


def test_missing_tensors_are_named(folder: Written) -> None:
    folder.change("controlnet", **{"cam2token.weight": "", "uncond_cam.weight": "other"})
    refused(folder, r"2 missing: cam2token\.weight, uncond_cam\.weight; 1 unknown: other")


def test_pickled_objects_are_not_executed(folder: Written) -> None:
    file = folder.weights("unet")
    file.unlink()
    file.with_suffix(".bin").write_bytes(pickle.dumps({"a": Path("/")}))
    refused(folder, "cannot be read as plain weights")


def test_the_variant_has_to_be_the_one_asked_for(folder: Written, tmp_path: Path) -> None:
    refused(folder, "single time steps .* take --prior magicdrive$", temporal=True)
    together = write_folder(tmp_path / "temporal", temporal=True)
    refused(together, "temporal variant, 16 frames; take --prior magicdrive-t")
    assert read(together, temporal=True).settings.frames == 16
    together.rewrite("unet", video_length=7)
    refused(together, "video_length is 7; _s_ff_t_last needs at least 13", temporal=True)


@pytest.mark.parametrize(
    ("part", "change", "message"),
    [
        ("unet", {"neighboring_attn_type": "concat"}, "neighboring_attn_type is 'concat'; .* only 'add'"),
        ("unet", {"img_size": None}, "not one of MagicDrive"),
        ("unet", {"img_size": [24, 52]}, "latents are 13x6, but controlnet/ brings the map to 11x6"),
        ("unet", {"img_size": [32, 44]}, "^unet/config.json: img_size 32x44 is taller than 9/16"),
        ("unet", {"neighboring_view_pair": {"0": [1], "1": [0]}}, "^unet/.* expected a ring of 6 cameras"),
        ("controlnet", {"map_embedder_cls": None, "map_size": [26, 200, 200]}, "only square maps of the 8"),
        (
            "controlnet",
            {"cam_embedder_param": "gone"},
            "not one of MagicDrive .KeyError: 'cam_embedder_param'",
        ),
        ("unet", {"down_block_types": ["Other"] * 2}, "unet/config.json builds no network"),
        ("unet", {"layers_per_block": 1}, r"builds no block down_blocks\.1\.attentions\.1, whose activ"),
        ("controlnet", {"use_uncond_map": "learnable"}, "use_uncond_map is 'learnable'"),
        ("controlnet", {"map_embedder_cls": "mine.Own"}, "map_embedder_cls mine.Own is not built"),
        ("text_encoder", {"hidden_size": 32}, "text_encoder/ is 32 wide, unet/ and controlnet/ take 48"),
    ],
)
def test_other_variants_are_refused(folder: Written, part: str, change: dict[str, Any], message: str) -> None:
    folder.rewrite(part, **change)
    refused(folder, message)


def test_another_tokenizer_is_refused(folder: Written) -> None:
    (folder.path / "tokenizer" / "vocab.json").write_text("[]")
    refused(folder, "no tokenizer of CLIP")


def test_what_does_not_fit_into_memory_is_refused_before_loading(
    folder: Written, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(weights, "free_bytes", lambda device: 1_000_000)
    folder.weights("unet").write_bytes(b"never read")
    refused(folder, r"needs about 1\.\d GB with these weights, and this machine has 0\.0 GB free")
