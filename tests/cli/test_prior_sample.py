"""``dreamdrive prior sample`` and ``features``."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from dreamdrive.data import read_clip
from dreamdrive.data.feature_file import read_features
from dreamdrive.prior.vista import features
from dreamdrive.scene.control import Command
from tests.cli.conftest import Run
from tests.data.textures import texture

SMALL = ("--frames", "0:2", "--size", "64x48")


def test_a_sample_is_written_and_says_how_to_go_on(run: Run, tmp_path: Path) -> None:
    out = tmp_path / "made"
    result = run("prior", "sample", "--prior", "street-world", *SMALL, "--seed", 3, "-o", out)
    assert result.code == 0, result
    assert f"{out}: 2 frames, 64x48" in result.out
    assert f"to go on: dreamdrive generate {out} -o OUT --fps 10 --size 64x48 --intrinsics" in result.out
    assert f"--features {out / 'features.safetensors'}" in result.out
    about = json.loads((out / "provenance.json").read_text())
    assert (about["prior"], about["seed"]) == ("street-world", 3)
    assert about["options"] == {"frames": "0:2", "size": [64, 48]}
    assert "simulated" in about["provenance"]["notes"][0]
    again = run("prior", "sample", "--prior", "street-world", *SMALL, "-o", out)
    assert again.code == 2
    assert "--force" in again.err
    assert "prior:" not in again.out  # before anything is drawn


def test_a_recording_is_sampled_with_its_files_named(run: Run, tmp_path: Path) -> None:
    (tmp_path / "drive").mkdir()
    for index in range(3):
        cv2.imwrite(str(tmp_path / f"drive/{index}.png"), texture(32, 64, index))
    out = tmp_path / "made"
    result = run("prior", "sample", tmp_path / "drive", "--frames", "0:3:2", "-o", out)
    assert result.code == 0, result
    about = json.loads((out / "provenance.json").read_text())
    assert about["prior"] == "replay"
    assert about["files"]["path"]["name"] == "drive"
    assert about["source_index"] == [0, 2]
    np.testing.assert_array_equal(read_clip(out).frames, read_clip(tmp_path / "drive").frames[::2])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--prior", "sora"], "invalid choice 'sora' for argument"),
        (["--prior", "street-world", "--prompt", "rain"], "street-world takes no --prompt"),
        (["--prior", "street-world", "--action", "command=up"], "'up' is no command; expected one of left"),
        (["--prior", "cosmos"], "prior cosmos needs --weights PATH"),
        (["none.mp4"], "none.mp4 does not exist; expected a video"),
    ],
)
def test_what_cannot_be_sampled_is_said(run: Run, tmp_path: Path, arguments: list[str], message: str) -> None:
    result = run("prior", "sample", *arguments, "-o", tmp_path / "made")
    assert result.code == 2
    assert message in result.err
    assert not (tmp_path / "made").exists()


def test_features_of_a_recording_are_written(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: dict[str, Any] = {}

    def look(frames: np.ndarray, weights: Path, options: object, **more: Any) -> features.VideoFeatures:
        seen.update(more, options=options, frames=frames)
        return features.VideoFeatures("vista:one", np.ones((len(frames), 2, 4, 3), np.float16), ("so",))

    monkeypatch.setattr(features, "video_features", look)
    (tmp_path / "weights").mkdir()
    (tmp_path / "drive").mkdir()
    for index in range(3):
        cv2.imwrite(str(tmp_path / f"drive/{index}.png"), texture(300, 1200, index))
    out = tmp_path / "f.safetensors"
    command = ["prior", "features", tmp_path / "drive", "-o", out, "--weights", tmp_path / "weights"]
    result = run(
        *command, "--sigma", 0.1, "--frames", "0:3:2", "--size", "128x64", "--action", "command=left"
    )
    assert result.code == 0, result
    assert "vista:one, 2 frames of 4x2, 3 channels" in result.out
    made = read_features(out)
    assert made.arrays["vista:one"].shape == (2, 2, 4, 3)
    assert made.provenance["features"]["sigma"] == 0.1
    assert made.provenance["notes"] == ["so"]
    assert made.provenance["action"] == {"direction": "left"}
    assert made.provenance["frame_index"] == [0, 2]
    assert (seen["size"], seen["action"]) == ((128, 64), Command("left"))
    assert seen["frames"].shape == (2, 256, 1024, 3)
    clip = read_clip(tmp_path / "drive", frames="0:3:2", features=out)
    np.testing.assert_array_equal(clip.features["vista:one"], made.arrays["vista:one"])
    for option, value, message in (
        ("--channels", 900, "1 to 128 channels"),
        ("--sigma", 0, "expected a deviation above 0"),
        ("-o", tmp_path / "f.npz", "ends in .safetensors"),
        ("--weights", "none", "--weights none does not exist"),
    ):
        wrong = run(*command, option, value)
        assert wrong.code == 2
        assert message in wrong.err
