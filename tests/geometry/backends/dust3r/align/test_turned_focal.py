"""The focal length that the turns of the camera show."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from dreamdrive.geometry.backends.dust3r.align.alignment import AlignOptions, KnownCameras, align
from dreamdrive.geometry.backends.dust3r.align.focal import FocalVotes, focal_votes
from dreamdrive.geometry.backends.dust3r.align.graph import graph_of
from dreamdrive.geometry.backends.dust3r.align.turned_focal import TurnedFocal, turned_focal
from dreamdrive.geometry.backends.dust3r.pairs import PairMaps
from dreamdrive_bench.geometry.simulated_pairs import Noise, Truth, pair_maps
from tests.geometry.backends.dust3r.align.pairs import path_error, pinholes, street, window

FRAMES = 8
EXACT = Noise(0, 1 / 8, 0.1, 0, 0)
OPTIONS = AlignOptions(samples_per_image=150, steps=20)


@pytest.fixture(scope="module")
def corner() -> Truth:
    """It turns by 36 degrees."""
    return street(FRAMES, 64, 40, turn=0.15)


@pytest.fixture(scope="module")
def straight() -> Truth:
    """It nods by a degree."""
    return street(FRAMES, 64, 40, turn=0.0)


def shown(maps: PairMaps) -> TurnedFocal:
    graph = graph_of(maps)
    return turned_focal(maps, focal_votes(maps, graph), graph)


@pytest.mark.parametrize("bias", [0.05, 0.0, -0.05])
def test_a_corner_shows_what_all_pairs_have_wrong(corner: Truth, bias: float) -> None:
    maps = pair_maps(corner, window(FRAMES), replace(EXACT, common_focal=bias))
    assert focal_votes(maps, graph_of(maps)).shared_px == pytest.approx(
        (1 + bias) * corner.focal_px, rel=1e-4
    )
    found = shown(maps)
    assert found.focal_px == pytest.approx(corner.focal_px, rel=0.002)
    assert found.observed


def test_a_straight_road_shows_nothing(straight: Truth) -> None:
    assert not shown(pair_maps(straight, window(FRAMES), replace(EXACT, common_focal=0.05))).observed
    noisy = pair_maps(straight, window(FRAMES), Noise(common_focal=0.05, place=0.005))
    assert not shown(noisy).observed
    found = align(noisy, OPTIONS)
    assert not found.focal_observed
    assert found.focal_agreed
    assert found.focal_error >= 0.05
    assert found.focals_px[0] == pytest.approx(found.network_focal_px, rel=0.01)


@pytest.mark.parametrize("bias", [0.05, 0.0, -0.05])
def test_all_noise_at_once_leaves_the_focal_length_of_a_turn_within_three_percent(
    corner: Truth, bias: float
) -> None:
    """Errors across rays, of each pair's focal length, and outliers among them; movers do not matter."""
    maps = pair_maps(corner, window(FRAMES), Noise(common_focal=bias, place=0.005))
    found = align(maps, OPTIONS)
    assert found.focal_observed
    assert 0 < found.focal_error < 0.02
    assert found.focals_px[0] == pytest.approx(corner.focal_px, rel=0.03)
    assert path_error(found.world_from_camera, corner.world_from_camera) < 0.02


def test_the_spread_grows_with_the_noise(corner: Truth) -> None:
    spreads = [
        shown(pair_maps(corner, window(FRAMES), replace(EXACT, place=place))).spread
        for place in (0.0, 0.01, 0.04)
    ]
    assert spreads[0] < spreads[1] < spreads[2]
    assert spreads[2] > 0.02


def test_a_tenth_of_points_anywhere_does_no_harm(corner: Truth) -> None:
    maps = pair_maps(corner, window(FRAMES), replace(EXACT, common_focal=0.05))
    random = np.random.default_rng(0)
    points: list[tuple[np.ndarray, np.ndarray]] = []
    for first, second in maps.points:
        wrong = (random.random(second.shape[:2]) < 0.1)[..., None]
        anywhere = random.permutation(second.reshape(-1, 3)).reshape(second.shape)
        points.append((first, np.where(wrong, anywhere, second)))
    found = shown(replace(maps, points=tuple(points)))
    assert found.focal_px == pytest.approx(corner.focal_px, rel=0.005)
    assert found.observed


