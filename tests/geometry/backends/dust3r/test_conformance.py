"""From a clip to cameras and depth, with a network that knows the truth of a street."""

from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from dreamdrive.geometry import GeometryOptions, reconstruct
from dreamdrive.geometry.backends.dust3r.align.alignment import AlignOptions, KnownCameras, align
from dreamdrive.geometry.backends.dust3r.network.images import resize_crop
from dreamdrive.geometry.backends.dust3r.pairs import PairMaps
from dreamdrive.geometry.measured import Measured
from dreamdrive.geometry.resize import ResizeCrop
from dreamdrive.scene.clip import Clip, Known as KnownOfClip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive_bench.geometry.simulated_pairs import Noise, Truth, pair_maps
from streetworld import make_street
from tests.geometry.backends.dust3r.align.pairs import path_error, pinholes
from tests.geometry.backends.dust3r.network.networks import tiny
from tests.geometry.backends.dust3r.network.test_checkpoint import save_pth
from tests.streets import street_clip

MODULE = import_module("dreamdrive.geometry.backends.dust3r.reconstruct")
FRAMES, SIZE, LONG_SIDE = 5, (160, 120), 128
CUT = 10  # rows cut off below, so that the principal point is not in the middle
HOW = resize_crop(160, 110, LONG_SIDE)  # 128x88, of which 128x80 are left
EXACT = Noise(0, 1 / 8, 0, 0, 0)


@pytest.fixture(scope="module")
def street() -> DriveTruth:
    return make_street(5, FRAMES, 5.0, SIZE, movers=0)


@pytest.fixture(scope="module")
def clip(street: DriveTruth) -> Clip:
    """The upper 110 rows of the frames, and their pinhole."""
    whole = street_clip(street)
    return replace(
        whole,
        frames=whole.frames[:, :-CUT],
        valid=whole.valid[:, :-CUT],
        rig=(replace(whole.rig[0], height_px=SIZE[1] - CUT),),
        known=KnownOfClip(intrinsics=True, sky=street.sky[:, :-CUT]),
        features={},
    )


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return save_pth(tmp_path_factory.mktemp("weights") / "tiny.pth", tiny(), img_size=(LONG_SIDE, LONG_SIDE))


def pictured(street: DriveTruth, clip: Clip, how: ResizeCrop) -> Truth:
    """The street at the pixels of the pictures, which the network counts from 0."""
    camera, (width, height) = how.picture_camera(clip.rig[0]), how.size
    assert camera.fx_px == pytest.approx(camera.fy_px)
    columns, rows = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    at = np.floor(how.to_frame(np.stack([columns, rows], axis=-1))).astype(int)
    return Truth(
        street.depth_m[:, at[..., 1], at[..., 0]].astype(np.float64),
        street.trajectory.world_from_camera,
        camera.fx_px,
        principal_px=(camera.cx_px - 0.5, camera.cy_px - 0.5),
    )


def knowing(monkeypatch: pytest.MonkeyPatch, truth: Truth, change: object = lambda maps: maps) -> None:
    """Let the network say the truth."""

    def infer(network: object, pictures: list[np.ndarray], edges: np.ndarray, **more: object) -> PairMaps:
        assert all(picture.shape[:2] == truth.depth.shape[1:] for picture in pictures)
        return change(pair_maps(truth, edges, EXACT))  # type: ignore[operator]

    monkeypatch.setattr(MODULE, "infer", infer)


class HandedError(Exception):
    """Carries what is handed on to be brought to metres, and ends there."""


def measured(monkeypatch: pytest.MonkeyPatch, clip: Clip, weights: Path) -> Measured:
    """Cameras and depth as they are handed to ``finish``."""

    def caught(clip: Clip, found: Measured, *rest: object, **more: object) -> Geometry:
        raise HandedError(found)

    with monkeypatch.context() as patch:
        patch.setattr(MODULE, "finish", caught)
        with pytest.raises(HandedError) as handed:
            reconstruct(clip, GeometryOptions(method="dust3r", weights=weights))
    return handed.value.args[0]


