"""Names in the official file and in diffusers."""

import json

import pytest
import torch
from tests.prior.vista.conftest import Golden
from tests.prior.vista.tiny import official, states

from dreamdrive.prior.vista.configs import config_of
from dreamdrive.prior.vista.keys import PARTS, UNET, Part, Recipes, recipes_of
from dreamdrive.prior.vista.kinds import ACTION_COLUMNS, SVD, VISTA, Kind
from dreamdrive.prior.vista.networks import make_empty

MAPS: dict[Part, str] = {
    "unet": "unet_to_diffusers",
    "vae": "vae_to_diffusers",
    "image_encoder": "clip_to_transformers",
}


def as_table(recipes: Recipes, part: Part) -> dict[str, object]:
    """The recipes in the form of the golden tables."""
    table: dict[str, object] = {}
    thirds: dict[str, dict[int, str]] = {}
    for name, recipe in recipes.parts[part].items():
        if recipe.third is not None:
            thirds.setdefault(recipe.source, {})[recipe.third] = name
            table[recipe.source] = {"split3_dim0_into": [thirds[recipe.source].get(i) for i in range(3)]}
        else:
            table[recipe.source] = {"transpose_into": name} if recipe.transposed else name
        if recipe.columns is not None:
            table[recipe.columns] = {"concat_dim1_onto": name}
    return table


@pytest.mark.parametrize("part", PARTS)
def test_the_rules_are_the_golden_tables(golden: Golden, part: Part) -> None:
    keys = json.loads((golden.folder / "vista_checkpoint_keys.json").read_text())
    recipes = recipes_of(keys)
    assert not recipes.unknown
    assert len(recipes.ignored) == 6 + 138 + 108
    assert as_table(recipes, part) == json.loads((golden.folder / f"map_{MAPS[part]}.json").read_text())


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("kind", [VISTA, SVD])
def test_golden_official_file_is_the_network_by_name_and_shape(
    golden: Golden, part: Part, kind: Kind
) -> None:
    keys = json.loads((golden.folder / "vista_checkpoint_keys.json").read_text())
    if kind is SVD:
        keys = {k: v for k, v in keys.items() if "action_control" not in k and "cond_time_stack" not in k}
    shapes = recipes_of(keys).shapes(part, {key: tuple(shape) for key, shape in keys.items()})
    config = config_of(part, shapes)
    wanted = {name: tuple(v.shape) for name, v in make_empty(part, config, kind).state_dict().items()}
    assert shapes == wanted
    if part == "unet":
        assert config["num_attention_heads"] == [5, 10, 20, 20]
        assert config["cross_attention_dim"] == 1024 + (ACTION_COLUMNS if kind is VISTA else 0)
        assert len(wanted) == 1428 + (4 if kind is VISTA else 0)
    if part == "image_encoder":
        assert (config["num_attention_heads"], config["num_hidden_layers"]) == (16, 32)
        assert (config["image_size"], config["projection_dim"]) == (224, 1024)


@pytest.mark.parametrize("kind", [VISTA, SVD])
def test_there_and_back_is_the_same(kind: Kind) -> None:
    file = official(kind)
    recipes = recipes_of(file)
    assert not recipes.unknown
    for part, state in states(kind).items():
        made = {name: recipe.make(file.__getitem__) for name, recipe in recipes.parts[part].items()}
        assert made.keys() == state.keys()
        assert all(torch.equal(made[name], value) for name, value in state.items())


def test_unmerged_lora_is_merged() -> None:
    file = official(VISTA)
    name = "down_blocks.1.attentions.0.transformer_blocks.0.attn2.to_k.weight"
    place = f"{UNET}input_blocks.4.1.transformer_blocks.0.attn2"
    plain = recipes_of(file).parts["unet"][name]
    before = plain.make(file.__getitem__)
    file[f"{place}.k_adapter_down.weight"] = torch.randn(2, 16)
    file[f"{place}.k_adapter_up.weight"] = torch.randn(64, 2)
    merged = recipes_of(file).parts["unet"][name]
    change = merged.make(file.__getitem__) - before
    expected = file[f"{place}.k_adapter_up.weight"] @ file[f"{place}.k_adapter_down.weight"]
    torch.testing.assert_close(change[:, :16], expected)
    assert not change[:, 16:].any()
    del file[f"{place}.k_adapter_up.weight"]
    assert recipes_of(file).unknown == [f"{place}.k_adapter_down.weight"]


def test_keys_of_another_model_are_unknown() -> None:
    wrong = ["encoder.layer.0.weight", f"{UNET}middle_block.1.other.weight.x", f"{UNET}strange.0.weight"]
    assert set(recipes_of(wrong).unknown) >= {wrong[0], wrong[2]}
