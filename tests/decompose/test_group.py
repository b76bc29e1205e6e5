from dataclasses import replace

import numpy as np
import torch

from dreamdrive.decompose import ActorOptions, GroupOptions, find_actors, group
from dreamdrive.decompose.group import _successive
from dreamdrive.fit import SeedOptions, initialise
from tests.rigs import rig_clip
from tests.streets import small_street, street_clip, true_geometry

REACH_PX = SeedOptions().reach_px


def scene(**changes):
    street = small_street(size=(160, 96), **changes)
    clip, geometry = street_clip(street), true_geometry(street)
    return street, clip, geometry, initialise(clip, geometry, SeedOptions())


def test_the_majority_of_a_cluster_decides_for_all_of_it():
    _, clip, geometry, seeds = scene()
    truth = seeds.features[:, 0] >= 0.5
    generator = torch.Generator().manual_seed(0)
    doubt = torch.rand(len(seeds), generator=generator)
    # One member in four of the moving thing scores below the threshold, but is no certain street either.
    scores = torch.where(truth, torch.where(doubt < 0.25, 0.3, 0.9), torch.tensor(0.05))
    grouping = group(clip, geometry, seeds, scores, GroupOptions(), REACH_PX)
    assert (grouping.dynamic == truth).float().mean() > 0.995
    alone = group(clip, geometry, seeds, scores, GroupOptions(clusters="none"), REACH_PX)
    assert (alone.dynamic[truth]).float().mean() < 0.8


def test_scattered_false_alarms_are_outvoted():
    _, clip, geometry, seeds = scene(movers=0)
    generator = torch.Generator().manual_seed(0)
    scores = torch.where(torch.rand(len(seeds), generator=generator) < 0.004, 0.9, 0.05)
    assert not group(clip, geometry, seeds, scores, GroupOptions(), REACH_PX).dynamic.any()


def test_one_car_is_one_actor_whose_track_is_the_cars():
    street, clip, geometry, seeds = scene()
    scores = seeds.features[:, 0].clone()
    grouping = group(clip, geometry, seeds, scores, GroupOptions(), REACH_PX)
    whole = find_actors(clip, geometry, seeds, grouping, ActorOptions(), REACH_PX)
    assert len(whole.actors) == 1
    box = next(b for b in street.boxes if b.moving)
    moved = box.world_from_box[-1, :3, 3] - box.world_from_box[0, :3, 3]
    track = whole.tracks.translation_m[0]
    assert np.linalg.norm((track[-1] - track[0]) - moved) < 0.15 * max(1.0, np.linalg.norm(moved))


def test_copies_of_one_car_lie_on_top_of_each_other():
    """Every frame seeds its own copy; merged, they are as compact as one car, not a trail."""
    _, clip, geometry, seeds = scene()
    grouping = group(clip, geometry, seeds, seeds.features[:, 0].clone(), GroupOptions(), REACH_PX)
    whole = find_actors(clip, geometry, seeds, grouping, ActorOptions(), REACH_PX)
    centres = [
        whole.gaussians.means[whole.gaussians.source_frame == frame].median(dim=0).values
        for frame in range(len(clip))
    ]
    spread = torch.stack(centres).std(dim=0).max()
    raw = seeds.select(grouping.dynamic)
    trail = torch.stack([raw.means[raw.source_frame == f].median(dim=0).values for f in range(len(clip))])
    assert spread < 0.25
    assert spread < 0.2 * trail.std(dim=0).max()


def test_what_has_no_track_lives_as_long_as_is_asked():
    _, clip, geometry, seeds = scene()
    grouping = group(clip, geometry, seeds, seeds.features[:, 0].clone(), GroupOptions(), REACH_PX)
    options = ActorOptions(least_frames=100, untracked_frames=2.0)
    whole = find_actors(clip, geometry, seeds, grouping, options, REACH_PX)
    interval_s = float(np.median(np.diff(clip.times_s[~clip.held_out])))
    assert whole.tracks is None
    torch.testing.assert_close(whole.gaussians.means, seeds.select(grouping.dynamic).means)
    torch.testing.assert_close(
        whole.gaussians.lifespan[:, 1], torch.full((len(whole.gaussians),), 2 * interval_s)
    )


def test_nothing_dynamic_gives_no_actors():
    _, clip, geometry, seeds = scene()
    grouping = group(clip, geometry, seeds, torch.zeros(len(seeds)), GroupOptions(), REACH_PX)
    whole = find_actors(clip, geometry, seeds, grouping, ActorOptions(), REACH_PX)
    assert len(whole.gaussians) == 0
    assert whole.actors == ()
    assert whole.tracks is None


def test_a_cluster_without_a_core_is_street():
    """Foliage that a short fit gets wrong everywhere a little crosses tau, yet nothing in it is certain."""
    _, clip, geometry, seeds = scene(movers=0)
    lukewarm = torch.full((len(seeds),), 0.45)
    assert not group(clip, geometry, seeds, lukewarm, GroupOptions(), REACH_PX).dynamic.any()
    assert group(clip, geometry, seeds, lukewarm, GroupOptions(core=0.0), REACH_PX).dynamic.any()


def test_a_shadow_stays_on_the_road_and_its_car_moves_on():
    """The scores of a car and of the road around its wheels are alike; the road is told by its height."""
    _, clip, geometry, seeds = scene()
    car = seeds.features[:, 0] >= 0.5
    above_m = geometry.ground.height_m(seeds.means.numpy().astype(np.float64))
    places = seeds.means[car]
    away = torch.stack([(places - mean).norm(dim=1).min() for mean in seeds.means])
    shadow = ~car & (away < 1.0) & torch.from_numpy(above_m < 0.05)
    assert shadow.sum() > 50
    scores = torch.where(car | shadow, 0.9, 0.05)
    apart = group(clip, geometry, seeds, scores, GroupOptions(), REACH_PX)
    assert apart.dynamic[shadow].float().mean() < 0.2
    assert apart.dynamic[car].float().mean() > 0.9
    together = group(clip, geometry, seeds, scores, GroupOptions(road=None), REACH_PX)
    assert together.dynamic[shadow].float().mean() > 0.9
    nowhere = group(clip, replace(geometry, ground=None), seeds, scores, GroupOptions(), REACH_PX)
    assert (nowhere.dynamic == together.dynamic).all()


def test_labels_are_handed_on_within_each_camera() -> None:
    clip = rig_clip()
    assert _successive(clip)[:6] == [(None, 0), (0, 2), (2, 6), (6, 8), (8, 10), (None, 1)]
