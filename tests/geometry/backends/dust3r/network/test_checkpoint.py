"""A network comes back from every form of file, and what is wrong with a file is said."""

import argparse
import json
import os
from collections import OrderedDict
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch
from safetensors.torch import save_file
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.dust3r.network.checkpoint import load_dust3r
from dreamdrive.geometry.backends.dust3r.network.dust3r import Dust3r
from tests.geometry.backends.dust3r.network.networks import TINY, tiny

ALIAS = ".scratch.layer_rn."


def call(network: Dust3r, **changes: object) -> str:
    config = network.config
    values: dict[str, object] = {
        "pos_embed": "RoPE100",
        "img_size": (512, 512),
        "head_type": config.head,
        "enc_embed_dim": config.enc_dim,
        "enc_depth": config.enc_depth,
        "enc_num_heads": config.enc_heads,
        "dec_embed_dim": config.dec_dim,
        "dec_depth": config.dec_depth,
        "dec_num_heads": config.dec_heads,
    } | changes
    words = [f"{key}={value!r}" for key, value in values.items()]
    modes = "depth_mode=('exp', -inf, inf), conf_mode=('exp', 1, inf)"
    return f"AsymmetricCroCo3DStereo({', '.join(words)}, {modes})"


def save_pth(path: Path, network: Dust3r, state: dict[str, Tensor] | None = None, **changes: object) -> Path:
    args = argparse.Namespace(model=call(network, **changes), lr=1e-4, output_dir="out")
    model = network.state_dict() if state is None else OrderedDict(state)
    torch.save({"args": args, "model": model, "epoch": 3, "best_so_far": 0.1}, path)
    return path


def save_hub(folder: Path, network: Dust3r) -> Path:
    """The hub's form: each tensor once, keywords in JSON."""
    config = network.config
    keywords: dict[str, Any] = {
        "pos_embed": "RoPE100",
        "head_type": config.head,
        "enc_embed_dim": config.enc_dim,
        "enc_depth": config.enc_depth,
        "enc_num_heads": config.enc_heads,
        "dec_embed_dim": config.dec_dim,
        "dec_depth": config.dec_depth,
        "dec_num_heads": config.dec_heads,
        "img_size": [512, 512],
        "conf_mode": ["exp", 1, float("inf")],
    }
    (folder / "config.json").write_text(json.dumps(keywords))
    state = {k: v.contiguous() for k, v in network.state_dict().items() if ALIAS not in k}
    save_file(state, folder / "model.safetensors", {"alias": "kept"})
    return folder


def assert_same(loaded: Dust3r, network: Dust3r) -> None:
    assert loaded.config == network.config
    assert not loaded.training
    values = loaded.state_dict()
    assert values.keys() == network.state_dict().keys()
    for key, value in network.state_dict().items():
        assert torch.equal(values[key], value), key
    assert not any(part.requires_grad or part.is_meta for part in loaded.parameters())


@pytest.mark.parametrize("head", ["dpt", "linear"])
def test_the_authors_form_comes_back(tmp_path: Path, head: str) -> None:
    network = tiny(head=head)
    assert_same(load_dust3r(save_pth(tmp_path / "m.pth", network)), network)


@pytest.mark.parametrize("head", ["dpt", "linear"])
def test_the_hub_form_comes_back(tmp_path: Path, head: str) -> None:
    network = tiny(head=head)
    assert_same(load_dust3r(save_hub(tmp_path, network)), network)
    assert_same(load_dust3r(tmp_path / "model.safetensors"), network)


def test_bfloat16_on_demand(tmp_path: Path) -> None:
    network = load_dust3r(save_pth(tmp_path / "m.pth", tiny()), bfloat16=True)
    assert network.dec_blocks[0].mlp.fc1.weight.dtype == torch.bfloat16


def test_layers_of_two_names_are_one(tmp_path: Path) -> None:
    scratch = load_dust3r(save_hub(tmp_path, tiny())).downstream_head2.dpt.scratch
    assert scratch.layer_rn[2] is scratch.layer3_rn
    assert scratch.layer_rn[2].weight is scratch.layer3_rn.weight


def test_variants_of_the_keys(tmp_path: Path) -> None:
    network = tiny()
    state = network.state_dict()
    only_aliases = {k: v for k, v in state.items() if "_rn.weight" not in k}
    assert len(only_aliases) == len(state) - 8
    unused = {
        "prediction_head.weight": torch.zeros(3),
        "enc_pos_embed": torch.zeros(3),
        "dec_pos_embed": torch.zeros(3),
        "downstream_head1.dpt.act_1_postprocess.0.weight": torch.zeros(3),
    }
    no_mask = {k: v for k, v in state.items() if k != "mask_token"}
    for variant in (only_aliases, state | unused, {f"module.{k}": v for k, v in state.items()}):
        assert_same(load_dust3r(save_pth(tmp_path / "m.pth", network, variant)), network)
    loaded = load_dust3r(save_pth(tmp_path / "m.pth", network, no_mask))
    assert loaded.mask_token.abs().max() == 0


def test_one_decoder_serves_as_both(tmp_path: Path) -> None:
    network = tiny()
    network.dec_blocks2.load_state_dict(network.dec_blocks.state_dict())
    state = {k: v for k, v in network.state_dict().items() if not k.startswith("dec_blocks2")}
    assert_same(load_dust3r(save_pth(tmp_path / "m.pth", network, state)), network)


