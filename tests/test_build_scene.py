"""From nouns to a scene, with what is known already in place of what would be found."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from dreamdrive import Given, build, build_scene, options
from dreamdrive.decompose import Grouping
from dreamdrive.fit import FitOptions, Trial, initialise
from dreamdrive.progress import Work, call
from dreamdrive.scene.clip import Known
from dreamdrive.splat import render_scene
from dreamdrive.vision.residual import residual_of
from tests.streets import small_street, street_clip, true_geometry

DRAFT = options.QUALITIES["draft"]
TINY = replace(
    DRAFT,
    knowledge="none",
    static=FitOptions(steps=4),
    score=replace(DRAFT.score, steps=4),
    fit=FitOptions(steps=4),
)


def test_what_is_given_takes_the_place_of_its_stage_and_each_stage_goes_through_run() -> None:
    street = small_street(frames=6)
    clip, geometry = street_clip(street, hold_out=4), true_geometry(street)
    made: dict[str, object] = {}

    def noted(name, options, compute, **chosen):
        made[name] = call(name, options, compute, **chosen)
        return made[name]

    scene = build_scene(clip, TINY, given=Given(geometry=geometry), run=noted).scene
    assert scene.residual is not None
    shown = render_scene(scene, scene.cameras[1], float(scene.times_s[1])).colour.numpy()
    np.testing.assert_array_equal(scene.residual[1], residual_of(shown, clip.frames[1]))
    assert list(made) == ["look", "geometry", "initialise", "static", "score", "group", "fit"]
    assert made["geometry"] is geometry
    assert scene is made["fit"]
    count = len(made["initialise"])  # type: ignore[arg-type]
    half = torch.arange(count) % 2 == 0
    labels = Grouping(half, torch.where(half, 0, -1))
    known = Given(geometry, made["static"], labels)  # type: ignore[arg-type]
    # All copies are kept: what other frames see past would go.
    kept = replace(TINY, cast=replace(TINY.cast, carve=False))
    again = build_scene(clip, kept, given=known, run=noted).scene
    assert made["group"] is labels
    assert len(again.dynamic) == int(half.sum())
    tracks = replace(TINY.cast, tracks=False)
    still = build_scene(clip, replace(TINY, cast=tracks), given=known).scene
    assert still.actors == ()


def test_the_same_clip_and_options_give_the_same_scene() -> None:
    street = small_street(frames=6)
    clip, given = street_clip(street, hold_out=4), Given(true_geometry(street))
    static = replace(TINY, representation="static")
    one, other = (build_scene(clip, static, given=given).scene for _ in range(2))
    assert torch.equal(one.static.means, other.static.means)
    assert Work().keep("part", lambda: 3) == 3


def test_a_street_that_was_drawn_from_its_depth_never_drifts(monkeypatch: pytest.MonkeyPatch) -> None:
    street = small_street(frames=6)
    clip, geometry = street_clip(street, hold_out=4), true_geometry(street)
    monkeypatch.setattr(build, "stands", lambda *_: False)
    assert build_scene(clip, TINY, given=Given(geometry)).scene.moves_per_frame
    poses = np.stack([each.world_from_camera for each in geometry.cameras])
    known = Known(poses, depth_m=street.depth_m, generated=True)
    assert not build_scene(replace(clip, known=known), TINY, given=Given(geometry)).scene.moves_per_frame


@pytest.mark.parametrize("verdict", [True, False])
def test_frames_are_asked_once_whether_the_street_stands(
    monkeypatch: pytest.MonkeyPatch, verdict: bool
) -> None:
    street = small_street(frames=4)
    clip, geometry = street_clip(street), true_geometry(street)
    seeds = initialise(clip, geometry, TINY.seeds)
    labels = Grouping(torch.zeros(len(seeds), dtype=torch.bool), torch.full((len(seeds),), -1))
    no_error = np.zeros((0, 1, 1), dtype=np.float32)
    found, asked = Trial(clip, (), no_error, no_error > 0), list[bool]()
    monkeypatch.setattr(build, "trial", lambda *_: asked.append(True))
    monkeypatch.setattr(build, "better_depth", lambda _, geometry, *__: (geometry, found))
    monkeypatch.setattr(build, "stands", lambda *_: verdict)
    chosen = build._as_frames_say(clip, geometry, TINY, 0)
    assert asked == []
    assert build._per_frame_street(clip, chosen, seeds, labels, TINY, 0) is None
    # A path that was calmed is another one; so is what was found under other options.
    assert (chosen.stands, asked) == ((True, []) if verdict else (None, [True]))
    assert build._unasked(chosen).stands is None


def test_each_of_several_drives_gets_the_steps_of_one() -> None:
    street = small_street(frames=6)
    clip, given = street_clip(street, hold_out=4), Given(true_geometry(street))
    two = replace(clip, rig=clip.rig * 2, known=replace(clip.known, shared_first=True))
    asked: dict[str, Any] = {}

    def noted(name, options, compute, **chosen):
        asked[name] = options
        return call(name, options, compute, **chosen)

    build_scene(two, replace(TINY, representation="static"), given=given, run=noted)
    assert asked["static"][0].steps == 2 * TINY.static.steps
    assert asked["fit"][1].steps == 2 * TINY.fit.steps


def test_longer_clips_take_more_steps() -> None:
    chosen = replace(DRAFT, static=replace(DRAFT.static, steps=75, least_visits=3.0))
    assert chosen.for_frames(24).static.steps == 75
    assert chosen.for_frames(40).static.steps == 120
    assert chosen.for_frames(24, drives=2).static.steps == 150
