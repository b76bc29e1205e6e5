"""A scene made of the truth is right, one with its labels exchanged wrong, known errors have their size."""

import json
import math
from dataclasses import asdict, replace

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from dreamdrive.errors import InputError
from dreamdrive.evaluate.decomposition import Decomposition, evaluate_decomposition, true_labels
from dreamdrive.evaluate.truth.drawn import Truth
from dreamdrive.fit import SeedOptions, initialise
from dreamdrive.motion import (
    DeformationConfig,
    DeformationField,
    Domain,
    Tracks,
    multiply_quaternions,
)
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.truth import DriveTruth
from streetworld import make_street
from tests.streets import street_clip, true_geometry

FRAMES, SIZE = 6, (160, 96)


@pytest.fixture(scope="module")
def street() -> DriveTruth:
    return make_street(seed=3, frames=FRAMES, size=SIZE)


@pytest.fixture(scope="module")
def truth(street: DriveTruth) -> Truth:
    return Truth.of(street)


@pytest.fixture(scope="module")
def seeds(street: DriveTruth) -> tuple[Gaussians, torch.Tensor]:
    """Opaque Gaussians on the true surfaces of all frames, and which of them lie on moving ones."""
    options = SeedOptions(stride_px=1, moving_stride_px=1, footprint=0.4)
    made = initialise(street_clip(street), true_geometry(street), options).without_features()
    made = replace(made, logit_opacities=torch.full((len(made),), 4.0))
    moving = np.zeros(len(made), dtype=bool)
    for frame, camera in enumerate(street.cameras):
        rows = np.flatnonzero(made.source_frame.numpy() == frame)
        column, row, _ = camera.project(made.means[rows].double().numpy()).T
        moving[rows] = street.moving[frame, row.astype(int), column.astype(int)]
    return made, torch.from_numpy(moving)


def scene_of(
    street: DriveTruth, static: Gaussians, dynamic: Gaussians, field: DeformationField | None = None
) -> Scene:
    nothing = np.zeros(FRAMES, dtype=bool)
    return Scene(static, dynamic, field, (), None, None, street.cameras, street.times_s, nothing)


def brief(street: DriveTruth, gaussians: Gaussians) -> Gaussians:
    """The Gaussians, each to be seen in its source frame alone."""
    at_s = torch.from_numpy(street.times_s).float()[gaussians.source_frame]
    return replace(gaussians, lifespan=torch.stack([at_s, torch.full_like(at_s, 0.01)], dim=1))


@pytest.fixture(scope="module")
def right(street: DriveTruth, seeds: tuple[Gaussians, torch.Tensor]) -> Scene:
    made, moving = seeds
    return scene_of(street, made.select(~moving), brief(street, made.select(moving)))


@pytest.fixture(scope="module")
def figures(right: Scene, truth: Truth) -> Decomposition:
    return evaluate_decomposition(right, truth)


def everything_on_a_track(street: DriveTruth, seeds: Gaussians, way_m: np.ndarray) -> Scene:
    """A scene without static Gaussians, all of it shifted downwards by ``way_m`` (F,) at the frames."""
    translation = np.zeros((1, FRAMES, 3))
    translation[0, :, 1] = way_m
    tracks = Tracks(street.times_s, translation, np.zeros((1, FRAMES)), np.zeros((1, 3)))
    config = DeformationConfig(depth=2, width=4, actors=1, track_times=FRAMES)
    field = DeformationField(config, Domain(np.zeros(3), 50.0, 0.0, 1.0, np.array([0, -1.0, 0])), tracks)
    members = replace(seeds, actor=torch.zeros(len(seeds), dtype=torch.int64))
    return scene_of(street, members.select(torch.zeros(0, dtype=torch.int64)), members, field)