@pytest.mark.parametrize("wrapped", [True, False])
def test_without_a_statement_the_shapes_are_read(tmp_path: Path, wrapped: bool) -> None:
    network = tiny(enc_dim=64, enc_heads=1, dec_dim=128, dec_heads=2)
    state = network.state_dict()
    torch.save({"model": state} if wrapped else state, tmp_path / "m.pth")
    assert_same(load_dust3r(tmp_path / "m.pth"), network)


def changed(network: Dust3r, **changes: Tensor | None) -> dict[str, Tensor]:
    state = {k: v.clone() for k, v in network.state_dict().items()} | changes
    return {k: v for k, v in state.items() if v is not None}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"enc_norm.bias": None}, r"1 missing: enc_norm\.bias"),
        ({"extra.bias": torch.zeros(1)}, r"1 unknown: extra\.bias"),
        ({f"extra.{i}": torch.zeros(1) for i in range(9)}, r"9 unknown: extra\.0, .*extra\.3, \.\.\."),
        ({"enc_norm.bias": torch.zeros(5)}, r"enc_norm\.bias is \(5,\), not \(32,\)"),
        (
            {"downstream_head1.dpt.scratch.layer_rn.0.weight": torch.zeros(8, 8, 3, 3)},
            "are the same layer, but differ",
        ),
        ({"patch_embed.proj.weight": None}, "is no DUSt3R model"),
        ({"decoder_embed.weight": None}, "is no DUSt3R model"),
    ],
)
def test_other_tensors_are_named(tmp_path: Path, changes: dict[str, Tensor | None], message: str) -> None:
    network = tiny()
    path = save_pth(tmp_path / "m.pth", network, changed(network, **changes))
    with pytest.raises(InputError, match=message):
        load_dust3r(path)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"head_type": "linear"}, "head is stated as 'linear', the tensors have 'dpt'"),
        ({"dec_depth": 8}, "dec_depth is stated as 8, the tensors have 4"),
        ({"enc_depth": 10**9}, "enc_depth is stated as 1000000000"),
        ({"output_mode": "pts3d+desc24"}, "output_mode"),
    ],
)
def test_a_statement_that_does_not_fit_is_named(
    tmp_path: Path, changes: dict[str, object], message: str
) -> None:
    path = save_pth(tmp_path / "m.pth", tiny(), **changes)
    with pytest.raises(InputError, match=message):
        load_dust3r(path)


def test_files_that_are_not_there(tmp_path: Path) -> None:
    for path in (tmp_path / "m.pth", tmp_path / "m.safetensors", tmp_path):
        with pytest.raises(InputError, match=r"does not exist.*expected a DUSt3R model"):
            load_dust3r(path)
    (save_hub(tmp_path, tiny()) / "config.json").unlink()
    with pytest.raises(InputError, match=r"config\.json does not exist"):
        load_dust3r(tmp_path)


def test_damaged_files(tmp_path: Path) -> None:
    path = save_pth(tmp_path / "m.pth", tiny())
    whole = path.read_bytes()
    for content in (b"", b"no weights", whole[: len(whole) // 2], whole[:-30]):
        path.write_bytes(content)
        with pytest.raises(InputError, match=r"m\.pth cannot be read as plain weights"):
            load_dust3r(path)
    save_hub(tmp_path, tiny())
    tensors = tmp_path / "model.safetensors"
    tensors.write_bytes(tensors.read_bytes()[:-50])
    with pytest.raises(InputError, match=r"model\.safetensors is missing or damaged"):
        load_dust3r(tmp_path)
    (tmp_path / "config.json").write_bytes(b"\xff\xfe{")
    with pytest.raises(InputError, match=r"config\.json cannot be read as text"):
        load_dust3r(tmp_path)


@pytest.mark.parametrize("content", [{}, [], 3, {"model": 3}, {"model": {"a": 3}}, {"a": torch.zeros(2)}])
def test_files_of_something_else(tmp_path: Path, content: object) -> None:
    torch.save(content, tmp_path / "m.pth")
    with pytest.raises(InputError, match=r"holds no table of tensors|is no DUSt3R model"):
        load_dust3r(tmp_path / "m.pth")


class Bomb:
    def __init__(self, path: str) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (self.path,)


def test_nothing_in_a_file_is_executed(tmp_path: Path) -> None:
    args = argparse.Namespace(model=Bomb(str(tmp_path / "made")))
    torch.save({"args": args, "model": tiny().state_dict()}, tmp_path / "m.pth")
    with pytest.raises(InputError, match=r"asks for \w+\.mkdir, which is not executed"):
        load_dust3r(tmp_path / "m.pth")
    assert not (tmp_path / "made").exists()
    text = f"__import__('os').mkdir({str(tmp_path / 'made')!r})"
    torch.save({"args": argparse.Namespace(model=text), "model": tiny().state_dict()}, tmp_path / "m.pth")
    with pytest.raises(InputError, match="is another one"):
        load_dust3r(tmp_path / "m.pth")
    assert not (tmp_path / "made").exists()


def test_stated_heads_need_not_be_those_that_are_guessed(tmp_path: Path) -> None:
    """200 channels do not split into heads of 64, but well into ten of 20."""
    network = Dust3r(replace(TINY, enc_dim=200, enc_heads=10))
    assert load_dust3r(save_pth(tmp_path / "odd.pth", network, img_size=(512, 512))).config.enc_heads == 10
