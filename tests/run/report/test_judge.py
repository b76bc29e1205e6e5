"""What is said of results of every kind, word for word."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.run.report.facts import Facts, facts_of
from dreamdrive.run.report.held_out import Likeness
from dreamdrive.run.report.in_motion import FoundTraffic
from dreamdrive.run.report.judge import aside_m, limits_of, remarks_of, rough_because
from dreamdrive.scene.geometry import Scale
from tests.scene.scenes import make_scene, per_frame_scene
from tests.streets import small_street, street_clip, true_geometry

GOOD = Facts(
    frames=24,
    placed=24,
    interval_s=0.1,
    fallback=None,
    scenes=((0, 46),),
    step=2,
    psnr=28.9,
    blended_psnr=25.6,
    quality="draft",
    focal_observed=True,
    basis="height",
    spread=0.04,
    length_m=20.0,
    seconds=2.0,
    moves=True,
)
PHOTO = replace(GOOD, psnr=None, blended_psnr=None, drawn=True, traffic=FoundTraffic(3, 3, 0.9, 0.9))
BLANK = (
    "nothing in the frames could be followed from one to the next: they are too dark, too plain or too "
    "noisy. The camera counts as standing still. Choose clearer frames with --frames"
)
REFUSED = (
    "the frames did not show clearly how the camera moved; its path is a guess. Choose frames in which the "
    "car drives along a street that is well seen, with --frames, or give the path with --poses"
)
ROUGH = {
    "good": (GOOD, ()),
    "nothing held out": (replace(GOOD, psnr=None, blended_psnr=None), ()),
    "black or noise": (replace(GOOD, fallback="blank"), (BLANK,)),
    "standing": (
        replace(GOOD, fallback="standing"),
        (
            "the camera stands still, which hides how far away things are. Choose frames in which the car "
            "drives, with --frames",
        ),
    ),
    "refused": (replace(GOOD, fallback="refused"), (REFUSED,)),
    "one frame a second": (
        replace(GOOD, fallback="refused", interval_s=1.0),
        (
            "the frames are 1.0 s apart, too far to tell how the camera moved; its path is a guess. Give a "
            "recording with five frames a second or more, or a smaller step in --frames",
        ),
    ),
    "poses of another unit": (
        replace(GOOD, basis="given", against="the camera is 0.16 m above the road, not 1.50 m"),
        (
            "by the poses that were given the camera is 0.16 m above the road, not 1.50 m: their unit is no "
            "metre, or they are not of these frames. Bring their positions to metres, or leave them out",
        ),
    ),
    "too fast": (
        replace(GOOD, length_m=90.0),
        (
            "the car drives 162 km/h, which no street allows: times or metres are wrong. Give the rate of "
            "the frames with --fps, or what metres rest on with --camera-height or --poses",
        ),
    ),
    "stands while its poses wander": (
        replace(GOOD, basis="given", moves=False, length_m=6.0),
        (
            "the frames show a camera that stands, and by the poses that were given it went 6 m. Choose "
            "frames in which the car drives, with --frames, or leave out the poses",
        ),
    ),
    "stands, and so do its poses": (replace(GOOD, basis="given", moves=False, length_m=1.0), ()),
    "a photo": (PHOTO, ()),
    "a photo in which nothing moves": (replace(PHOTO, traffic=FoundTraffic(0, 0, None, None)), ()),
    "traffic of a small photo that is not found again": (
        replace(PHOTO, width=240, traffic=FoundTraffic(4, 0, 0.08, None)),
        (
            "what moves was not found again: 4 things were set in motion in the photo, and nothing was "
            "found, which cover 8% of what moved; the rest is smeared over the street. What helps is larger "
            "frames, such as --size 480x270 or --traffic still, which leaves all in place",
        ),
    ),
    "too much found in a photo": (
        replace(PHOTO, traffic=FoundTraffic(1, 16, 0.9, 0.4)),
        (
            "more was found to move than does: 1 thing was set in motion in the photo, and 16 things were "
            "found; the others are pieces of the street. What helps is a shorter drive, such as --frames "
            "0:12 or render --without ID, which leaves one out",
        ),
    ),
    "many small things found in a photo": (
        replace(PHOTO, frames=10, traffic=FoundTraffic(2, 39, 0.9, 0.85)),
        (
            "more was found to move than does: 2 things were set in motion in the photo, and 39 things were "
            "found; the others are pieces of the street. What helps is render --without ID, which leaves one "
            "out",
        ),
    ),
    "a lorry of a photo in parts": (replace(PHOTO, traffic=FoundTraffic(3, 9, 0.9, 0.9)), ()),
    "three frames": (
        replace(GOOD, frames=3, placed=3),
        ("there are only 3 frames. Give 8 or more, better 24, with --frames or a longer recording",),
    ),
    "two frames": (
        replace(GOOD, frames=2, placed=2, fallback="few"),
        ("there are only 2 frames. Give 8 or more, better 24, with --frames or a longer recording",),
    ),
    "few placed": (
        replace(GOOD, placed=6),
        (
            "only 6 of 24 frames found their place on the path. Choose frames in which the street is well "
            "seen, with --frames",
        ),
    ),
    "cut": (
        replace(GOOD, scenes=((0, 10), (12, 46))),
        (
            "the recording jumps to another place at frame 12, and one scene was made of all. Choose one "
            "place, such as --frames 12:47:2",
        ),
    ),
    "everything moves": (
        replace(GOOD, all_moves=True),
        (
            "everything in the clip counts as moving: no street is left that stands, and views from "
            "elsewhere have nothing to rest on. Choose frames that show more of the street, with --frames",
        ),
    ),
    "worse than blending": (
        replace(GOOD, psnr=21.2, blended_psnr=23.0),
        (
            "held-out frames are predicted worse than by blending the frames beside them (21.2 against 23.0 "
            "dB): --quality standard takes more steps",
        ),
    ),
    "worse although high": (
        replace(GOOD, psnr=21.2, blended_psnr=23.0, quality="high"),
        (
            "held-out frames are predicted worse than by blending the frames beside them (21.2 against 23.0 "
            "dB): a shorter stretch, chosen with --frames, is easier",
        ),
    ),
}
HOLD = "views up to 2 m beside the recorded path hold best; further away gaps show"
HOLD_PHOTO = (
    "views up to 1 m beside the path hold best; further away, and behind what the photo shows, all is made up"
)
METRES = {
    "height given": (GOOD, "from the height of the camera, within 4 %"),
    "height assumed": (
        replace(GOOD, basis="usual height", spread=0.16),
        "they may be off by 16 %, since the camera is taken to be 1.5 m above the road. Give --camera-height",
    ),
    "field of view assumed": (
        replace(GOOD, focal_observed=False, spread=0.35),
        "they may be off by 35 %, since the camera's field of view is a guess. Give --hfov or --intrinsics",
    ),
    "both assumed": (
        replace(GOOD, basis="usual height", focal_observed=False, spread=0.38),
        "they may be off by 38 %, since the camera is taken to be 1.5 m above the road and its field of view "
        "is a guess. Give --camera-height and --hfov or --intrinsics",
    ),
    "a photo": (
        replace(
            PHOTO, basis="seen sizes", spread=0.21, focal_observed=False, source="camera height of 1.2 m"
        ),
        "they may be off by 21 %, since they rest on a camera height of 1.2 m and the camera's field of view "
        "is a guess. Give --camera-height and --hfov or --intrinsics",
    ),
    "a photo, all told": (replace(PHOTO, spread=0.0), "from the height of the camera"),
    "drawn for a path": (
        replace(GOOD, basis="asked path", spread=0.0),
        "those of the path that was asked for; a model drew the frames, and may not have kept to it",
    ),
    "poses": (replace(GOOD, basis="given", spread=0.0), "as given with the input"),
    "depth": (replace(GOOD, basis="given", spread=0.05), "as given with the input, within 5 %"),
    "another unit": (
        replace(GOOD, basis="given", spread=0.0, against="the car drives 80 m/s"),
        "as given with the input, which cannot be right: the car drives 80 m/s",
    ),
    "speed": (
        replace(GOOD, basis="usual speed", spread=0.6),
        "nothing shows them; a speed of 8 m/s is assumed, so that all distances may be off by 60 % or more. "
        "Frames in which the road is well seen help, and --poses",
    ),
    "speed asked for": (
        replace(GOOD, basis="asked speed", spread=0.6),
        "from the speed that was asked for; they may be off by 60 %",
    ),
    "unknown": (
        replace(GOOD, basis="usual depth", spread=np.inf),
        "nothing shows them; a distance of 12 m is assumed, so that all distances may be off by any factor "
        "or more. Frames in which the road is well seen help, and --poses",
    ),
}


@pytest.mark.parametrize("case", ROUGH)
def test_reasons_and_advice(case: str) -> None:
    facts, expected = ROUGH[case]
    assert rough_because(facts) == expected


@pytest.mark.parametrize("case", METRES)
def test_how_sure_metres_are(case: str) -> None:
    facts, expected = METRES[case]
    assert limits_of(facts)[:2] == (expected, HOLD_PHOTO if facts.drawn else HOLD)


DRIVES = {
    "sure": (GOOD, "20 m in 2.0 s, 36 km/h in the mean"),
    "uncertain": (
        replace(GOOD, spread=0.3),
        "20 m in 2.0 s, 36 km/h in the mean: as uncertain as the metres",
    ),
    "assumed": (
        replace(GOOD, basis="usual speed"),
        "20 m in 2.0 s, 36 km/h in the mean: as uncertain as the metres",
    ),
    "wrong": (
        replace(GOOD, basis="given", against="no"),
        "20 m in 2.0 s, 36 km/h in the mean: as uncertain as the metres",
    ),
    "guessed": (
        replace(GOOD, fallback="refused"),
        "20 m in 2.0 s, 36 km/h in the mean: a guess, as the path is one",
    ),
    "one frame": (replace(GOOD, fallback="few", seconds=0.0), "the frames are of one moment"),
    "wandering": (
        replace(GOOD, basis="given", moves=False),
        "20 m in 2.0 s, 36 km/h in the mean: a guess, as the path is one",
    ),
    "standing": (replace(GOOD, fallback="standing", length_m=0.2), "the camera stands for 2.0 s"),
}


@pytest.mark.parametrize("case", DRIVES)
def test_how_far_and_fast_the_car_goes(case: str) -> None:
    facts, expected = DRIVES[case]
    assert limits_of(facts)[2] == expected


@pytest.mark.parametrize(
    ("facts", "metres"),
    [
        (GOOD, 2),
        (PHOTO, 1),
        (replace(GOOD, fallback="standing"), 0),
        (replace(GOOD, scenes=((0, 10), (12, 46))), 0),
        (replace(GOOD, all_moves=True), 0),
        (replace(GOOD, moves_per_frame=True), 0),
        (replace(GOOD, basis="given", moves=False), 0),
    ],
)
def test_how_far_aside_views_can_be_trusted(facts: Facts, metres: float) -> None:
    assert aside_m(facts) == metres


def test_views_aside_are_not_promised_where_distances_are_a_guess() -> None:
    expected = "views beside the recorded path cannot be trusted here, since distances are a guess"
    assert limits_of(replace(GOOD, fallback="blank"))[1] == expected
    assert limits_of(replace(GOOD, scenes=((0, 10), (12, 46))))[1] == expected
    without = "views beside the recorded path cannot be trusted here, since nothing stands"
    assert limits_of(replace(GOOD, all_moves=True))[1] == without
    drifts = "views beside the recorded path show only what one frame saw, with gaps"
    assert limits_of(replace(GOOD, moves_per_frame=True))[1] == drifts


def test_a_street_that_drifts_is_spoken_of() -> None:
    assert "kept as single frames" in remarks_of(per_frame_scene())[0]
    assert not any("single frames" in remark for remark in remarks_of(make_scene()))


def test_facts_are_those_of_the_result() -> None:
    street = small_street(frames=6)
    clip, geometry = street_clip(street), true_geometry(street)
    clip = replace(clip, source_index=10 + 2 * np.arange(6), cuts=(4,))
    found = replace(
        geometry, fallback="words", fallback_kind="blank", placed=5, scale=Scale("x", 0.2, basis="height")
    )
    facts = facts_of(clip, found, "draft", {1: Likeness(20.0, 0.5), 2: Likeness(30.0, 0.5)}, {})
    assert facts.interval_s == pytest.approx(0.1)
    assert facts == Facts(
        frames=6,
        placed=5,
        interval_s=facts.interval_s,
        fallback="blank",
        scenes=((10, 16), (18, 20)),
        step=2,
        psnr=25.0,
        blended_psnr=None,
        quality="draft",
        focal_observed=True,
        basis="height",
        spread=0.2,
        length_m=facts.length_m,
        seconds=facts.seconds,
        source="x",
        width=clip.size[0],
    )
    assert facts.seconds == pytest.approx(0.5)
    path = np.stack([camera.world_from_camera[:3, 3] for camera in geometry.cameras])
    assert facts.length_m == pytest.approx(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    for steps, moves in ((0, False), (1, True)):
        told = replace(geometry, details={"moving_steps": steps})
        assert facts_of(clip, told, "draft", {}, {}).moves is moves
    assert facts_of(clip, geometry, "draft", {}, {}).fallback is None


def test_everything_moves_where_all_but_a_few_pixels_of_the_frames_that_may_be_seen_do() -> None:
    street = small_street(frames=6)
    clip, geometry = street_clip(street, hold_out=4), true_geometry(street)
    solid = (geometry.depth_m > 0).astype(np.float32)
    held_out = clip.held_out[:, None, None]
    # Nobody looks at what moves in held-out frames.
    seen = replace(geometry, moving=np.where(held_out, 0, solid))
    assert facts_of(clip, seen, "draft", {}, {}).all_moves
    most = replace(geometry, moving=solid * (np.arange(solid.shape[2]) % 10 > 0))
    assert not facts_of(clip, most, "draft", {}, {}).all_moves
    assert not facts_of(clip, geometry, "draft", {}, {}).all_moves
    assert facts_of(clip, geometry, "draft", {}, {}, none_stands=True).all_moves
    nowhere = replace(geometry, depth_m=0 * geometry.depth_m)
    assert not facts_of(clip, nowhere, "draft", {}, {}).all_moves


def test_figures_that_look_alike_are_told_apart() -> None:
    said = rough_because(replace(GOOD, psnr=31.98, blended_psnr=32.04))
    assert "(31.98 against 32.04 dB)" in said[0]
    assert "(31.9 against 32.0 dB)" in rough_because(replace(GOOD, psnr=31.9, blended_psnr=32.0))[0]