def test_the_truth_is_right(figures: Decomposition) -> None:
    assert figures.scale == pytest.approx(1)
    assert figures.path_rms_m < 1e-9
    assert figures.mask.iou > 0.8  # type: ignore[operator]
    assert figures.mask.average_precision > 0.93  # type: ignore[operator]
    assert figures.labels.iou > 0.95  # type: ignore[operator]
    assert figures.fake is not None
    assert (figures.fake.mean_m, figures.fake.moved_share) == (0.0, 0.0)
    assert figures.actors.boxes >= 1
    assert figures.actors.found == figures.actors.boxes
    assert figures.actors.offset_median_m < 0.3  # type: ignore[operator]
    assert figures.actors.displacement_90_m < 0.3  # type: ignore[operator]
    assert json.loads(json.dumps(asdict(figures), allow_nan=False))["labels"]["iou"] == figures.labels.iou


def test_labels_the_wrong_way_round_are_wrong(
    street: DriveTruth, truth: Truth, seeds: tuple[Gaussians, torch.Tensor]
) -> None:
    made, moving = seeds
    found = evaluate_decomposition(scene_of(street, made.select(moving), made.select(~moving)), truth)
    assert found.mask.iou < 0.1  # type: ignore[operator]
    assert found.labels.iou < 0.02  # type: ignore[operator]
    assert found.actors.found == 0


def test_a_scene_that_knows_no_motion_finds_none(
    street: DriveTruth, truth: Truth, seeds: tuple[Gaussians, torch.Tensor]
) -> None:
    made, _ = seeds
    found = evaluate_decomposition(
        scene_of(street, made, made.select(torch.zeros(0, dtype=torch.int64))), truth
    )
    assert (found.mask.iou, found.mask.precision, found.mask.recall) == (0.0, None, 0.0)
    assert found.labels.recall == 0.0
    assert found.fake is not None
    assert (found.fake.mean_m, found.fake.moved_share) == (0.0, 0.0)
    assert found.actors.found == 0
    assert found.actors.offset_median_m is None


def test_a_wobble_is_measured_at_its_size(
    street: DriveTruth, truth: Truth, seeds: tuple[Gaussians, torch.Tensor]
) -> None:
    # Every frame is 0.3 m from three of the five others, and none from two.
    wobbling = everything_on_a_track(street, seeds[0], 0.3 * (np.arange(FRAMES) % 2))
    found = evaluate_decomposition(wobbling, truth)
    assert found.fake is not None
    assert found.fake.mean_m == pytest.approx(0.3 * 3 / 5, rel=1e-3)
    assert found.fake.moved_share == pytest.approx(1)
    assert found.labels.recall == 1
    assert found.labels.precision < 0.5  # type: ignore[operator]


def test_what_has_no_life_left_moves_nothing(
    street: DriveTruth, truth: Truth, seeds: tuple[Gaussians, torch.Tensor]
) -> None:
    wobbling = everything_on_a_track(street, seeds[0], 0.3 * (np.arange(FRAMES) % 2))
    found = evaluate_decomposition(replace(wobbling, dynamic=brief(street, wobbling.dynamic)), truth)
    assert found.fake is not None
    assert found.fake.mean_m < 1e-6


def test_road_users_that_fall_behind_are_behind(
    street: DriveTruth, right: Scene, truth: Truth, figures: Decomposition
) -> None:
    late = right.dynamic.means.clone()
    late[:, 0] += 0.1 * right.dynamic.source_frame
    found = evaluate_decomposition(replace(right, dynamic=replace(right.dynamic, means=late)), truth)
    assert found.actors.found >= 1
    # After k frames it is k tenths of a metre off, k = 1 ... 5, but for where its rim shows other things.
    assert found.actors.displacement_median_m == pytest.approx(0.3, abs=0.15)
    assert found.actors.displacement_90_m > figures.actors.displacement_90_m + 0.2  # type: ignore[operator]


