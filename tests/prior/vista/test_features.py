"""What the video model sees in frames."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.prior.vista.engine import Engine, RoundConditions
from dreamdrive.prior.vista.features import FeatureOptions, spans_of, video_features
from dreamdrive.scene.control import Command, Goal
from tests.prior.vista.tiny import FRAMES


def recording(count: int, width: int = 96, height: int = 54) -> np.ndarray:
    return np.random.default_rng(1).integers(0, 256, (count, height, width, 3), dtype=np.uint8)


def test_windows_cover_all_frames() -> None:
    assert spans_of(30, 25) == [range(0, 25), range(5, 30)]
    assert spans_of(50, 25) == [range(0, 25), range(25, 50)]
    assert spans_of(3, 25) == [range(0, 3)]


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
    for block in ("down.9", "down_blocks", "down_blocks.1.attentions", "mid_block.attentions.0.norm"):
        with pytest.raises(InputError, match=rf"--block {block}: .* it has conv_in, down_blocks.0, "):
            video_features(recording(2), svd_dir, FeatureOptions(block=block))
    with pytest.raises(InputError, match="--action: Stable Video Diffusion knows of none"):
        video_features(recording(2), svd_dir, action=Command("left"))


def test_every_named_block_gives_activations(svd_dir: Path) -> None:
    for block in ("down_blocks.0", "mid_block.resnets.1"):
        made = video_features(recording(2), svd_dir, FeatureOptions(block=block, channels=2))
        assert made.name == f"svd:{block}"
        assert made.values.shape[3] == 2


def test_no_memory_is_asked_for_the_decoder(svd_dir: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dreamdrive.prior.vista.memory._DECODER", 10**9)
    assert len(video_features(recording(2), svd_dir).values) == 2


def test_each_window_is_told_the_action_and_a_goal_is_of_the_first(
    vista_dir: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    predictions: list[tuple[torch.Tensor, list[float]]] = []
    predict = Engine.predict

    def watched(
        engine: Engine, seen: RoundConditions, x: object, time: float, mask: torch.Tensor, *more: object
    ):
        assert seen.action is not None
        predictions.append((seen.action, mask.tolist()))
        return predict(engine, seen, x, time, mask, *more)  # type: ignore[arg-type]

    monkeypatch.setattr(Engine, "predict", watched)
    for action, again in ((Command("left"), True), (Goal(0.5, 0.5), False)):
        predictions.clear()
        video_features(recording(FRAMES + 2), vista_dir, action=action)
        assert [fixed for _, fixed in predictions] == [[1.0] + [0.0] * (FRAMES - 1)] * 2
        assert predictions[0][0].any()
        assert bool(predictions[1][0].any()) == again


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
