"""What is said before the work."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive.data import read_clip
from dreamdrive.data.pictures.video_writer import write_video
from dreamdrive.data.planned import Planned
from dreamdrive.errors import InputError
from dreamdrive.options import QUALITIES
from dreamdrive.prior import Input, choose_prior
from dreamdrive.prior.replay import REPLAY
from dreamdrive.run.report.cost import (
    announcement,
    announcement_of_gpu,
    bytes_of,
    check_memory,
    fit_of,
    seconds_of,
)
from dreamdrive.scene.control import Control

CLIP = Planned(24, 1, (480, 270), 10.0, 0, 1, chosen=True)

# Frames, size, quality, seconds of one core, megabytes: runs of PandaSet 002. To those of "draft" are added
# the seconds of the steps that it takes since, measured beside runs without these.
RUNS = [
    (12, (320, 180), "draft", 18.9, 846),
    (24, (320, 180), "draft", 36.2, 967),
    (60, (320, 180), "draft", 75.3, 1194),
    (24, (480, 270), "draft", 67.1, 1309),
    (24, (320, 180), "standard", 49.6, 996),
    (24, (480, 270), "standard", 96.8, 1349),
]


@pytest.mark.parametrize("run", RUNS)
def test_estimates_meet_what_was_measured(run: tuple) -> None:
    frames, size, quality, seconds, megabytes = run
    planned = replace(CLIP, frames=frames, size=size)
    assert seconds_of(planned, QUALITIES[quality], 1) == pytest.approx(seconds, rel=0.2)
    assert bytes_of(planned) / 1e6 == pytest.approx(megabytes, rel=0.15)


def test_more_cores_are_quicker_and_more_steps_slower() -> None:
    one, two, many = (seconds_of(CLIP, QUALITIES["standard"], cores) for cores in (1, 2, 64))
    assert one > two > many > one / 4
    assert seconds_of(CLIP, QUALITIES["high"], 2) > 2.5 * two
    assert seconds_of(CLIP, replace(QUALITIES["standard"], representation="deformable"), 2) > 1.3 * two


def test_a_short_clip_gets_one_line() -> None:
    assert announcement(CLIP, QUALITIES["draft"], 2) == (
        "24 frames at 480x270 take about 45 s on 2 cores, and 1.3 GB of memory",
    )


def test_a_long_clip_that_nobody_shortened_gets_a_cheaper_choice() -> None:
    long = replace(CLIP, frames=160, rate_hz=25.0, size=(480, 270), chosen=False)
    first, second = announcement(long, QUALITIES["standard"], 1)
    assert first == "160 frames at 480x270 take about 9 min on 1 core, and 4.8 GB of memory"
    assert second == ("That is a long clip: --frames 0:142:3 takes 48 of its frames, in about 2 min 30 s")
    assert len(announcement(replace(long, chosen=True), QUALITIES["standard"], 1)) == 1
    assert len(announcement(replace(long, frames=60), QUALITIES["standard"], 1)) == 1


def test_what_is_left_out_of_too_many_frames_is_said_first() -> None:
    thinned = replace(CLIP, frames=700, rate_hz=25.0, step=4, chosen=False)
    first, _, third = announcement(thinned, QUALITIES["standard"], 1)
    assert first == "There are more than 1000 frames: every 4th one is taken. Choose others with --frames."
    assert third.startswith("That is a long clip: --frames 0:142:3 takes 48 of its frames")
    assert len(announcement(replace(thinned, chosen=True), QUALITIES["standard"], 1)) == 1


def test_the_fits_of_a_run_are_estimated_for_a_gpu() -> None:
    """README's street, of 24 frames at 320x192, has 80,702 Gaussians: at least 0.05 of its pixels."""
    standard = QUALITIES["standard"]
    small = fit_of(replace(CLIP, size=(320, 192)), standard)
    assert 0.8 * 80_702 < small.gaussians < 80_702
    assert 0 < small.moving < 0.1 * small.gaussians
    rig = Planned(24, 6, (1600, 900), 12.0, 0, 1, chosen=True)
    assert announcement_of_gpu(rig, standard) == (
        "24 frames of each of 6 cameras at 1600x900 take at least 10.6 GB of the GPU, with about 10,000,000 "
        "Gaussians"
    )
    every = fit_of(rig, replace(standard, representation="deformable"))
    assert every.moving == every.gaussians == fit_of(rig, standard).gaussians
    sparse = replace(standard, seeds=replace(standard.seeds, stride_px=4))
    assert 4 * fit_of(rig, sparse).gaussians == pytest.approx(every.gaussians, rel=1e-5)
    assert fit_of(replace(rig, frames=96), standard).gaussians == pytest.approx(2 * every.gaussians, rel=1e-5)