def test_another_world_and_scale_change_nothing(right: Scene, truth: Truth, figures: Decomposition) -> None:
    turn, scale, shift_m = Rotation.from_euler("xyz", [0.2, 0.5, -0.1]), 1.5, np.array([4.0, 5, 6])

    def elsewhere(g: Gaussians) -> Gaussians:
        x, y, z, w = turn.as_quat()
        a = torch.tensor([w, x, y, z]).float().expand(len(g), 4)
        means = scale * torch.from_numpy(turn.apply(g.means.double().numpy())) + torch.from_numpy(shift_m)
        return replace(
            g,
            means=means.float(),
            quaternions=multiply_quaternions(a, g.quaternions),
            log_scales=g.log_scales + math.log(scale),
        )

    cameras = []
    for camera in right.cameras:
        pose = camera.world_from_camera.copy()
        pose[:3, :3] = turn.as_matrix() @ pose[:3, :3]
        pose[:3, 3] = scale * turn.apply(pose[:3, 3]) + shift_m
        cameras.append(camera.at(pose))
    found = evaluate_decomposition(
        replace(
            right,
            static=elsewhere(right.static),
            dynamic=elsewhere(right.dynamic),
            cameras=tuple(cameras),
        ),
        truth,
    )
    assert found.scale == pytest.approx(1 / scale)
    assert found.mask.iou == pytest.approx(figures.mask.iou, abs=0.01)
    assert found.labels.iou == pytest.approx(figures.labels.iou, abs=0.01)
    assert found.actors.offset_median_m == pytest.approx(figures.actors.offset_median_m, abs=0.02)


def test_a_gaussian_without_a_frame_is_judged_where_its_depth_fits(
    street: DriveTruth, right: Scene, truth: Truth
) -> None:
    known, judged = true_labels(right, street.cameras, truth, 1.0)
    static = replace(right.static, source_frame=torch.full_like(right.static.source_frame, -1))
    lost, also = true_labels(replace(right, static=static), street.cameras, truth, 1.0)
    count = len(right.static)
    assert (also >= judged).all()
    assert judged[:count].mean() > 0.99
    # What stands was seeded on the true surface, and fits there in another frame too.
    assert lost[:count].mean() < 0.01
    assert (lost[count:] == known[count:]).all()
    assert known[count:].mean() > 0.95


def test_what_is_behind_a_road_user_stands_and_what_is_before_it_is_its_own(
    street: DriveTruth, right: Scene, truth: Truth
) -> None:
    centre = torch.from_numpy(street.cameras[2].world_from_camera[:3, 3]).float()
    own = right.dynamic.select(right.dynamic.source_frame == 2)
    inside = own.select(torch.from_numpy(_well_inside(street, own)))
    assert len(inside) > 20
    for stretch, moving in ((0.6, True), (1.0, True), (1.6, False)):
        placed = replace(inside, means=centre + stretch * (inside.means - centre))
        found, _ = true_labels(replace(right, dynamic=placed), street.cameras, truth, 1.0)
        assert (found[len(right.static) :] == moving).all()


def _well_inside(street: DriveTruth, gaussians: Gaussians) -> np.ndarray:
    column, row, depth = street.cameras[2].project(gaussians.means.double().numpy()).T
    pixel = row.astype(int), column.astype(int)
    return street.moving[2][pixel] & (np.abs(street.depth_m[2][pixel] / depth - 1) < 0.02)


def test_scenes_of_other_frames_are_refused(right: Scene, truth: Truth, street: DriveTruth) -> None:
    with pytest.raises(InputError, match="has 6 frames but the truth has 4"):
        evaluate_decomposition(right, Truth.of(street, [0, 1, 2, 3]))
    narrow = tuple(replace(camera, width_px=120) for camera in right.cameras)
    with pytest.raises(InputError, match="are 120x96, those of the world 160x96"):
        evaluate_decomposition(replace(right, cameras=narrow), truth)
    with pytest.raises(ValueError, match="truth: depth_m of shape"):
        replace(truth, cameras=truth.cameras[:2])
