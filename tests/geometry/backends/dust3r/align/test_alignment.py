"""From pairs to one world."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.dust3r.align.aligned import Aligned
from dreamdrive.geometry.backends.dust3r.align.alignment import (
    AlignOptions,
    KnownCameras,
    align,
    predicted_bytes,
)
from dreamdrive.geometry.backends.dust3r.align.graph import graph_of
from dreamdrive.geometry.backends.dust3r.align.spanning_tree import AlignmentStart, spanning_tree
from dreamdrive.geometry.backends.dust3r.pairs import PairMaps
from dreamdrive_bench.geometry.authors_alignment import Objective, descend, raw_parameters
from dreamdrive_bench.geometry.simulated_pairs import Noise, Truth, pair_maps
from tests.geometry.backends.dust3r.align.pairs import path_error, pinholes, street, window

EXACT = Noise(0, 1 / 8, 0.1, 0, 0)
ROBUST = AlignOptions(samples_per_image=300)
PAPER = replace(ROBUST, objective="distance")
EACH = AlignOptions(objective="distance", focal="each")


@pytest.fixture(scope="module")
def drive() -> Truth:
    return street(6, 56, 32)


@pytest.fixture(scope="module")
def noisy(drive: Truth) -> PairMaps:
    return pair_maps(drive, window(6), Noise())


@pytest.fixture(scope="module")
def aligned(noisy: PairMaps) -> Aligned:
    return align(noisy, ROBUST)


@pytest.fixture(scope="module")
def paper(noisy: PairMaps) -> Aligned:
    return align(noisy, PAPER)


@pytest.mark.parametrize("options", [PAPER, ROBUST])
def test_exact_pairs_give_the_truth(drive: Truth, options: AlignOptions) -> None:
    found = align(pair_maps(drive, window(6), EXACT), options)
    assert path_error(found.world_from_camera, drive.world_from_camera) < 1e-4
    np.testing.assert_allclose(found.focals_px, drive.focal_px, rtol=1e-3)
    np.testing.assert_array_equal(found.world_from_camera[0], np.eye(4))
    seen = drive.depth > 0
    scale = np.median(np.stack(found.depth)[seen] / drive.depth[seen])
    np.testing.assert_allclose(np.stack(found.depth)[seen], scale * drive.depth[seen], rtol=2e-3)
    assert found.residual.max() < 1e-3
    np.testing.assert_allclose(found.masked_share, (~seen).mean(axis=(1, 2)))
    assert found.focal_agreed
    assert found.path_observed


def authors_end(maps: PairMaps, steps: int = 300) -> tuple[float, AlignmentStart]:
    """Loss and parameters after the authors' optimiser, from the start without their stale focal lengths."""
    objective = Objective(maps, graph_of(maps))
    raw = raw_parameters(spanning_tree(maps, upstream=True, stale_focals=False))
    with one_torch_thread():
        losses = descend(objective, raw, steps)
    return float(losses[-1]), objective.start_of(raw)


def test_the_loss_is_no_higher_than_after_300_steps_of_the_authors(drive: Truth, noisy: PairMaps) -> None:
    loss, end = authors_end(noisy)
    found = align(noisy, EACH)
    assert found.loss <= loss
    shared = align(noisy, PAPER)  # one camera took all images
    theirs, ours = (path_error(e.world_from_camera, drive.world_from_camera) for e in (end, shared))
    assert ours < 1.2 * theirs


def test_the_loss_is_that_of_the_authors(noisy: PairMaps) -> None:
    found = align(noisy, EACH)
    objective = Objective(noisy, graph_of(noisy))
    end = AlignmentStart(found.world_from_camera, found.focals_px, found.depth, found.pairs)
    assert float(objective(raw_parameters(end)).detach()) == pytest.approx(found.loss, rel=1e-4)


def test_noise_is_withstood(drive: Truth, noisy: PairMaps, aligned: Aligned) -> None:
    """Depth 5 % and focal lengths 5 % off, scales 10 %, a tenth of gross outliers; a short and tiny clip."""
    assert path_error(aligned.world_from_camera, drive.world_from_camera) < 0.01
    assert abs(aligned.focals_px[0] / drive.focal_px - 1) < 0.03
    assert len(np.unique(aligned.focals_px)) == 1
    assert 0.01 < np.median(aligned.residual) < 0.1
    upstream = authors_end(noisy, 30)[1].world_from_camera
    assert path_error(upstream, drive.world_from_camera) > 2 * path_error(
        aligned.world_from_camera, drive.world_from_camera
    )


