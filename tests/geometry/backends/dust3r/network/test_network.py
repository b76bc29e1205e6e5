"""The network against the authors' own, with seeded weights."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
import torch
from tests.geometry.backends.dust3r.network.golden import Golden, relative, tiny
from torch import Tensor, nn

from dreamdrive.geometry.backends.dust3r.network.config import NetworkConfig
from dreamdrive.geometry.backends.dust3r.network.dust3r import Dust3r
from dreamdrive.geometry.backends.dust3r.network.heads import Pointmap, pointmap
from dreamdrive.geometry.backends.dust3r.network.rope import Rotation, grid_positions, rotate, rotation

LIMIT = 3e-5
# The head of 39 million weights takes seconds to seed.
MODELS = ("linear", "dpt_small", pytest.param("dpt", marks=pytest.mark.slow))
CASES = {
    "land": ("land_a", "land_b"),
    "port": ("port_a", "port_b"),
    "big": ("big_a", "big_b"),
    "mixed": ("land_a", "port_b"),
}


@pytest.fixture(scope="module")
def golden(golden_dir: Path) -> Golden:
    return Golden(golden_dir)


@pytest.fixture(scope="module")
def network(golden: Golden) -> Callable[[str], Dust3r]:
    return cache(golden.network)


def decoded(network: Dust3r, first: Tensor, second: Tensor) -> dict[str, Tensor]:
    """Results by the names of the golden numbers."""
    a, b = network(first, second)
    return {
        "res1.pts3d": a.points,
        "res1.conf": a.confidence,
        "res2.pts3d_in_other_view": b.points,
        "res2.conf": b.confidence,
    }


def check(values: dict[str, Tensor], expected: dict[str, Tensor], case: str) -> None:
    for name, value in values.items():
        assert relative(value, expected[f"{case}.{name}"]) < LIMIT, name


@pytest.mark.parametrize("head", ["dpt", "linear"])
def test_the_weights_have_the_published_names_and_shapes(golden: Golden, head: str) -> None:
    published = golden.json(f"state_dict_512_{head}")
    with torch.device("meta"):
        network = Dust3r(NetworkConfig(head=head))  # type: ignore[arg-type]
    assert {key: list(value.shape) for key, value in network.state_dict().items()} == published["shapes"]
    assert sum(part.numel() for part in network.parameters()) == published["parameters"]


@pytest.mark.parametrize("model", MODELS)
def test_the_seeded_weights_are_those_of_the_golden_numbers(
    golden: Golden, network: Callable[[str], Dust3r], model: str
) -> None:
    state = network(model).state_dict()
    checksums = golden.json("net_config")[model]["checksums"]
    for key, values in checksums.items():
        assert list(state[key].shape) == values["shape"], key
        total = state[key].double()
        assert float(total.abs().sum()) == pytest.approx(values["abssum"], rel=1e-6), key
        assert total.flatten()[:3].tolist() == pytest.approx(values["first"], rel=1e-6), key


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("model", MODELS)
def test_golden_points_and_confidences(
    golden: Golden, network: Callable[[str], Dust3r], model: str, case: str
) -> None:
    images = golden.tensors("net_inputs")
    first, second = (images[name] for name in CASES[case])
    check(decoded(network(model), first, second), golden.tensors(f"net_{model}_outputs"), case)


@pytest.mark.parametrize("model", MODELS)
def test_golden_batch_of_a_pair_and_its_reverse(
    golden: Golden, network: Callable[[str], Dust3r], model: str
) -> None:
    images = golden.tensors("net_inputs")
    a, b = images["land_a"], images["land_b"]
    values = decoded(network(model), torch.cat([a, b]), torch.cat([b, a]))
    check(values, golden.tensors(f"net_{model}_outputs"), "batchsym")


def as_trained(network: Dust3r, first: tuple[Tensor, bool], second: tuple[Tensor, bool]) -> dict[str, Tensor]:
    """Results in the layout of training, where all images are stored landscape, portrait ones turned.

    The golden numbers say that it makes no difference but for the layout.
    """
    upright = [image.transpose(2, 3) if turned else image for image, turned in (first, second)]
    values = decoded(network, *upright)
    turned = {"res1": first[1], "res2": second[1]}
    return {k: v.transpose(1, 2) if turned[k[:4]] else v for k, v in values.items()}


@pytest.mark.parametrize("model", MODELS)
def test_golden_portrait_images_stored_as_in_training(
    golden: Golden, network: Callable[[str], Dust3r], model: str
) -> None:
    images = golden.tensors("net_inputs")
    expected = golden.tensors(f"net_{model}_outputs")
    land = [(images[f"land_{k}"], False) for k in "ab"]
    port = [(images[f"port_{k}"].transpose(2, 3), True) for k in "ab"]
    assert port[0][0].shape == land[0][0].shape
    straight, turned = as_trained(network(model), *land), as_trained(network(model), *port)
    check(turned, expected, "manyar_port")
    check(as_trained(network(model), land[0], port[1]), expected, "manyar_cross")
    check({k: torch.cat([straight[k], turned[k]]) for k in straight}, expected, "manyar")


@pytest.mark.parametrize("model", MODELS)
def test_golden_tokens(golden: Golden, network: Callable[[str], Dust3r], model: str) -> None:
    images, expected = golden.tensors("net_inputs"), golden.tensors(f"net_{model}_outputs")
    first, second = (network(model).encode(images[f"land_{k}"]) for k in "ab")
    assert relative(first.values, expected["land.enc1"]) < LIMIT
    assert relative(second.values, expected["land.enc2"]) < LIMIT
    for side in (1, 2):
        torch.testing.assert_close(grid_positions(first.rows, first.columns), expected[f"land.pos{side}"][0])
    both = network(model).decoded(first, second)
    assert len(both[0]) == len(both[1]) == int(expected["land.ntaps"])
    tested = [key for key in expected if key.startswith("land.dec")]
    assert len(tested) == 2 * (3 if model == "linear" else 4)
    for key in tested:
        side, tap = key.removeprefix("land.dec").split(".")
        assert relative(both[int(side) - 1][int(tap)], expected[key]) < LIMIT, key


def test_golden_stages_of_the_dpt_head(golden: Golden, network: Callable[[str], Dust3r]) -> None:
    images, expected = golden.tensors("net_inputs"), golden.tensors("net_dpt_small_outputs")
    dpt = network("dpt_small").downstream_head1.dpt
    parts: dict[str, nn.Module] = {"raw": dpt}
    parts |= {f"act{i}": part for i, part in enumerate(dpt.act_postprocess)}
    parts |= {f"rn{i}": dpt.scratch.get_submodule(f"layer{i + 1}_rn") for i in range(4)}
    parts |= {f"refine{i}": dpt.scratch.get_submodule(f"refinenet{i}") for i in range(1, 5)}
    seen: dict[str, Tensor] = {}

    def keep(name: str) -> Callable[[nn.Module, object, Tensor], None]:
        return lambda module, inputs, output: seen.__setitem__(name, output)

    hooks = [part.register_forward_hook(keep(name)) for name, part in parts.items()]
    network("dpt_small")(images["land_a"], images["land_b"])
    for hook in hooks:
        hook.remove()
    tested = [key.removeprefix("land.dpt1.") for key in expected if key.startswith("land.dpt1.")]
    assert sorted(tested) == sorted(parts)
    for name in tested:
        assert relative(seen[name], expected[f"land.dpt1.{name}"]) < LIMIT, name


def test_golden_rotary_embedding(golden: Golden) -> None:
    values = golden.tensors("rope")
    cos, sin = rotation(values["positions"], values["tokens"].shape[-1], 100.0)
    by = Rotation(cos[:, None], sin[:, None])  # of each image, the same for all heads
    assert relative(rotate(values["tokens"], by), values["rotated"]) < 1e-6


def test_the_rotary_embedding_knows_only_differences_of_positions() -> None:
    q, k = torch.randn(2, 1, 1, 9, 16, generator=torch.Generator().manual_seed(0)).unbind()
    here, there = (rotation(grid_positions(3, 3) + offset, 16, 100.0) for offset in (0, 5))
    torch.testing.assert_close(
        rotate(q, here) @ rotate(k, here).mT, rotate(q, there) @ rotate(k, there).mT, atol=1e-5, rtol=1e-5
    )


def test_other_modes_of_points_and_confidences() -> None:
    raw = torch.tensor([3.0, 0.0, 4.0, 0.0]).reshape(1, 4, 1, 1)

    def of(**modes: object) -> Pointmap:
        return pointmap(raw, NetworkConfig(**modes))  # type: ignore[arg-type]

    direction = torch.tensor([0.6, 0.0, 0.8])
    torch.testing.assert_close(of().points.flatten(), direction * torch.tensor(5.0).expm1())
    torch.testing.assert_close(of(depth_mode="square").points.flatten(), direction * 25)
    torch.testing.assert_close(of(depth_mode="linear").points.flatten(), direction * 5)
    assert of().confidence.item() == 2
    assert of(conf_range=(1.0, 1.5)).confidence.item() == 1.5
    assert of(conf_mode="sigmoid", conf_range=(0.0, 3.0)).confidence.item() == 1.5


def test_a_point_at_the_camera_is_finite() -> None:
    assert pointmap(torch.zeros(1, 4, 2, 2), NetworkConfig()).points.abs().max() == 0


def test_images_of_another_size_are_refused() -> None:
    with pytest.raises(ValueError, match=r"40x32 px; both sides must be multiples of 16"):
        tiny().encode(torch.zeros(1, 3, 32, 40))


def test_a_bfloat16_trunk_stays_close_and_leaves_the_heads_alone(golden: Golden) -> None:
    images = golden.tensors("net_inputs")
    exact = tiny()(images["land_a"], images["land_b"])
    lowered = tiny()
    before = sum(part.nbytes for part in lowered.parameters())
    lowered.lower_trunk()
    assert sum(part.nbytes for part in lowered.parameters()) < before
    assert {part.dtype for part in lowered.downstream_head1.parameters()} == {torch.float32}
    assert lowered.enc_blocks[0].attn.qkv.weight.dtype == torch.bfloat16
    for a, b in zip(exact, lowered(images["land_a"], images["land_b"]), strict=True):
        assert a.points.dtype == b.points.dtype == torch.float32
        assert 0 < relative(b.points, a.points) < 0.03
        assert 0 < relative(b.confidence, a.confidence) < 0.03
