"""All pairs of a set of frames: encoded once, in batches, within a budget that is told beforehand."""

import logging
from dataclasses import replace

import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.dust3r.network.config import NetworkConfig
from dreamdrive.geometry.backends.dust3r.network.dust3r import Dust3r, Tokens
from dreamdrive.geometry.backends.dust3r.network.images import as_input
from dreamdrive.geometry.backends.dust3r.network.inference import infer
from dreamdrive.geometry.backends.dust3r.network.memory import plan_memory
from dreamdrive.geometry.backends.dust3r.pairs import PairMaps, make_pairs
from tests.geometry.backends.dust3r.network.networks import tiny

SHAPES = ((32, 48), (32, 48), (48, 32), (32, 48), (48, 32))


@pytest.fixture(scope="module")
def network() -> Dust3r:
    return tiny()


@pytest.fixture(scope="module")
def pictures() -> list[np.ndarray]:
    rng = np.random.default_rng(0)
    return [rng.integers(0, 256, (*shape, 3), dtype=np.uint8) for shape in SHAPES]


@pytest.fixture(scope="module")
def edges() -> np.ndarray:
    return make_pairs(len(SHAPES), "swin-2-noncyclic")


def test_each_pair_is_what_the_network_says_of_it(network, pictures, edges) -> None:
    maps = infer(network, pictures, edges)
    assert len(maps) == len(edges) == 14
    np.testing.assert_array_equal(maps.edges, edges)
    for edge, points, confidence in zip(edges.tolist(), maps.points, maps.confidence, strict=True):
        expected = network(*(as_input([pictures[i]]) for i in edge))
        for side in (0, 1):
            assert points[side].shape == (*SHAPES[edge[side]], 3)
            assert points[side].dtype == confidence[side].dtype == np.float32
            assert points[side].flags.c_contiguous
            np.testing.assert_allclose(points[side], expected[side].points[0], rtol=1e-4, atol=1e-5)
            np.testing.assert_allclose(confidence[side], expected[side].confidence[0], rtol=1e-5)
            assert confidence[side].min() > 1


def test_one_at_a_time_gives_the_same(network, pictures, edges) -> None:
    whole = infer(network, pictures, edges)
    plan = plan_memory(network, SHAPES, edges, 10**9)
    assert plan.pairs_at_once == 8
    least = plan.total - plan.working + max(plan.image, plan.pair)
    assert plan_memory(network, SHAPES, edges, least).pairs_at_once == 1
    single = infer(network, pictures, edges, budget_bytes=least)
    for a, b in zip(whole.points, single.points, strict=True):
        for side in (0, 1):
            np.testing.assert_allclose(a[side], b[side], rtol=1e-4, atol=1e-5)


def test_each_frame_is_encoded_once_and_only_if_it_is_needed(network, pictures, monkeypatch) -> None:
    encoded: list[int] = []
    encode = network.encode

    def counted(images: torch.Tensor) -> Tokens:
        encoded.append(len(images))
        return encode(images)

    monkeypatch.setattr(network, "encode", counted)
    infer(network, pictures, np.array([[0, 1], [1, 0], [3, 0], [0, 4]]))
    assert sorted(encoded) == [1, 3]


def test_progress_counts_frames_and_pairs(network, pictures, edges) -> None:
    seen: list[tuple[int, int]] = []
    infer(network, pictures, edges, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (5 + 14, 5 + 14)
    assert [done for done, _ in seen] == sorted({done for done, _ in seen})


def test_what_it_takes_is_told_first(network, pictures, edges, caplog) -> None:
    with caplog.at_level(logging.WARNING, "dreamdrive"):
        infer(network, pictures, edges)
    plan = plan_memory(network, SHAPES, edges, 10**9)
    assert f"DUSt3R on 14 pairs of 5 frames takes {plan}" in caplog.text


def test_too_little_memory_is_refused_with_figures(network, pictures, edges) -> None:
    with pytest.raises(
        InputError, match=r"14 pairs of 5 frames needs \d.*weights 0\.00 GB.*allowed are 0\.00 GB"
    ):
        infer(network, pictures, edges, budget_bytes=10**5)


def test_the_plan_grows_with_what_is_asked(network) -> None:
    def plan(frames: int, graph: str = "complete", net: Dust3r = network):
        return plan_memory(net, [(288, 512)] * frames, make_pairs(frames, graph), 10**12)

    pixels = 288 * 512
    assert plan(4).outputs == 12 * 2 * 4 * 4 * pixels
    assert plan(4).tokens == 4 * 576 * 32 * 4
    assert plan(4, "swin-1-noncyclic").outputs == plan(4).outputs / 2
    assert plan(4).weights == sum(part.nbytes for part in network.parameters())
    with torch.device("meta"):
        linear, dpt = (Dust3r(NetworkConfig(head=head)) for head in ("linear", "dpt"))
    assert plan(4, net=linear).weights == 4 * 532_342_784
    assert plan(4, net=linear).pair < plan(4, net=dpt).pair
    assert plan(2).total < plan(3).total < plan(4).total


def test_pairs_of_frames_that_are_not_there(network, pictures) -> None:
    with pytest.raises(ValueError, match="pairs name frames 0 to 5; there are 5"):
        infer(network, pictures, np.array([[0, 5]]))


def test_maps_that_do_not_fit_each_other_are_refused(network, pictures) -> None:
    maps = infer(network, pictures, np.array([[0, 2]]))
    with pytest.raises(ValueError, match="points and confidence differ in shape"):
        replace(maps, confidence=(maps.confidence[0][::-1],))
    with pytest.raises(ValueError, match="1 pairs, but points of 0"):
        PairMaps(maps.edges, (), ())


def test_a_bfloat16_trunk_stays_close(network, pictures) -> None:
    lowered = tiny()
    lowered.lower_trunk()
    edges = np.array([[0, 2], [2, 0]])
    exact, close = infer(network, pictures, edges), infer(lowered, pictures, edges)
    for a, b in zip(exact.points, close.points, strict=True):
        for side in (0, 1):
            assert np.abs(a[side] - b[side]).max() < 0.05 * np.abs(a[side]).max()