def test_identical_twice(noisy: PairMaps, aligned: Aligned) -> None:
    again = align(noisy, ROBUST)
    np.testing.assert_array_equal(again.world_from_camera, aligned.world_from_camera)
    assert again.losses == aligned.losses
    for a, b in zip(again.depth, aligned.depth, strict=True):
        np.testing.assert_array_equal(a, b)


def test_numbering_images_otherwise_changes_nothing_else(noisy: PairMaps, paper: Aligned) -> None:
    order = np.array([3, 0, 1, 5, 2, 4])  # image i becomes image order[i]
    other = align(replace(noisy, edges=order[noisy.edges]), PAPER)
    assert other.loss == pytest.approx(paper.loss, rel=5e-3)
    assert path_error(other.world_from_camera[order], paper.world_from_camera) < 5e-3
    np.testing.assert_allclose(other.focals_px[order], paper.focals_px, rtol=5e-3)


def test_the_unit_of_the_pairs_does_not_matter(noisy: PairMaps, aligned: Aligned) -> None:
    points = tuple(tuple(side * np.float32(7) for side in pair) for pair in noisy.points)
    scaled = align(replace(noisy, points=points), ROBUST)
    np.testing.assert_allclose(scaled.focals_px, aligned.focals_px, rtol=1e-3)
    np.testing.assert_allclose(
        scaled.world_from_camera[:, :3, :3], aligned.world_from_camera[:, :3, :3], atol=1e-3
    )
    ratio = np.linalg.norm(scaled.world_from_camera[-1, :3, 3]) / np.linalg.norm(
        aligned.world_from_camera[-1, :3, 3]
    )
    assert ratio == pytest.approx(7, rel=1e-3)


def test_a_pair_in_another_unit_is_the_same_pair(noisy: PairMaps, paper: Aligned) -> None:
    """Each pair's scale is free: only the common unit changes with one of them."""
    points = list(noisy.points)
    points[5] = tuple(side * np.float32(3) for side in points[5])
    other = align(replace(noisy, points=tuple(points)), PAPER)
    assert path_error(other.world_from_camera, paper.world_from_camera) < 2e-3


def test_known_focal_lengths_stay(drive: Truth, noisy: PairMaps) -> None:
    found = align(noisy, ROBUST, KnownCameras(intrinsics=pinholes(drive)))
    np.testing.assert_array_equal(found.focals_px, np.full(6, drive.focal_px))
    assert path_error(found.world_from_camera, drive.world_from_camera) < 0.01


def test_a_known_pinhole_in_the_middle_is_the_default(
    drive: Truth, noisy: PairMaps, aligned: Aligned
) -> None:
    given = pinholes(drive)
    given[:, [0, 1], [0, 1]] = aligned.focals_px[0]
    graph = graph_of(noisy)
    through = graph.through(given)
    np.testing.assert_array_equal(through.principal_px, graph.principal_px)
    np.testing.assert_array_equal(through.stretch, graph.stretch)


@pytest.mark.parametrize("stretch", [1, 2])
def test_a_principal_point_beside_the_middle_is_kept(stretch: int) -> None:
    """Of pixels twice as high there are half as many rows: every second one is the same picture."""
    truth = street(6, 56, 40 * stretch, principal_px=(23.0, 24.0 * stretch))
    maps = pair_maps(truth, window(6), EXACT)
    points, confidence = (
        tuple(tuple(side[::stretch] for side in pair) for pair in part)
        for part in (maps.points, maps.confidence)
    )
    maps, depth = PairMaps(maps.edges, points, confidence), truth.depth[:, ::stretch]
    intrinsics = pinholes(truth)
    intrinsics[:, 1] /= stretch
    knowing, guessing = (align(maps, ROBUST, KnownCameras(intrinsics=each)) for each in (intrinsics, None))
    errors = [path_error(each.world_from_camera, truth.world_from_camera) for each in (knowing, guessing)]
    assert errors[0] < 1e-4
    assert errors[1] > 20 * errors[0]
    seen = depth > 0
    scale = np.median(np.stack(knowing.depth)[seen] / depth[seen])
    np.testing.assert_allclose(np.stack(knowing.depth)[seen], scale * depth[seen], rtol=2e-3)
    assert knowing.residual.max() < 1e-3
    assert knowing.focal_spread < 1e-4 < guessing.focal_spread


