"""What the video model sees in frames."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import torch
from tests.prior.vista.tiny import FRAMES

from dreamdrive.errors import InputError
from dreamdrive.prior.vista.features import FeatureOptions, video_features, windows


def recording(count: int, width: int = 96, height: int = 54) -> np.ndarray:
    return np.random.default_rng(1).integers(0, 256, (count, height, width, 3), dtype=np.uint8)


def test_windows_cover_all_frames() -> None:
    assert windows(30, 25) == [range(0, 25), range(5, 30)]
    assert windows(50, 25) == [range(0, 25), range(25, 50)]
    assert windows(3, 25) == [range(0, 3)]


def test_features_of_a_recording_fit_its_frames(svd_dir: Path) -> None:
    frames = recording(FRAMES + 2)
    made = video_features(frames, svd_dir, FeatureOptions(channels=5), seed=1)
    assert made.name == "svd:down_blocks.1.attentions.1"
    count, height, width, channels = made.values.shape
    assert (count, channels, made.values.dtype) == (FRAMES + 2, 5, np.float16)
    assert 54 % height == 96 % width == 0
    assert np.isfinite(made.values).all()
    assert made.values[..., 0].astype(np.float32).std() == pytest.approx(1, abs=0.3)
    assert "saw the frames at 128x64 instead of 96x54" in made.notes[0]
    assert "resized from 8x4" in made.notes[1]
    changed = frames.copy()
    changed[-1] = 0
    assert (video_features(changed, svd_dir, FeatureOptions(channels=5), seed=1).values != made.values).any()


def test_a_wrong_block_or_model_is_refused(svd_dir: Path) -> None:
    with pytest.raises(InputError, match=r"no block 'down.9'; such as down_blocks.1.attentions.0"):
        video_features(recording(2), svd_dir, FeatureOptions(block="down.9"))
    with pytest.raises(InputError, match="not Vista"):
        video_features(recording(2), svd_dir, kind="vista")


def test_weights_that_are_not_finite_are_refused(tmp_path: Path, svd_dir: Path) -> None:
    from safetensors.torch import load_file, save_file

    folder = tmp_path / "model"
    shutil.copytree(svd_dir, folder)
    file = folder / "image_encoder" / "model.safetensors"
    state = load_file(file)
    state["visual_projection.weight"][0, 0] = torch.nan
    save_file(state, file)
    with pytest.raises(InputError, match=r"visual_projection\.weight holds numbers that are not finite"):
        video_features(recording(2), folder)
