"""A per-frame street, on a wall that slides through a picture whose camera is said to drive ahead."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
import torch

from dreamdrive import Given, build_scene, options
from dreamdrive.decompose import (
    PerFrameOptions,
    outside,
    per_frame_street,
    pixels_of,
    stands,
    with_between,
    without_sky,
)
from dreamdrive.fit import FitOptions, SeedOptions, initialise
from dreamdrive.run.report.held_out import score_baselines, score_scene
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.geometry import Focal, Geometry, Scale

FRAMES, WIDTH, HEIGHT = 8, 96, 64
DEPTH_M, FOCAL_PX, SLIDE_PX, INTERVAL_S = 10.0, 80.0, 3, 0.1


def wall(step_m: float = 0.5, held_out: int | None = 4) -> tuple[Clip, Geometry]:
    """Frames in which a wall slides to the left, and a camera that is said to come nearer to it."""
    noise = np.random.default_rng(0).uniform(0, 255, (HEIGHT, WIDTH + SLIDE_PX * FRAMES, 3))
    texture = cv2.normalize(cv2.GaussianBlur(noise, (0, 0), 1.5), np.empty(0), 0, 255, cv2.NORM_MINMAX)
    frames = [texture[:, SLIDE_PX * k : SLIDE_PX * k + WIDTH].astype(np.uint8) for k in range(FRAMES)]
    camera = Camera(FOCAL_PX, FOCAL_PX, WIDTH / 2, HEIGHT / 2, WIDTH, HEIGHT)
    poses = np.tile(np.eye(4), (FRAMES, 1, 1))
    poses[:, 2, 3] = step_m * np.arange(FRAMES)
    shape = (FRAMES, HEIGHT, WIDTH)
    clip = Clip(
        frames=np.stack(frames),
        times_s=INTERVAL_S * np.arange(FRAMES),
        camera=np.zeros(FRAMES, dtype=np.int64),
        rig=(camera,),
        valid=np.ones(shape, dtype=bool),
        held_out=np.arange(FRAMES) == held_out,
        source_index=np.arange(FRAMES),
        features={"appearance": np.stack(frames).astype(np.float32) / 255 - 0.5},
        known=Known(intrinsics=True),
    )
    geometry = Geometry(
        cameras=tuple(camera.at(pose) for pose in poses),
        depth_m=np.full(shape, DEPTH_M, np.float32),
        confidence=np.ones(shape, np.float32),
        sky=np.zeros(shape, dtype=bool),
        moving=np.zeros(shape, np.float32),
        fixed_regions=np.zeros((1, HEIGHT, WIDTH), dtype=np.int64),
        region_names=(),
        ground=None,
        scale=Scale("poses", 0.0),
        focal=Focal(FOCAL_PX, True),
    )
    return clip, geometry


def test_a_street_stands_where_it_predicts_frames_as_well_as_those_beside() -> None:
    clip, _ = wall(held_out=4)
    every = np.ones((1, HEIGHT, WIDTH), dtype=bool)
    options = PerFrameOptions(margin_db=0.0)

    def stand(error: float, solid: np.ndarray = every, options: PerFrameOptions = options) -> bool:
        return stands(clip, (4,), np.full(solid.shape, error, np.float32), solid, options)

    assert stand(0.0)
    assert not stand(0.3)
    # With nothing that counts, nothing speaks against it.
    assert stand(0.3, ~every)
    # A street that is a little behind the frames beside each frame stands, as far as the margin goes.
    reached = next(error for error in np.geomspace(1e-5, 0.3, 800) if not stand(float(error)))
    ahead = replace(options, margin_db=1.0)
    assert stand(reached * 10 ** (0.9 / 20), options=ahead)
    assert not stand(reached * 10 ** (1.1 / 20), options=ahead)
    # No street of single frames shows a picture to the last digit.
    assert stand(10 ** (-35 / 20), options=replace(options, finest_db=34.0))


def test_frames_between_are_those_of_the_picture_in_motion() -> None:
    """On a wall that slides by 3 px a frame the frame between is shifted by half of that."""
    clip, geometry = wall(held_out=4)
    denser, seen = with_between(clip, geometry)
    assert len(denser) == len(clip) + 6
    assert (np.diff(denser.times_s) >= 0).all()
    assert len(seen.cameras) == len(denser) == len(seen.depth_m)
    assert not seen.depth_m[denser.held_out == 0].all()
    # Between 3 and 5 the frame is where the withheld one is, and looks like it without having seen it.
    at = int(np.flatnonzero(np.isclose(denser.times_s, clip.times_s[4]) & ~denser.held_out)[0])
    inner = slice(8, -8), slice(20, -20)
    apart = denser.frames[at][inner].astype(float) - clip.frames[4][inner]
    assert np.abs(apart).mean() < 6
    place = seen.cameras[at].world_from_camera[:3, 3]
    assert place == pytest.approx(geometry.cameras[4].world_from_camera[:3, 3])
    assert not np.array_equal(denser.frames[at], clip.frames[4])


def test_the_sky_of_single_frames_is_a_surface_far_away() -> None:
    _, geometry = wall()
    sky = np.zeros(geometry.sky.shape, dtype=bool)
    sky[:, :10] = True
    found = without_sky(replace(geometry, sky=sky, depth_m=np.where(sky, 0, geometry.depth_m)), 250.0)
    assert not found.sky.any()
    assert (found.depth_m[sky] == 250).all()
    assert (found.depth_m[~sky] == DEPTH_M).all()


def test_seeds_move_as_the_picture_does() -> None:
    """Of a wall that keeps its distance, at 3 px a frame; the camera comes along at 5 m/s."""
    clip, geometry = wall()
    seeds = initialise(clip, replace(geometry, moving=np.ones_like(geometry.moving)), SeedOptions())
    street = per_frame_street(clip, geometry, seeds, PerFrameOptions(lifespan_frames=2.0))
    assert street.velocity is not None
    assert street.lifespan is not None
    inner = torch.from_numpy(np.abs(pixels_x(geometry, seeds) - WIDTH / 2) < WIDTH / 3)
    wanted = torch.tensor([-SLIDE_PX / FOCAL_PX * DEPTH_M / INTERVAL_S, 0.0, 0.5 / INTERVAL_S])
    found = street.velocity[inner].median(dim=0).values
    assert found.tolist() == pytest.approx(wanted.tolist(), abs=0.2)
    assert street.lifespan[:, 0].tolist() == pytest.approx(
        clip.times_s[seeds.source_frame.numpy()].tolist(), abs=1e-6
    )
    assert street.lifespan[:, 1].unique().tolist() == pytest.approx([2 * INTERVAL_S])
    assert 4 not in street.source_frame


def pixels_x(geometry: Geometry, seeds) -> np.ndarray:
    columns = np.zeros(len(seeds))
    for frame, camera in enumerate(geometry.cameras):
        rows = seeds.source_frame.numpy() == frame
        columns[rows] = camera.project(seeds.means.numpy()[rows].astype(np.float64))[:, 0]
    return columns


def test_pixels_of_seeds_are_where_they_came_from() -> None:
    clip, geometry = wall()
    seeds = initialise(clip, replace(geometry, moving=np.ones_like(geometry.moving)), SeedOptions())
    every = np.arange(len(seeds))
    mask = pixels_of(geometry, seeds, every[seeds.source_frame.numpy() == 2], 1)
    assert mask[2, 2:-2, 2:-2].all()
    assert not np.delete(mask, 2, axis=0).any()
    assert torch.equal(outside(geometry, seeds, mask), seeds.source_frame != 2)


def test_a_path_that_explains_nothing_leaves_a_per_frame_street() -> None:
    """It predicts the withheld frame about as well as blending does; standing it cannot."""
    clip, geometry = wall()
    draft = options.QUALITIES["draft"]
    few = {"static": FitOptions(steps=40), "fit": FitOptions(steps=60)}
    draft = replace(draft, knowledge="none", seeds=replace(draft.seeds, stride_px=6), **few)
    scenes = {
        allowed: build_scene(
            clip, replace(draft, drift=PerFrameOptions(allowed=allowed)), given=Given(geometry=geometry)
        ).scene
        for allowed in (True, False)
    }
    assert scenes[True].moves_per_frame
    assert not scenes[False].moves_per_frame
    psnr = {allowed: score_scene(clip, geometry, scene)[4].psnr for allowed, scene in scenes.items()}
    blended = score_baselines(clip, geometry)["flow_interpolation"][4].psnr
    assert psnr[True] > psnr[False] + 10
    assert psnr[True] > blended - 3