def test_what_memory_cannot_hold_is_refused_with_what_fits() -> None:
    check_memory(CLIP, None)
    check_memory(CLIP, 2_000_000_000)
    with pytest.raises(InputError) as caught:
        check_memory(replace(CLIP, frames=1000, chosen=False), 12_000_000_000)
    assert str(caught.value) == (
        "1000 frames at 480x270 need about 26.6 GB of memory, and 12.0 GB are free; give --frames 0:438 or "
        "--size 316x178"
    )
    check_memory(replace(CLIP, frames=438), 12_000_000_000)
    check_memory(replace(CLIP, frames=1000, size=(316, 178)), 12_000_000_000)
    with pytest.raises(InputError) as caught:
        check_memory(CLIP, 300_000_000)
    assert str(caught.value) == (
        "24 frames at 480x270 need about 1.3 GB of memory, and 0.3 GB are free; free some memory, or give a "
        "smaller --size"
    )


def test_a_recording_is_planned_without_reading_it(tmp_path: Path) -> None:
    frames = np.zeros((9, 64, 96, 3), np.uint8)
    write_video(tmp_path / "clip.mp4", iter(frames), 25.0)
    assert REPLAY.open(Control(tmp_path / "clip.mp4")).plan == Planned(
        9, 1, (96, 64), 25.0, 0, 1, chosen=False
    )
    chosen = REPLAY.open(Control(tmp_path / "clip.mp4", frames="1:8:2", size=(48, 32), fps=5)).plan
    assert chosen == Planned(4, 1, (48, 32), 5, 1, 2, chosen=True)
    folder = tmp_path / "images"
    folder.mkdir()
    for i in range(3):
        cv2.imwrite(str(folder / f"{i}.png"), frames[i])
    assert REPLAY.open(Control(folder)).plan == Planned(3, 1, (96, 64), None, 0, 1, chosen=False)
    assert REPLAY.open(Control(folder, frames="5:")).plan is None
    assert Input(choose_prior("vista"), Control(folder), None).plan is None


def test_a_drawn_street_is_planned() -> None:
    prior = choose_prior("street-world")
    assert prior.open(Control()).plan == Planned(24, 1, (320, 192), None, 0, 1, chosen=True)
    drawn = prior.open(Control(frames="2:12:2", size=(64, 40))).plan
    assert drawn == Planned(5, 1, (64, 40), None, 2, 2, chosen=True)


def test_frames_that_memory_cannot_hold_are_not_all_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for i in range(4):
        cv2.imwrite(str(tmp_path / f"{i}.png"), np.zeros((40, 64, 3), np.uint8))
    monkeypatch.setattr("dreamdrive.data.pictures.sampler.free_bytes", lambda: 3 * 8 * 64 * 40)
    with pytest.raises(InputError) as caught:
        read_clip(tmp_path)
    assert str(caught.value) == (
        f"{tmp_path}: more than 3 frames of 64x40 are selected, too many to hold in memory; choose some with "
        "--frames START:STOP:STEP, or give a smaller --size"
    )
