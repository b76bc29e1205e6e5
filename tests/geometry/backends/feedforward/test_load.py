"""What is missing or does not fit is said by name, and nothing is fetched."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file

from dreamdrive.errors import InputError
from dreamdrive.geometry import BACKENDS, GeometryOptions, reconstruct
from dreamdrive.scene.clip import Clip
from tests.geometry.backends.feedforward.fakes import BACKEND, CONFIGS, FAKES, Truth, install, save_weights


def method(kind: str) -> str:
    return BACKEND.get(kind, kind)


def load(kind: str, path: Path) -> object:
    return BACKENDS[method(kind)].reconstruct.load(path)  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", FAKES)
def test_without_its_package_a_backend_says_what_to_install(
    name: str, clip: Clip, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = BACKENDS[name].package
    assert package is not None
    monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.setattr("dreamdrive.models.backend.find_spec", dict[str, None]().get)
    with pytest.raises(InputError, match=rf"{package} is missing: (.*pip install --no-deps|git clone)"):
        reconstruct(clip, GeometryOptions(method=name, weights=save_weights(tmp_path, name)))


@pytest.mark.parametrize("name", FAKES)
def test_without_what_the_package_needs_a_backend_says_what_to_install(
    name: str, truth: Truth, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(monkeypatch, truth, name)
    for module in FAKES[name](truth):
        if "." in module:
            monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(InputError, match=r"cannot be imported \(.*\): (.*pip install --no-deps|git clone)"):
        load(name, save_weights(tmp_path, name))


def test_a_folder_without_weights_is_named(kind: str, weights: Path) -> None:
    (weights / "model.safetensors").unlink()
    with pytest.raises(InputError, match=r"weights holds none of model.safetensors, model.pt, .*; expected"):
        load(kind, weights)


def test_a_file_that_is_missing_or_damaged_is_named(kind: str, weights: Path) -> None:
    with pytest.raises(InputError, match=r"other.safetensors is missing or damaged"):
        load(kind, weights / "other.safetensors")
    (weights / "model.safetensors").write_bytes(b"\x10\0\0\0\0\0\0\0nonsense")
    with pytest.raises(InputError, match=r"model.safetensors is missing or damaged"):
        load(kind, weights)


def test_the_config_is_needed_where_it_says_what_to_build(kind: str, weights: Path) -> None:
    (weights / "config.json").unlink()
    if method(kind) in ("da3", "mapanything"):
        with pytest.raises(InputError, match=r"config.json does not exist"):
            load(kind, weights)
    else:
        load(kind, weights)


@pytest.mark.parametrize("text", ["{", "[1]"])
def test_a_damaged_config_is_named(kind: str, weights: Path, text: str) -> None:
    (weights / "config.json").write_text(text)
    with pytest.raises(InputError, match=r"config.json( is not JSON|: expected a JSON object)"):
        load(kind, weights)


def test_keys_of_another_model_are_named(kind: str, weights: Path) -> None:
    save_weights(weights, kind, decoder=torch.zeros(1))
    with pytest.raises(InputError, match=r"model.safetensors does not fit \(1 unknown: decoder\); expected"):
        load(kind, weights)


@pytest.mark.parametrize("kind", ["mapanything"])
def test_a_package_of_another_signature_is_named(kind: str, weights: Path) -> None:
    (weights / "config.json").write_text(CONFIGS["mapanything"].replace('"name"', '"title"'))
    with pytest.raises(InputError, match=r"does not build this network \(TypeError: .*title"):
        load(kind, weights)


@pytest.mark.parametrize("kind", ["vggt", "pi3", "pi3x"])
def test_weights_may_be_a_file_that_torch_saved(kind: str, weights: Path) -> None:
    state = load_file(weights / "model.safetensors")
    for name, content in (("model.pt", state), ("bare.pth", {"model": state})):
        torch.save(content, weights / name)
        load(kind, weights / name)
    (weights / "model.safetensors").unlink()
    load(kind, weights)


@pytest.mark.parametrize("kind", ["da3"])
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("da3metric-large", "is da3metric-large, which sees one picture at a time and gives no cameras"),
        ("da3mono-large", "is da3mono-large, which sees one picture at a time"),
        ("da4-small", "names the model da4-small, not one of da3-small"),
    ],
)
def test_models_of_depth_anything_without_cameras_are_refused_by_name(
    kind: str, weights: Path, name: str, message: str
) -> None:
    (weights / "config.json").write_text(f'{{"model_name": "{name}"}}')
    with pytest.raises(InputError, match=message):
        load(kind, weights)


@pytest.mark.parametrize("kind", ["mapanything"])
def test_the_encoder_of_mapanything_is_not_fetched(kind: str, weights: Path, tmp_path: Path) -> None:
    (tmp_path / "hub" / "facebookresearch_dinov2_main").rmdir()
    with pytest.raises(InputError, match=r"git clone https://github.com/facebookresearch/dinov2 .*hub"):
        load(kind, weights)


@pytest.mark.parametrize("kind", ["mapanything"])
def test_pictures_of_another_standard_are_refused(kind: str, weights: Path) -> None:
    (weights / "config.json").write_text(CONFIGS["mapanything"].replace('"dinov2"', '"croco"'))
    with pytest.raises(InputError, match="standardised for croco"):
        load(kind, weights)


def test_one_frame_is_refused(kind: str, clip: Clip, weights: Path) -> None:
    fields = ("frames", "times_s", "camera", "valid", "held_out", "source_index")
    alone = replace(clip, **{name: getattr(clip, name)[:1] for name in fields})
    with pytest.raises(InputError, match="takes two frames or more; got 1"):
        reconstruct(alone, GeometryOptions(method=method(kind), weights=weights))
