"""Features, and the size of the pictures in which they are sought."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from dreamdrive.geometry.evidence import features, find_features, observe, shows_little
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from tests.scene.street.test_look import small_look

WIDTH, HEIGHT, FRAMES = 480, 240, 3


def noise_clip(traffic: float) -> Clip:
    """Smooth noise that moves to the right by 2 px a frame; traffic fills a share of it from the left on."""
    rng = np.random.default_rng(0)
    coarse = rng.integers(0, 255, (HEIGHT // 8, WIDTH // 8 + 1), np.uint8)
    street = cv2.resize(coarse, (WIDTH + 8, HEIGHT), interpolation=cv2.INTER_CUBIC)
    moved = np.stack([street[:, 8 - 2 * k : 8 - 2 * k + WIDTH] for k in range(FRAMES)])
    seen = small_look(FRAMES)
    instances = np.zeros((FRAMES, HEIGHT, WIDTH), np.uint16)
    instances[:, :, : int(traffic * WIDTH)] = 1
    blank = np.zeros(instances.shape)
    look = replace(
        seen,
        depth=blank.astype(np.float32),
        spread=blank.astype(np.float16),
        classes=blank.astype(np.uint8),
        confidence=blank.astype(np.float16),
        instances=instances,
    )
    return Clip(
        frames=np.repeat(moved[..., None], 3, axis=-1),
        times_s=0.1 * np.arange(FRAMES),
        camera=np.zeros(FRAMES, np.int64),
        rig=(Camera(400.0, 400.0, WIDTH / 2, HEIGHT / 2, WIDTH, HEIGHT),),
        valid=np.ones(instances.shape, bool),
        held_out=np.zeros(FRAMES, bool),
        source_index=np.arange(FRAMES),
        looks=(look,),
    )


@pytest.mark.parametrize(("share", "little"), [(1.0, False), (0.5, False), (0.3, True), (0.0, True)])
def test_a_third_of_a_picture_is_little(share: float, little: bool) -> None:
    usable = np.zeros((10, 20), bool)
    usable[:, : int(20 * share)] = True
    assert features.is_little(usable) == little


@pytest.mark.parametrize(("traffic", "little"), [(0.0, False), (0.75, True)])
def test_traffic_leaves_little(traffic: float, little: bool) -> None:
    clip = noise_clip(traffic)
    evidence = observe(clip)
    assert shows_little(clip, evidence) == little
    assert evidence.motion.tracks > 30
    assert not evidence.motion.standing


def test_a_closer_look_finds_more_at_the_same_places() -> None:
    clip = noise_clip(0.75)
    evidence = observe(clip)
    plain, closer = (find_features(clip, evidence, each)[1] for each in (False, True))
    assert len(plain.keypoints_px) < len(closer.keypoints_px) < features.MAX_FEATURES
    assert closer.keypoints_px[:, 0].min() > 0.75 * WIDTH
    assert closer.keypoints_px[:, 0].max() < WIDTH
    apart = np.linalg.norm(plain.keypoints_px[:, None] - closer.keypoints_px[None], axis=2).min(axis=1)
    assert np.median(apart) < 0.25