def off(found: Measured, street: DriveTruth) -> tuple[float, np.ndarray]:
    """The unit of what was measured, and how far its depth on the road is off, relative."""
    true = street.trajectory.world_from_camera
    unit = np.linalg.norm(true[-1, :3, 3]) / np.linalg.norm(found.world_from_camera[-1, :3, 3])
    depth, theirs = unit * found.depth[:, 60:], street.depth_m[:, 60 : found.depth.shape[1]]
    both = (depth > 0) & (theirs > 0) & (theirs < 20)
    assert both.mean() > 0.5
    return float(unit), (depth / np.where(theirs > 0, theirs, 1) - 1)[both]


def test_known_pinholes_poses_and_depth_are_the_truth(
    monkeypatch: pytest.MonkeyPatch, street: DriveTruth, clip: Clip, weights: Path
) -> None:
    """A pixel of the network amounts to 1 to 3 % of depth on the road: an offset of half of one shows."""
    knowing(monkeypatch, pictured(street, clip, HOW))
    found = measured(monkeypatch, clip, weights)
    np.testing.assert_array_equal(found.camera.matrix, clip.rig[0].matrix)
    assert path_error(found.world_from_camera, street.trajectory.world_from_camera) < 1e-5
    _, errors = off(found, street)
    assert abs(np.median(errors)) < 0.002
    assert np.quantile(np.abs(errors), 0.8) < 0.03
    cut = (HOW.resized[1] - HOW.size[1]) // 2 / 0.8  # rows that the network does not see
    assert cut == 5
    assert not found.depth[:, :5].any()
    assert not found.depth[:, -5:].any()
    assert not found.depth[:, :-CUT][street.sky[:, : -2 * CUT]].any()
    assert found.details["focal_spread"] < 1e-4


@pytest.mark.slow
def test_the_wrong_pinhole_would_show(
    monkeypatch: pytest.MonkeyPatch, street: DriveTruth, clip: Clip, weights: Path
) -> None:
    truth = pictured(street, clip, HOW)
    knowing(monkeypatch, replace(truth, principal_px=None))
    found = measured(monkeypatch, clip, weights)
    assert path_error(found.world_from_camera, street.trajectory.world_from_camera) > 1e-4


def test_without_a_calibration_the_principal_point_is_where_the_network_has_it(
    monkeypatch: pytest.MonkeyPatch, street: DriveTruth, clip: Clip, weights: Path
) -> None:
    truth = replace(pictured(street, clip, HOW), principal_px=None)
    knowing(monkeypatch, truth)
    found = measured(monkeypatch, replace(clip, known=KnownOfClip()), weights)
    assert found.camera.fx_px == pytest.approx(truth.focal_px / 0.8, rel=1e-4)
    # Half of 128x80 and half a pixel, for the network counts from 0, then 4 rows and the shrinking undone.
    assert (found.camera.cx_px, found.camera.cy_px) == pytest.approx((64.5 / 0.8, (40.5 + 4) / 0.8))
    assert path_error(found.world_from_camera, street.trajectory.world_from_camera) < 1e-5


@pytest.mark.slow
def test_what_the_network_says_of_the_sky_does_not_count(
    monkeypatch: pytest.MonkeyPatch, street: DriveTruth, clip: Clip, weights: Path
) -> None:
    def sure(maps: PairMaps) -> PairMaps:
        return replace(
            maps,
            confidence=tuple(tuple(np.where(c > 1, c, np.float32(9)) for c in p) for p in maps.confidence),
        )

    truth = pictured(street, clip, HOW)
    assert (truth.depth == 0).mean() > 0.1
    knowing(monkeypatch, truth, sure)
    found = measured(monkeypatch, clip, weights)
    assert path_error(found.world_from_camera, street.trajectory.world_from_camera) < 1e-5
    assert found.details["masked_share"] > 0.1
    unknown = measured(monkeypatch, replace(clip, known=KnownOfClip(intrinsics=True)), weights)
    assert path_error(unknown.world_from_camera, street.trajectory.world_from_camera) < 1e-3


def test_held_out_frames_are_posed_and_give_no_depth(
    monkeypatch: pytest.MonkeyPatch, street: DriveTruth, clip: Clip, weights: Path
) -> None:
    knowing(monkeypatch, pictured(street, clip, HOW))
    held = np.arange(FRAMES) == 2
    found = measured(monkeypatch, replace(clip, held_out=held), weights)
    assert not found.depth[held].any()
    assert not found.confidence[held].any()
    assert (found.depth[~held] > 0).any(axis=(1, 2)).all()
    assert path_error(found.world_from_camera, street.trajectory.world_from_camera) < 1e-5


