"""Pictures and film of the pages: what they show, and that they stay small."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from dreamdrive_bench import film, illustrations
from tests.scene.scenes import make_scene


def test_a_film_has_a_frame_for_each_recorded_time_and_repeats_itself(tmp_path: Path) -> None:
    scene = make_scene()
    camera = scene.cameras[0]
    recorded = np.full((len(scene.cameras), camera.height_px, camera.width_px, 3), (200, 40, 40), np.uint8)
    frames = film.film(scene, recorded, -1.0)
    assert len(frames) == len(scene.cameras)
    panel = frames[0][: frames[0].shape[0] // 3, : film._PANEL_PX]
    assert np.array_equal(panel[-1, -1], (200, 40, 40))  # what was recorded stands first
    flashing = [np.full((20, 30, 3), level, np.uint8) for level in (0, 120, 250)]
    film.write(tmp_path / "film.webp", flashing)
    with Image.open(tmp_path / "film.webp") as made:
        assert made.n_frames == 3
        assert made.info["loop"] == 0


def test_a_picture_is_as_good_as_its_size_allows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    noise = np.random.default_rng(0).integers(0, 255, (200, 300, 3), np.uint8)
    illustrations.write(tmp_path / "large.jpg", noise)
    monkeypatch.setattr(illustrations, "MOST_BYTES", 30_000)
    illustrations.write(tmp_path / "small.jpg", noise)
    assert (tmp_path / "small.jpg").stat().st_size <= 30_000 < (tmp_path / "large.jpg").stat().st_size
    assert cv2.imread(str(tmp_path / "small.jpg")).shape == noise.shape


def test_votes_are_red_over_grey() -> None:
    frame = np.full((2, 3, 3), (10, 200, 30), np.uint8)
    mask = np.array([[True, False, False], [False, False, True]])
    shown = illustrations.over(frame, mask)
    assert np.array_equal(shown[0, 0], (255, 60, 40))
    assert len(set(shown[0, 1].tolist())) == 1
