"""What a checkpoint says of its network."""

import json
import math
from typing import Any

import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.dust3r.network.config import (
    HeadKind,
    NetworkConfig,
    check_agreement,
    config_from_call,
    config_from_json,
    config_from_keywords,
    config_from_shapes,
)
from dreamdrive.geometry.backends.dust3r.network.dust3r import Dust3r
from tests.geometry.backends.dust3r.network.networks import tiny

CALL = (
    "AsymmetricCroCo3DStereo(pos_embed='RoPE100', patch_embed_cls='ManyAR_PatchEmbed', img_size=(512, 512), "
    "head_type='dpt', output_mode='pts3d', depth_mode=('exp', -inf, inf), conf_mode=('exp', 1, inf), "
    "enc_embed_dim=1024, enc_depth=24, enc_num_heads=16, dec_embed_dim=768, dec_depth=12, dec_num_heads=12)"
)
HUB: dict[str, Any] = {
    "pos_embed": "RoPE100",
    "img_size": [512, 512],
    "head_type": "dpt",
    "depth_mode": ["exp", -math.inf, math.inf],
    "conf_mode": ["exp", 1, math.inf],
    "enc_embed_dim": 1024,
    "enc_depth": 24,
    "enc_num_heads": 16,
    "dec_embed_dim": 768,
    "dec_depth": 12,
    "dec_num_heads": 12,
}


def test_the_text_of_the_published_model_gives_the_default() -> None:
    assert config_from_call(CALL, "m") == NetworkConfig()
    assert config_from_call(CALL.replace(" ", ""), "m") == NetworkConfig()
    assert config_from_call(
        CALL.replace("head_type='dpt'", "freeze='encoder',landscape_only=True"), "m"
    ).head == ("linear")


def test_the_json_of_the_published_model_gives_the_default() -> None:
    text = json.dumps(HUB)
    assert "-Infinity" in text
    assert config_from_json(text, "m") == NetworkConfig()


def test_what_is_not_stated_is_what_the_authors_take() -> None:
    config = config_from_json('{"pos_embed": "RoPE100"}', "m")
    assert (config.enc_dim, config.enc_depth, config.enc_heads) == (768, 12, 12)
    assert (config.dec_dim, config.dec_depth, config.dec_heads) == (512, 8, 16)
    assert (config.head, config.image_size, config.patch, config.mlp_ratio) == ("linear", 224, 16, 4)


@pytest.mark.parametrize("head", ["dpt", "linear"])
def test_published_shapes_give_the_published_sizes(head: HeadKind) -> None:
    config = NetworkConfig(head=head)
    with torch.device("meta"):
        shapes = {key: tuple(value.shape) for key, value in Dust3r(config).state_dict().items()}
    assert config_from_shapes(shapes, "m") == config


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("AsymmetricCroCo3DStereo", "AsymmetricMASt3R", r"m: the model \"AsymmetricMASt3R\(.*is another one"),
        ("AsymmetricCroCo3DStereo(", "dict(", "is another one; expected AsymmetricCroCo3DStereo"),
        ("dec_num_heads=12)", "dec_num_heads=12", "is no constructor call"),
        ("enc_depth=24", "enc_depth=print(24)", r"enc_depth='print\(24\)' is no plain value"),
        ("enc_depth=24", "enc_depth=2.5", "enc_depth 2.5; expected a whole number"),
        ("enc_depth=24", "enc_depth=0", "must be positive"),
        ("img_size=(512, 512)", "img_size=()", "img_size"),
        ("'RoPE100'", "'cosine'", "pos_embed 'cosine' is not supported; expected RoPE100"),
        ("'dpt'", "'catmlp+dpt'", r"head_type 'catmlp\+dpt'; expected 'dpt' or 'linear'"),
        ("'pts3d'", "'pts3d+desc24'", "output_mode .* not supported"),
        ("-inf, inf", "0, inf", "depth_mode with bounds .* not supported"),
        ("('exp', 1, inf)", "None", "conf_mode None; expected a kind of exp, sigmoid and two bounds"),
        ("('exp', 1, inf)", "('exp', 1, 1)", "are no range"),
        ("('exp', 1, inf)", "('sigmoid', 0, inf)", "two finite bounds"),
        ("enc_num_heads=16", "enc_num_heads=15", "encoder: 1024 channels do not split into 15 heads"),
        ("pos_embed", "patch_size=8, pos_embed", "needs patches of 16 px, not 8"),
    ],
)
def test_other_models_are_refused_by_name(old: str, new: str, message: str) -> None:
    assert old in CALL
    with pytest.raises(InputError, match=message):
        config_from_call(CALL.replace(old, new), "m")


@pytest.mark.parametrize("text", ["", "{", "[]", "3", '{"enc_depth": "many", "pos_embed": "RoPE100"}'])
def test_other_json_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"config\.json"):
        config_from_json(text, "config.json")


def test_shapes_of_another_model_are_refused() -> None:
    with pytest.raises(InputError, match=r"no DUSt3R model: there is no tensor patch_embed\.proj\.weight"):
        config_from_shapes({"conv1.weight": (64, 3, 7, 7)}, "m")
    with pytest.raises(InputError, match=r"has the shape \(4,\), not 4 sides"):
        config_from_shapes({"patch_embed.proj.weight": (4,)}, "m")


def test_disagreement_is_named() -> None:
    check_agreement(NetworkConfig(enc_heads=8), NetworkConfig(), "m")
    with pytest.raises(
        InputError, match=r"enc_depth is stated as 24, the tensors have 23; head is stated as 'dpt'"
    ):
        check_agreement(NetworkConfig(), NetworkConfig(enc_depth=23, head="linear"), "m")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"img_size": [10**6, 512]},
            r"m: img_size \[1000000, 512\]; expected one or two positive numbers up to 4096",
        ),
        ({"mlp_ratio": 1e30}, r"m: mlp_ratio 1e\+30; expected more than 0 and at most 64"),
        ({"mlp_ratio": -4}, "m: mlp_ratio -4; expected more than 0 and at most 64"),
        ({"pos_embed": "RoPE" + "9" * 400}, "is not supported; expected RoPE100"),
    ],
)
def test_sizes_beyond_all_networks_are_refused(changes, said):
    with pytest.raises(InputError, match=said):
        config_from_keywords({"pos_embed": "RoPE100", **changes}, "m")


def test_the_number_of_a_layer_does_not_make_layers():
    shapes = {key: tuple(value.shape) for key, value in tiny().state_dict().items()}
    depth = config_from_shapes(shapes, "m").enc_depth
    for number in (10**9, 9999):
        assert config_from_shapes({**shapes, f"enc_blocks.{number}.x": (1,)}, "m").enc_depth <= 2 * depth + 2