def test_known_poses_stay_and_give_depth_in_their_unit(drive: Truth, noisy: PairMaps) -> None:
    given = drive.world_from_camera.copy()
    given[:, :3, 3] += [100.0, 0.0, -40.0]
    found = align(noisy, ROBUST, KnownCameras(world_from_camera=given))
    np.testing.assert_array_equal(found.world_from_camera, given)
    seen = drive.depth > 0
    ratio = np.median(np.stack(found.depth)[seen] / drive.depth[seen])
    assert ratio == pytest.approx(1, abs=0.05)
    assert abs(found.focals_px[0] / drive.focal_px - 1) < 0.05


def test_known_poses_that_stand_still_are_refused(noisy: PairMaps) -> None:
    with pytest.raises(InputError, match="the given poses stand still, but the clip does not"):
        align(noisy, replace(ROBUST, steps=2), KnownCameras(world_from_camera=np.tile(np.eye(4), (6, 1, 1))))


def test_images_of_different_sizes(noisy: PairMaps) -> None:
    """Every second image keeps its upper rows only."""
    points, confidence = (
        tuple(
            tuple(side[: 24 if image % 2 else 32] for image, side in zip(edge, pair, strict=True))
            for edge, pair in zip(noisy.edges, part, strict=True)
        )
        for part in (noisy.points, noisy.confidence)
    )
    found = align(PairMaps(noisy.edges, points, confidence), replace(EACH, steps=5))
    assert [depth.shape for depth in found.depth] == [(32, 56), (24, 56)] * 3


def test_halves_of_precision_do(noisy: PairMaps, aligned: Aligned) -> None:
    kinds = [
        tuple(tuple(side.astype(np.float16) for side in pair) for pair in part)
        for part in (noisy.points, noisy.confidence)
    ]
    found = align(PairMaps(noisy.edges, kinds[0], kinds[1]), ROBUST)
    assert path_error(found.world_from_camera, aligned.world_from_camera) < 2e-3


def test_a_standing_camera_has_no_path(drive: Truth) -> None:
    still = replace(
        drive, depth=drive.depth[:1].repeat(6, 0), world_from_camera=drive.world_from_camera[:1].repeat(6, 0)
    )
    assert not align(pair_maps(still, window(6), Noise()), ROBUST).path_observed


def test_focal_lengths_that_disagree_are_not_agreed_on(drive: Truth) -> None:
    found = align(pair_maps(drive, window(6), Noise(focal=0.3)), replace(PAPER, steps=5))
    assert not found.focal_agreed
    assert not found.focal_observed
    assert found.focal_error > 0.05


def test_what_is_too_large_is_refused_before_it_starts(noisy: PairMaps) -> None:
    with pytest.raises(InputError, match=r"6 images in 24 pairs takes about 0.\d GB, and 0.1 GB are allowed"):
        align(noisy, AlignOptions(memory_gb=0.1))
    clip = predicted_bytes([(288, 512)] * 25, window(25), 2000)
    assert 0.6e9 < clip < 4e9
    halved = predicted_bytes([(288, 512)] * 25, window(25), 2000, storage_bytes=2)
    assert clip - halved == 4 * 2 * 276 * 288 * 512


@pytest.mark.parametrize(
    ("known", "message"),
    [
        (KnownCameras(intrinsics=np.eye(3)[None]), "6 images take 6 pinholes"),
        (KnownCameras(intrinsics=-np.tile(np.eye(3), (6, 1, 1))), "6 images take 6 pinholes with positive"),
        (KnownCameras(world_from_camera=np.eye(4)[None]), "6 images take 6 poses; got 1"),
        (KnownCameras(world_from_camera=np.full((6, 4, 4), 2.0)), "known poses cannot be used"),
    ],
)
def test_what_is_known_has_to_fit(noisy: PairMaps, known: KnownCameras, message: str) -> None:
    with pytest.raises(InputError, match=message):
        align(noisy, ROBUST, known)
