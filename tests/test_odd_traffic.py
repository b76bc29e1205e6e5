"""Traffic that a scene is hard to make of: everything moves, glimpses, cars that touch or come back."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose

from dreamdrive import Control, Given, build_scene, options
from dreamdrive.decompose import Grouping, GroupOptions, find_actors, find_path, group, source_pixels
from dreamdrive.fit import FitOptions, initialise
from dreamdrive.run.report.document import describe
from dreamdrive.run.report.outcome import lines_of, outcome_of
from dreamdrive.run.request import request_of
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive.splat import render_scene
from dreamdrive.street_network import NO_KNOWLEDGE
from tests.streets import car, small_street, street_clip, traffic, true_geometry, true_labels

DRAFT = options.QUALITIES["draft"]
FEW = FitOptions(steps=4)
# After so few steps a street explains nothing; that it then drifts is tested elsewhere.
STANDS = replace(DRAFT.drift, allowed=False)
TINY = replace(
    DRAFT,
    knowledge=NO_KNOWLEDGE,
    static=FEW,
    score=replace(DRAFT.score, steps=4),
    fit=FEW,
    drift=STANDS,
)
REACH_PX = TINY.seeds.reach_px
DOCUMENT = request_of(Control(), prior="street-world", options=TINY).document
ALL_MOVES = "everything in the clip counts as moving: "


def report_of(clip: Clip, geometry: Geometry, scene: Scene) -> dict[str, Any]:
    """What a run that ended with this scene would report."""
    return describe(clip, geometry, scene, {**DOCUMENT, "input": None}, {}, {}, {}, {})


def lines(report: dict[str, Any]) -> tuple[str, ...]:
    return lines_of(outcome_of(report, "report.json", already_finished=False))


def assert_sane(scene: Scene) -> None:
    """Finite, of plausible things, and each of these can be taken out and steered."""
    for part in (scene.static, scene.dynamic):
        for name, value in part.tensors().items():
            assert torch.isfinite(value).all(), name
    for t_s in scene.times_s.tolist():
        assert torch.isfinite(render_scene(scene, scene.cameras[0], t_s).colour).all()
    for actor in scene.actors:
        assert actor.count == int((scene.dynamic.actor == actor.id).sum()) > 0
        assert np.isfinite(actor.track.positions_m).all()
        assert np.abs(actor.track.positions_m).max() < 200
        assert actor.track.speed_m_s.max() < TINY.cast.placing.most_m_s
        assert actor.box is not None
        assert 0.1 <= actor.box.size_m.min() <= actor.box.size_m.max() < 40
        assert_edits(scene, actor.id)


def assert_edits(scene: Scene, id: int) -> None:
    actor = scene.actor(id)
    t_s, places_m = actor.track.first_s, actor.track.positions_m
    less = scene.without(id)
    assert len(less.dynamic) == len(scene.dynamic) - actor.count
    assert [each.id for each in less.actors] == [each.id for each in scene.actors if each.id != id]
    assert torch.isfinite(render_scene(less, less.cameras[0], t_s).colour).all()
    aside = scene.with_track(id, replace(actor.track, positions_m=places_m + np.array([1.0, 0, 0])))
    own = scene.dynamic.select(torch.nonzero(scene.dynamic.actor == id).squeeze(1)).without_features()
    assert scene.deformation is not None
    assert aside.deformation is not None
    before, after = (each.deformation.apply_at(own, t_s).means for each in (scene, aside))
    assert_allclose((after - before).mean(dim=0), [1, 0, 0], atol=0.05)


def seeded(street: DriveTruth) -> tuple[Clip, Geometry, Gaussians]:
    clip, geometry = street_clip(street), true_geometry(street)
    return clip, geometry, initialise(clip, geometry, TINY.seeds)


@pytest.fixture(scope="module")
def nothing_stands() -> tuple[Clip, Geometry, Gaussians]:
    """A street of which every pixel with depth counts as moving."""
    street = small_street(frames=6)
    clip, geometry = street_clip(street, hold_out=4), true_geometry(street)
    geometry = replace(geometry, moving=(geometry.depth_m > 0).astype(np.float32))
    return clip, geometry, initialise(clip, geometry, TINY.seeds)


def test_where_all_pixels_move_a_scene_is_built_and_the_report_says_so(nothing_stands) -> None:
    clip, geometry, _ = nothing_stands
    scene = build_scene(clip, TINY, given=Given(geometry=geometry)).scene
    assert_sane(scene)
    report = report_of(clip, geometry, scene)
    assert any(reason.startswith(ALL_MOVES) for reason in report["rough"])
    assert any(ALL_MOVES in line for line in lines(report))
    assert report["limits"][1].startswith("views beside the recorded path cannot be trusted here")


@pytest.mark.parametrize("clusters", ["flow", "density", "none"])
def test_where_all_seeds_score_as_moving_the_road_stays_or_all_of_it_goes(nothing_stands, clusters) -> None:
    clip, geometry, seeds = nothing_stands
    chosen = GroupOptions(clusters=clusters)
    labels = group(clip, geometry, seeds, torch.ones(len(seeds)), chosen, REACH_PX)
    low = geometry.ground.height_m(seeds.means.numpy().astype(np.float64)) < 0.05
    # Of the road only what the outline of an upright thing surrounds goes with it, see ``on_road``.
    assert labels.dynamic[low].float().mean() == pytest.approx(0 if clusters == "flow" else 1, abs=0.01)
    scene = build_scene(clip, TINY, given=Given(geometry=geometry, labels=labels)).scene
    assert len(scene.without_filled().static) == int((~labels.dynamic).sum())
    assert_sane(scene)


@pytest.mark.parametrize("clusters", ["one", "of each frame"])
def test_without_any_static_gaussian_a_scene_is_built_and_the_report_says_so(
    nothing_stands, clusters
) -> None:
    clip, geometry, seeds = nothing_stands
    number = torch.zeros(len(seeds), dtype=torch.int64) if clusters == "one" else seeds.source_frame
    labels = Grouping(torch.ones(len(seeds), dtype=torch.bool), number)
    scene = build_scene(clip, TINY, given=Given(geometry=geometry, labels=labels)).scene
    assert len(scene.static) == 0
    assert_sane(scene)
    assert len(scene.actors) == (1 if clusters == "one" else 0)
    # The scene says it, too, where the frames' own evidence does not.
    report = report_of(clip, replace(geometry, moving=np.zeros_like(geometry.moving)), scene)
    assert any(reason.startswith(ALL_MOVES) for reason in report["rough"])
    assert ("all of it free to move" in lines(report)[0]) == (clusters == "of each frame")


def test_at_times_at_which_nothing_is_seen_a_scene_without_street_is_sky(nothing_stands) -> None:
    clip, geometry, _ = nothing_stands
    first = (np.arange(len(clip)) == 0)[:, None, None]
    geometry = replace(geometry, depth_m=geometry.depth_m * first, confidence=geometry.confidence * first)
    seeds = initialise(clip, geometry, TINY.seeds)
    labels = Grouping(torch.ones(len(seeds), dtype=torch.bool), torch.zeros(len(seeds), dtype=torch.int64))
    scene = build_scene(clip, TINY, given=Given(geometry=geometry, labels=labels)).scene
    assert_sane(scene)
    alpha = [float(render_scene(scene, scene.cameras[0], t_s).alpha.max()) for t_s in scene.times_s.tolist()]
    assert alpha[0] > 0.5
    assert alpha[-1] == 0


def test_where_much_stands_nothing_of_that_is_said() -> None:
    street = small_street(frames=6)
    clip, geometry = street_clip(street), true_geometry(street)
    static = replace(TINY, representation="static")
    still = build_scene(clip, static, given=Given(geometry=geometry)).scene
    report = report_of(clip, geometry, still)
    assert not any(reason.startswith(ALL_MOVES) for reason in report["rough"])
    assert report["notes"] == []
    # Where everything goes through the motion by choice, the scene has no static part and that tells nothing.
    free = replace(still, static=still.dynamic, dynamic=still.static)
    document = {**DOCUMENT, "options": {**DOCUMENT["options"], "representation": "deformable"}, "input": None}
    report = describe(clip, geometry, free, document, {}, {}, {}, {})
    assert not any(reason.startswith(ALL_MOVES) for reason in report["rough"])


ONCE = 0
"""The frame that shows what one frame alone shows."""


@pytest.fixture(scope="module")
def glimpsed() -> tuple[Clip, Geometry, Gaussians, Grouping]:
    """A car that comes past and counts as moving in one frame alone."""
    street = traffic(car("near", [(0, 8, 2.6, np.pi), (2, -52, 2.6, np.pi)]), frames=6)
    clip, geometry = street_clip(street), true_geometry(street)
    once = (np.arange(len(clip)) == ONCE)[:, None, None]
    geometry = replace(geometry, moving=geometry.moving * once)
    seeds = initialise(clip, geometry, TINY.seeds)
    seen = true_labels(street, geometry, seeds).dynamic & (seeds.source_frame == ONCE)
    return clip, geometry, seeds, Grouping(seen, torch.where(seen, 0, -1))


@pytest.mark.parametrize("least_frames", [1, 2])
def test_what_one_frame_shows_has_no_track_and_the_report_says_so(glimpsed, least_frames: int) -> None:
    clip, geometry, _, labels = glimpsed
    chosen = replace(TINY, cast=replace(TINY.cast, least_frames=least_frames))
    scene = build_scene(clip, chosen, given=Given(geometry=geometry, labels=labels)).scene
    count = int(labels.dynamic.sum())
    assert scene.actors == ()
    assert len(scene.dynamic) == count > 30
    assert_sane(scene)
    with pytest.raises(ValueError, match="no actor 0; there are none"):
        scene.without(0)
    dead = scene.dynamic_at(float(clip.times_s[ONCE + 3]))
    assert len(dead) == 0
    report = report_of(clip, geometry, scene)
    assert report["notes"][-1].startswith(f"{count} Gaussians of what moves could not be followed")
    assert "with parts that move and have no track, from" in lines(report)[0]


def test_what_one_frame_shows_can_have_a_known_place(glimpsed) -> None:
    clip, geometry, seeds, labels = glimpsed
    shown = [source_pixels(geometry, seeds, np.flatnonzero(labels.dynamic.numpy()))]
    anywhere = replace(TINY.cast.placing, most_spread_m=1e4)
    path = find_path(clip, geometry, np.array([ONCE]), shown, anywhere, REACH_PX)
    assert path is not None
    moving = find_actors(clip, geometry, seeds, labels, TINY.cast, REACH_PX, known={0: path})
    scene = build_scene(clip, TINY, given=Given(geometry=geometry, labels=labels, tracks=moving)).scene
    assert len(scene.actors) == 1
    assert len(scene.actors[0].track.times_s) == 1
    assert scene.actors[0].track.speed_m_s.tolist() == [0]
    assert_sane(scene)
    assert report_of(clip, geometry, scene)["notes"] == []


TOUCHING = {
    # The one behind has the slower one before it in the picture.
    "one before the other": (
        car("slow", [(0, 14, 0, 0), (2, 26, 0, 0)]),
        car("fast", [(0, 9, 1.9, 0), (2, 39, 1.9, 0)], look=3),
    ),
    "one past the other": (
        car("slow", [(0, 14, -0.92, 0), (2, 26, -0.92, 0)]),
        car("fast", [(0, 12, 0.92, 0), (2, 42, 0.92, 0)], look=3),
    ),
}


@pytest.mark.parametrize("case", TOUCHING)
def test_cars_that_touch_in_the_picture_stay_two(case: str) -> None:
    street = traffic(*TOUCHING[case], frames=8, size=(160, 96))
    clip, geometry, seeds = seeded(street)
    true = true_labels(street, geometry, seeds)
    assert_touching(street)
    labels = group(clip, geometry, seeds, true.dynamic.float(), TINY.group, REACH_PX)
    scene = build_scene(clip, TINY, given=Given(geometry=geometry, labels=labels)).scene
    assert_sane(scene)
    # A thing may come in two parts, but no part is of both.
    for cluster in range(int(labels.cluster.max()) + 1):
        members = true.cluster[labels.cluster == cluster]
        assert members.bincount().max() > 0.9 * len(members)
    gone = {box.id: np.linalg.norm(np.ptp(box.world_from_box[:, :3, 3], axis=0)) for box in street.boxes}
    for length_m in gone.values():
        assert any(abs(actor.track.length_m - length_m) < 0.6 for actor in scene.actors)
    for actor in scene.actors:
        assert min(abs(actor.track.length_m - length_m) for length_m in gone.values()) < 0.6


def assert_touching(street: DriveTruth) -> None:
    """Both are in the picture, with no pixel between them, in some frame."""
    one, other = (street.instance == box.instance for box in street.boxes)
    assert one.any(axis=(1, 2)).all()
    assert other.any(axis=(1, 2)).all()
    beside = (one[:, :, 1:] & other[:, :, :-1]) | (one[:, :, :-1] & other[:, :, 1:])
    assert beside.any()


@pytest.mark.parametrize("road_users", [False, True], ids=["by depth alone", "told apart by the network"])
def test_cars_that_touch_at_one_depth_and_one_speed_are_one_unless_something_tells_them_apart(
    road_users,
) -> None:
    left = car("left", [(0, 14, 0.91, 0), (2, 34, 0.91, 0)])
    right = car("right", [(0, 14, -0.91, 0), (2, 34, -0.91, 0)], look=3)
    street = traffic(left, right, frames=8, size=(160, 96))
    clip, geometry, seeds = seeded(street)
    assert_touching(street)
    if road_users:
        geometry = replace(geometry, road_users=street.instance.astype(np.uint16))
    moves = true_labels(street, geometry, seeds).dynamic
    labels = group(clip, geometry, seeds, moves.float(), TINY.group, REACH_PX)
    scene = build_scene(clip, TINY, given=Given(geometry=geometry, labels=labels)).scene
    assert_sane(scene)
    assert len(scene.actors) == (2 if road_users else 1)
    for actor in scene.actors:
        assert actor.track.length_m == pytest.approx(7, abs=0.5)


@pytest.fixture(scope="module")
def returning() -> tuple[DriveTruth, Clip, Geometry, Gaussians, Grouping]:
    """A car that falls back out of the picture and overtakes again: 20 frames, three without it."""
    points = [(t, 8 + 1.5 * t + 1.1 * t * t, 3.0, 0.0) for t in np.arange(0, 5.3, 0.25).tolist()]
    street = traffic(car("back", points), frames=20, fps=4)
    shown = (street.instance > 0).any(axis=(1, 2))
    assert np.flatnonzero(~shown).tolist() == [9, 10, 11]
    clip, geometry, seeds = seeded(street)
    return street, clip, geometry, seeds, true_labels(street, geometry, seeds)


@pytest.mark.parametrize("known", [True, False], ids=["as one thing", "as what is found"])
def test_what_leaves_the_picture_and_comes_back_keeps_to_its_lane(returning, known: bool) -> None:
    street, clip, geometry, seeds, labels = returning
    if not known:
        labels = group(clip, geometry, seeds, labels.dynamic.float(), TINY.group, REACH_PX)
    scene = build_scene(clip, TINY, given=Given(geometry=geometry, labels=labels)).scene
    assert_sane(scene)
    truth_m = partial(np.interp, xp=street.times_s, fp=street.boxes[0].world_from_box[:, 2, 3])
    assert len(scene.actors) == 1 if known else len(scene.actors) >= 2
    for actor in scene.actors:
        track = actor.track
        assert np.abs(track.positions_m[:, 0] + 3).max() < 0.6
        # Where the border cuts it off, little tells how far ahead it is.
        assert np.abs(track.positions_m[:, 2] - truth_m(track.times_s)).max() < 2.5
    if known:
        gap_s = np.array([2.25, 2.5, 2.75])
        away = scene.actors[0].track.at(gap_s)
        assert np.abs(away.positions_m[:, 2] - truth_m(gap_s)).max() < 2.5
