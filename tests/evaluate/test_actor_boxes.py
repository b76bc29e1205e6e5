"""Boxes of a scene that shows road users where they are, moved by known ways."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from dreamdrive.evaluate.actor_boxes import WITHIN_M, BoxError, box_error
from dreamdrive.evaluate.truth.drawn import Truth
from dreamdrive.fit import SeedOptions, initialise
from dreamdrive.scene.actor import Actor, ActorBox, Track
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.similarity import fit_similarity
from dreamdrive.scene.street.truth import DriveTruth, WorldBox
from streetworld import make_street
from tests.streets import street_clip, true_geometry

FRAMES, SIZE = 4, (320, 192)


@pytest.fixture(scope="module")
def street() -> DriveTruth:
    return make_street(seed=3, frames=FRAMES, size=SIZE)


@pytest.fixture(scope="module")
def right(street: DriveTruth) -> Scene:
    """Opaque Gaussians on all true surfaces, each to be seen in its own frame, and an actor a moving user."""
    made = initialise(
        street_clip(street),
        true_geometry(street),
        SeedOptions(stride_px=1, moving_stride_px=1, footprint=0.4),
    ).without_features()
    made = replace(made, logit_opacities=torch.full((len(made),), 4.0))
    own = torch.full((len(made),), -1)
    for frame, camera in enumerate(street.cameras):
        rows = np.flatnonzero(made.source_frame.numpy() == frame)
        column, row, _ = camera.project(made.means[rows].double().numpy()).T
        at = frame, row.astype(int), column.astype(int)
        own[rows] = torch.from_numpy(np.where(street.moving[at], street.instance[at].astype(np.int64), -1))
    at_s = torch.from_numpy(street.times_s).float()[made.source_frame]
    made = replace(made, lifespan=torch.stack([at_s, torch.full_like(at_s, 0.01)], dim=1), actor=own)
    actors = tuple(actor_of(street, box) for box in street.boxes if (own == box.instance).any())
    nothing = np.zeros(FRAMES, bool)
    static = replace(made.select(own < 0), actor=None)
    return Scene(
        static, made.select(own >= 0), None, actors, None, None, street.cameras, street.times_s, nothing
    )


def actor_of(street: DriveTruth, box: WorldBox) -> Actor:
    foot_m = box.world_from_box[:, :3, 3] - 0.5 * box.size_m[2] * box.world_from_box[:, :3, 2]
    track = Track(street.times_s, foot_m, np.zeros(FRAMES))
    ahead = box.world_from_box[0, :3, 0]
    return Actor(box.instance, box.id, "vehicle", 9, track, ActorBox(np.asarray(box.size_m), ahead))


def found(scene: Scene, street: DriveTruth) -> BoxError:
    truth = Truth.of(street)
    error = box_error(scene, street.cameras, truth, fit_similarity(scene.cameras, truth.cameras))
    assert error is not None
    return error


def changed(scene: Scene, **how: object) -> Scene:
    return replace(scene, actors=tuple(replace(actor, **how) for actor in scene.actors))  # type: ignore[arg-type]


def test_the_truth_is_right(right: Scene, street: DriveTruth) -> None:
    error = found(right, street)
    assert error.pairs >= 4
    assert error.position_median_m < 1e-6  # type: ignore[operator]
    assert error.heading_median_deg < 3  # type: ignore[operator]
    assert error.heading_5_deg > 0.9  # type: ignore[operator]
    assert error.length_median_m < 1e-6  # type: ignore[operator]
    assert (error.count_right, error.misses) == (1.0, ())


def test_known_errors_have_their_size(right: Scene, street: DriveTruth) -> None:
    moved = [
        replace(a, track=replace(a.track, positions_m=a.track.positions_m + np.array([0.3, 9, 0.4])))
        for a in right.actors
    ]
    error = found(replace(right, actors=tuple(moved)), street)
    assert error.position_median_m == pytest.approx(0.5, abs=0.35)  # the road is not quite level
    turned = [replace(a, track=replace(a.track, yaw_rad=np.full(FRAMES, 0.5))) for a in right.actors]
    error = found(replace(right, actors=tuple(turned)), street)
    assert error.heading_median_deg == pytest.approx(np.degrees(0.5), abs=3)
    assert error.heading_5_deg == 0
    longer = [
        replace(a, box=ActorBox(a.box.size_m + np.array([1, 0, 0]), a.box.ahead))
        for a in right.actors
        if a.box
    ]
    assert found(replace(right, actors=tuple(longer)), street).length_median_m == pytest.approx(1)


def test_who_is_not_shown_is_missed(right: Scene, street: DriveTruth) -> None:
    gone = right.actors[0].id
    error = found(right.without(gone), street)
    assert [miss.instance for miss in error.misses] == [gone]
    assert error.misses[0].missed == error.misses[0].frames > 0
    nobody = found(
        replace(right, dynamic=right.dynamic.select(torch.zeros(0, dtype=torch.int64)), actors=()), street
    )
    assert (nobody.pairs, nobody.position_median_m) == (0, None)


def test_far_ones_and_those_without_a_box_are_not_measured(right: Scene, street: DriveTruth) -> None:
    assert found(changed(right, box=None), street).pairs == 0
    truth = Truth.of(street)
    far = np.eye(4)
    far[:3, 3] = 0, 0, 2 * WITHIN_M
    away = replace(truth, boxes=tuple(replace(b, world_from_box=far @ b.world_from_box) for b in truth.boxes))
    error = box_error(right, street.cameras, away, fit_similarity(right.cameras, truth.cameras))
    assert error is not None
    assert error.pairs == 0


def test_a_truth_without_boxes_says_nothing(right: Scene, street: DriveTruth) -> None:
    truth = replace(Truth.of(street), boxes=())
    assert box_error(right, street.cameras, truth, fit_similarity(right.cameras, truth.cameras)) is None
