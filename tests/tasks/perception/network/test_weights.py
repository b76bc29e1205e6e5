import sys
from pathlib import Path
from types import ModuleType

import pytest
import torch
from safetensors.torch import save_file

from dreamdrive.errors import InputError
from dreamdrive.tasks.perception import (
    BevGrid,
    CrossViewTransformer,
    CvtOptions,
    EfficientNetFront,
    ImageSize,
    StreetTrunk,
    load_cvt,
    load_imagenet,
    load_street,
    save_cvt,
)
from tests.tasks.perception.streets import TINY, Stub, tiny_network

SMALLEST = CvtOptions(
    image=ImageSize(32, 64, 0),
    grid=BevGrid(8, 8, 40.0, 40.0),
    classes=("road",),
    trunk_width=0.25,
    dim=8,
    heads=1,
    head_dim=8,
    decoder=(8,),
    head=8,
)


def same(one: torch.nn.Module, other: torch.nn.Module) -> bool:
    a, b = one.state_dict(), other.state_dict()
    return set(a) == set(b) and all(torch.equal(a[key], b[key]) for key in a)


def test_a_file_knows_its_sizes(tmp_path: Path) -> None:
    network = CrossViewTransformer(SMALLEST)
    save_cvt(network, tmp_path / "cvt.safetensors")
    read = load_cvt(tmp_path / "cvt.safetensors")
    assert read.options == SMALLEST
    assert same(read, network)
    assert not read.training


def test_a_backbone_of_the_callers(tmp_path: Path) -> None:
    network = tiny_network()
    save_cvt(network, tmp_path / "cvt.safetensors")
    assert same(load_cvt(tmp_path / "cvt.safetensors", backbone=Stub()), network)


@pytest.mark.parametrize("suffix", [".ckpt", ".safetensors"])
def test_a_released_checkpoint(tmp_path: Path, suffix: str) -> None:
    """Keys have a prefix; a configuration and other things lie beside them."""
    network, path = CrossViewTransformer(SMALLEST), tmp_path / f"model{suffix}"
    state = {f"backbone.{key}": value for key, value in network.state_dict().items()}
    if suffix == ".safetensors":
        save_file(state, path)
    else:
        torch.save({"state_dict": state, "epoch": 3, "hyper_parameters": {"model": "cvt"}}, path)
    assert same(load_cvt(path, SMALLEST), network)


def test_a_checkpoint_with_objects_of_its_configuration(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are read as nothing but tables; no package of theirs is needed."""
    module = ModuleType("omegaconf.dictconfig")
    kind = type("DictConfig", (), {"__module__": module.__name__})
    module.DictConfig = kind  # type: ignore[attr-defined]
    held = kind()
    held.content = {"dim": 128, "inner": kind()}
    network, path = CrossViewTransformer(SMALLEST), tmp_path / "model.ckpt"
    state = {f"backbone.{key}": value for key, value in network.state_dict().items()}
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "omegaconf", ModuleType("omegaconf"))
        patch.setitem(sys.modules, module.__name__, module)
        torch.save({"state_dict": state, "hyper_parameters": held}, path)
    assert same(load_cvt(path, SMALLEST), network)


class Unknown:
    """What no checkpoint of the original holds."""


def test_other_objects_are_refused(tmp_path: Path) -> None:
    torch.save({"state_dict": {}, "hyper_parameters": Unknown()}, tmp_path / "model.ckpt")
    with pytest.raises(InputError, match="cannot be read as plain weights"):
        load_cvt(tmp_path / "model.ckpt")


def test_a_network_of_another_class_is_refused(tmp_path: Path) -> None:
    network = tiny_network(classes=("road",))
    torch.save(network.state_dict(), tmp_path / "road.pt")
    with pytest.raises(InputError, match=r"to_logits.3.weight is \(1, 8, 1, 1\), not \(3, 8, 1, 1\)"):
        load_cvt(tmp_path / "road.pt", TINY, Stub())


@pytest.mark.parametrize("said", ["{", '{"dim": 64, "unknown": 3, "grid": 4}', '{"dim": 9999999}'])
def test_damaged_options_are_refused(tmp_path: Path, said: str) -> None:
    path = tmp_path / "cvt.safetensors"
    save_file(tiny_network().state_dict(), path, {"options": said})
    with pytest.raises(InputError, match=r"options are damaged|expected at most"):
        load_cvt(path)


def test_a_file_that_is_missing_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="missing or damaged"):
        load_cvt(tmp_path / "none.safetensors")


def test_a_trunk_takes_the_weights_of_its_package(tmp_path: Path) -> None:
    trunk = EfficientNetFront()
    state = {f"_blocks.{11 + i}._bn2.weight": torch.ones(3) for i in range(2)} | {"_fc.bias": torch.ones(2)}
    starts = {1: 0, 2: 3, 3: 7}
    for key, value in trunk.state_dict().items():
        _, layer, index, *rest = key.split(".")
        name = (
            f"_blocks.{starts[int(layer)] + int(index)}" if int(layer) else ("_conv_stem", "_bn0")[int(index)]
        )
        state[".".join([name, *rest])] = value
    torch.save(state, tmp_path / "b4.pth")
    other = EfficientNetFront()
    load_imagenet(other, tmp_path / "b4.pth")
    assert same(trunk, other)
    assert all(each.requires_grad for each in other.parameters())


def test_a_street_trunk_refuses_other_weights(tmp_path: Path) -> None:
    save_file({"a": torch.ones(1)}, tmp_path / "other.safetensors")
    with pytest.raises(InputError, match="weights of the street network"):
        load_street(StreetTrunk(), tmp_path / "other.safetensors")
