"""``dreamdrive prior``."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from tests.cli.conftest import Run
from tests.data.pictures import texture

from dreamdrive.data import read_clip
from dreamdrive.data.feature_file import read_features

SMALL = ("--frames", "0:2", "--size", "64x48")


def test_a_sample_is_written_and_says_how_to_go_on(run: Run, tmp_path: Path) -> None:
    out = tmp_path / "made"
    result = run("prior", "sample", "--prior", "street-world", *SMALL, "--seed", 3, "-o", out)
    assert result.code == 0, result
    assert f"{out}: 2 frames of 64x48" in result.out
    assert f"to go on: dreamdrive generate {out} -o OUT --fps 10 --size 64x48 --intrinsics" in result.out
    assert f"--features {out / 'features.safetensors'}" in result.out
    about = json.loads((out / "provenance.json").read_text())
    assert (about["prior"], about["seed"]) == ("street-world", 3)
    assert about["options"] == {"frames": "0:2", "size": [64, 48]}
    assert "simulated" in about["provenance"]["notes"][0]
    again = run("prior", "sample", "--prior", "street-world", *SMALL, "-o", out)
    assert again.code == 2
    assert "--force" in again.err


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
        (["--prior", "sora"], "--prior sora: unknown; available are replay, street-world"),
        (["--prior", "street-world", "--prompt", "rain"], "street-world takes no prompt"),
        (["--prior", "street-world", "--action", "command=up"], "'up' is no command; expected one of left"),
        (["--prior", "street-world", "--frames", "0:1", "--size", "64x48"], "a single frame is no recording"),
        (["--prior", "cosmos"], "prior cosmos needs --weights PATH"),
        (["none.mp4"], "none.mp4 does not exist; expected the input"),
    ],
)
def test_what_cannot_be_sampled_is_said(run: Run, tmp_path: Path, arguments: list[str], message: str) -> None:
    result = run("prior", "sample", *arguments, "-o", tmp_path / "made")
    assert result.code == 2
    assert message in result.err
    assert not (tmp_path / "made").exists()


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::FutureWarning")
def test_features_of_a_recording_are_written(run: Run, tmp_path: Path) -> None:
    pytest.importorskip("diffusers")
    tiny = pytest.importorskip("tests.prior.vista.tiny")
    from dreamdrive.prior.vista.kinds import SVD

    weights = tmp_path / "weights"
    tiny.save_folder(weights, SVD)
    (tmp_path / "drive").mkdir()
    for index in range(2):
        cv2.imwrite(str(tmp_path / f"drive/{index}.png"), texture(64, 64, index))
    out = tmp_path / "f.safetensors"
    result = run(
        "prior",
        "features",
        tmp_path / "drive",
        "-o",
        out,
        "--weights",
        weights,
        "--channels",
        4,
        "--sigma",
        0.1,
    )
    assert result.code == 0, result
    made = read_features(out)
    (name,) = made.arrays
    assert name.startswith("svd:")
    assert made.arrays[name].shape[::3] == (2, 4)
    assert made.provenance["features"]["sigma"] == 0.1
    assert read_clip(tmp_path / "drive", features=out).features[name].shape[0] == 2
    wrong = run("prior", "features", tmp_path / "drive", "-o", out, "--weights", weights, "--channels", 900)
    assert wrong.code == 2
    assert "1 to 128 channels" in wrong.err