def test_known_poses_give_depth_their_unit(
    monkeypatch: pytest.MonkeyPatch, street: DriveTruth, clip: Clip, weights: Path
) -> None:
    knowing(monkeypatch, pictured(street, clip, HOW))
    poses = street.trajectory.world_from_camera
    known = replace(clip.known, world_from_camera=poses)
    found = measured(monkeypatch, replace(clip, known=known), weights)
    np.testing.assert_array_equal(found.world_from_camera, poses)
    assert found.unit == "poses"
    unit, errors = off(found, street)
    assert unit == pytest.approx(1, rel=1e-6)
    assert abs(np.median(errors)) < 0.002


def test_a_standing_camera_needs_no_unit_of_its_poses(
    monkeypatch: pytest.MonkeyPatch, street: DriveTruth, clip: Clip, weights: Path
) -> None:
    still = np.zeros(FRAMES, int)
    noise = np.random.default_rng(0).integers(-4, 5, clip.frames.shape)
    poses = np.tile(np.eye(4), (FRAMES, 1, 1))
    standing = replace(
        clip,
        frames=np.clip(clip.frames[still] + noise, 0, 255).astype(np.uint8),
        known=replace(clip.known, world_from_camera=poses, sky=street.sky[still, :-CUT]),
    )
    truth = pictured(street, clip, HOW)
    knowing(monkeypatch, replace(truth, depth=truth.depth[still], world_from_camera=poses))
    height_m = float(street.ground.height_m(np.zeros(3)))
    found = reconstruct(standing, GeometryOptions(method="dust3r", weights=weights, camera_height_m=height_m))
    assert any("stands still" in note for note in found.detected)
    np.testing.assert_array_equal(np.stack([each.world_from_camera for each in found.cameras]), poses)
    both = (found.depth_m > 0) & (street.depth_m[still, :-CUT] > 0)
    assert np.median(found.depth_m[both] / street.depth_m[still, :-CUT][both]) == pytest.approx(1, abs=0.08)


def test_cameras_are_solved_without_what_moves_and_its_depth_still_is(street: DriveTruth, clip: Clip) -> None:
    """A thing that fills a part of all images and is sure to be elsewhere."""
    truth = pictured(street, clip, HOW)
    edges = np.array([(i, j) for i in range(FRAMES) for j in range(FRAMES) if i != j and abs(i - j) < 3])
    maps = pair_maps(truth, edges, EXACT)
    there = np.zeros(truth.depth.shape[1:], bool)
    there[30:75, 20:105] = True
    shift = np.array([0.5, 0, 1.0])
    points = tuple(
        tuple(np.where(there[..., None], side + (j - i) * shift, side).astype(np.float32) for side in pair)
        for (i, j), pair in zip(edges.tolist(), maps.points, strict=True)
    )
    trust = tuple(tuple(np.where(there, np.float32(30), side) for side in pair) for pair in maps.confidence)
    moving = PairMaps(edges, points, trust)
    still = MODULE._still(_in_frames(there), np.ones((FRAMES, *there.shape), bool), HOW)
    assert not still[:, there].any()
    options, known = AlignOptions(samples_per_image=500), KnownCameras(pinholes(truth))
    without, withal = (align(moving, options, known, mask) for mask in (tuple(still), None))
    errors = [path_error(each.world_from_camera, truth.world_from_camera) for each in (without, withal)]
    for depth in without.depth:
        assert depth[there].std() > 0.01 * depth[there].mean()  # no filling of what is not known
    assert errors[0] < 1e-5
    assert errors[1] > 100 * errors[0]
    for amount in (0.0, 1.0):  # nothing moves, or nothing else is left
        assert MODULE._still(np.full((FRAMES, 110, 160), amount), np.ones_like(still), HOW) is None


def _in_frames(there: np.ndarray) -> np.ndarray:
    """Evidence (F, 110, 160) of what moves in those pixels of the pictures."""
    frame = np.zeros((110, 160))
    rows, columns = np.nonzero(there)
    frame[
        int(np.floor((rows.min() + 4) / 0.8)) : int(np.ceil((rows.max() + 5) / 0.8)),
        int(np.floor(columns.min() / 0.8)) : int(np.ceil((columns.max() + 1) / 0.8)),
    ] = 1
    return np.tile(frame, (FRAMES, 1, 1))
