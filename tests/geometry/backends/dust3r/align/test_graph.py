"""Pairs that cannot be aligned are refused by name."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.dust3r.align.graph import graph_of
from dreamdrive.geometry.backends.dust3r.pairs import PairMaps
from dreamdrive_bench.geometry.simulated_pairs import Noise, pair_maps
from tests.geometry.backends.dust3r.align.pairs import street, window


@pytest.fixture(scope="module")
def maps() -> PairMaps:
    return pair_maps(street(4, 32, 20), window(4), Noise())


def test_each_image_knows_its_halves(maps: PairMaps) -> None:
    graph = graph_of(maps)
    assert graph.sizes == ((20, 32),) * 4
    for image, halves in enumerate(graph.halves):
        assert all(maps.edges[half.edge, half.side] == image for half in halves)
    assert sum(map(len, graph.halves)) == 2 * len(maps.edges)


def test_groups_without_a_link(maps: PairMaps) -> None:
    keep = [e for e, (i, j) in enumerate(maps.edges) if (i < 2) == (j < 2)]
    with pytest.raises(
        InputError, match=r"2 groups of images without a link between them: \[0, 1\]; \[2, 3\]"
    ):
        graph_of(_only(maps, keep))


def test_an_image_in_no_pair(maps: PairMaps) -> None:
    keep = [e for e, (i, j) in enumerate(maps.edges) if 1 not in (i, j)]
    with pytest.raises(InputError, match="Image 1 is in no pair"):
        graph_of(_only(maps, keep))


def test_images_without_a_valid_pixel(maps: PairMaps) -> None:
    masked = tuple(
        tuple(np.ones_like(side) if image in (1, 2) else side for image, side in zip(edge, pair, strict=True))
        for edge, pair in zip(maps.edges, maps.confidence, strict=True)
    )
    with pytest.raises(InputError, match="Images 1, 2 are left with fewer than 10 pixels"):
        graph_of(replace(maps, confidence=masked))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_pointmaps_that_are_not_finite(maps: PairMaps, value: float) -> None:
    points = [tuple(side.copy() for side in pair) for pair in maps.points]
    row, column = np.argwhere(maps.confidence[0][1] > 1)[0]
    points[0][1][row, column, 2] = value
    image = int(maps.edges[0, 1])
    with pytest.raises(InputError, match=f"Image {image} is given NaN or infinite points"):
        graph_of(replace(maps, points=tuple(points)))


def test_a_size_that_changes_and_a_pair_of_one(maps: PairMaps) -> None:
    shorter = [(tuple(side[:-1] for side in part[0]), *part[1:]) for part in (maps.points, maps.confidence)]
    with pytest.raises(InputError, match="an image has one size"):
        graph_of(PairMaps(maps.edges, shorter[0], shorter[1]))
    edges = maps.edges.copy()
    edges[0] = 2
    with pytest.raises(InputError, match="two different images"):
        graph_of(replace(maps, edges=edges))


def _only(maps: PairMaps, keep: list[int]) -> PairMaps:
    return PairMaps(
        maps.edges[keep], tuple(maps.points[e] for e in keep), tuple(maps.confidence[e] for e in keep)
    )