def test_plain_reference_code_finds_the_same(corner: Truth) -> None:
    """A grid of focal lengths, OpenCV's poses at each, and a parabola through the sums of squares."""
    maps = pair_maps(corner, window(FRAMES), replace(EXACT, common_focal=0.05, place=0.003))
    votes = focal_votes(maps, graph_of(maps))
    grid = votes.shared_px * np.exp(np.linspace(-0.08, 0.02, 6))
    sums = [sum(_squares(maps, votes, edge, focal) for edge in range(len(maps))) for focal in grid]
    curve = np.polyfit(np.log(grid), sums, 2)
    plain = np.exp(-curve[1] / (2 * curve[0]))
    assert abs(votes.shared_px / corner.focal_px - 1) > 0.045
    assert shown(maps).focal_px == pytest.approx(plain, rel=0.005)


def _squares(maps: PairMaps, votes: FocalVotes, edge: int, focal: float) -> float:
    second, trust = maps.points[edge][1], maps.confidence[edge][1]
    height, width = trust.shape
    columns, rows = np.meshgrid(np.arange(width), np.arange(height))
    counts = trust > 1
    pixels = np.stack([columns, rows], axis=-1)[counts].astype(np.float64)
    ratio = votes.focal_px[edge] / focal
    points = second[counts] * [ratio, ratio, 1.0]
    matrix = np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]])
    start = cv2.solvePnP(points, pixels, matrix, None, flags=cv2.SOLVEPNP_SQPNP)[1:]
    turn, shift = cv2.solvePnPRefineLM(points, pixels, matrix, None, *start)
    there = cv2.projectPoints(points, turn, shift, matrix, None)[0][:, 0]
    return float(np.square(there - pixels).sum())


def test_oblong_pixels_and_a_principal_point_beside_the_middle() -> None:
    """Of pixels twice as high there are half as many rows: every second one is the same picture."""
    truth = street(FRAMES, 64, 80, turn=0.15, principal_px=(28.0, 44.0))
    maps = pair_maps(truth, window(FRAMES), replace(EXACT, common_focal=0.05))
    points, confidence = (
        tuple(tuple(side[::2] for side in pair) for pair in part) for part in (maps.points, maps.confidence)
    )
    maps, given = PairMaps(maps.edges, points, confidence), pinholes(truth)
    given[:, 1] /= 2
    graph = graph_of(maps).through(given)
    found = turned_focal(maps, focal_votes(maps, graph), graph)
    assert found.focal_px == pytest.approx(truth.focal_px, rel=0.002)


def test_three_images_are_too_few(corner: Truth) -> None:
    maps = pair_maps(corner, window(3), replace(EXACT, common_focal=0.05))
    assert shown(maps) == TurnedFocal(focal_votes(maps, graph_of(maps)).shared_px, float("inf"))


def test_pairs_are_brought_to_a_known_focal_length(corner: Truth) -> None:
    maps = pair_maps(corner, window(FRAMES), replace(EXACT, common_focal=0.05))
    found = align(maps, OPTIONS, KnownCameras(intrinsics=pinholes(corner)))
    assert path_error(found.world_from_camera, corner.world_from_camera) < 1e-4
    assert found.focal_error == 0
    assert found.focal_observed


def test_the_papers_loss_keeps_to_the_network(corner: Truth) -> None:
    maps = pair_maps(corner, window(FRAMES), replace(EXACT, common_focal=0.05))
    found = align(maps, replace(OPTIONS, objective="distance", steps=5))
    assert found.focals_px[0] == pytest.approx(1.05 * corner.focal_px, rel=0.01)
    assert not found.focal_observed
