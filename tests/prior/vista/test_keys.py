"""Names in the official file and in diffusers."""

import pytest
import torch

from dreamdrive.prior.vista.configs import config_of
from dreamdrive.prior.vista.keys import PARTS, UNET, Part, Recipes, recipes_of
from dreamdrive.prior.vista.kinds import SVD, VISTA, ModelKind
from dreamdrive.prior.vista.networks import make_empty
from tests.golden.reading import is_cut, values
from tests.prior.vista.tiny import OFFICIAL, official, states

KEYS = "vista/vista_checkpoint_keys.json"
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
def test_the_rules_are_the_golden_tables(part: Part) -> None:
    recipes = recipes_of(values(KEYS))
    assert not recipes.unknown
    table, golden = as_table(recipes, part), values(f"vista/map_{MAPS[part]}.json")
    assert is_cut() or table.keys() == golden.keys()
    assert {key: table.get(key) for key in golden} == golden


def test_what_is_ignored_is_what_no_golden_table_has() -> None:
    if is_cut():
        pytest.skip("a cut of the golden numbers leaves out parts of the tables")
    keys = set(values(KEYS))
    used = {key for name in MAPS.values() for key in values(f"vista/map_{name}.json")}
    assert set(recipes_of(keys).ignored) == keys - used


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("kind", [VISTA, SVD])
def test_golden_official_file_is_the_network_by_name_and_shape(part: Part, kind: ModelKind) -> None:
    keys = values(KEYS)
    if kind is SVD:
        keys = {k: v for k, v in keys.items() if "action_control" not in k and "cond_time_stack" not in k}
    shapes = recipes_of(keys).shapes(part, {key: tuple(shape) for key, shape in keys.items()})
    network = make_empty(part, config_of(part, shapes), kind)
    assert shapes == {name: tuple(v.shape) for name, v in network.state_dict().items()}


@pytest.mark.parametrize("part", PARTS)
def test_the_sizes_of_the_published_model_follow_from_its_shapes(part: Part) -> None:
    config = OFFICIAL[part]
    shapes = {k: tuple(v.shape) for k, v in make_empty(part, config, VISTA).state_dict().items()}
    found = config_of(part, shapes)
    assert {key: found[key] for key in config} == config


@pytest.mark.parametrize("kind", [VISTA, SVD])
def test_there_and_back_is_the_same(kind: ModelKind) -> None:
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
