"""``dreamdrive prior`` and a photo through ``dreamdrive generate``."""

import json
from pathlib import Path

import av
import pytest

from dreamdrive.prior.vista.kinds import SVD, VISTA
from dreamdrive.prior.vista.stored import open_weights
from tests.cli.conftest import Run
from tests.prior.vista.photos import save_photo
from tests.prior.vista.tiny import FRAMES, save_folder, save_official
from tests.test_generate import shorten


def test_a_single_file_becomes_a_folder(run: Run, tmp_path: Path) -> None:
    file = save_official(tmp_path / "svd.safetensors", SVD)
    made = run("prior", "convert", file, tmp_path / "model", "--dtype", "float32")
    assert made.code == 0, made
    assert f"Stable Video Diffusion, for --prior svd --weights {tmp_path}/model" in made.out
    assert "left out, not needed: the text half of CLIP, 1 tensors" in made.out
    assert open_weights(tmp_path / "model").kind is SVD
    again = run("prior", "convert", file, tmp_path / "model")
    assert again.code == 2
    assert "--force" in again.err
    wrong = run("prior", "convert", tmp_path / "none.safetensors", tmp_path / "other")
    assert wrong.code == 2
    assert "does not exist" in wrong.err


@pytest.mark.slow
def test_a_photo_becomes_a_video_that_says_where_it_is_from(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dreamdrive.prior.vista.sampler.sigmas", lambda steps: [700.0, 0.0])
    photo, weights = save_photo(tmp_path / "photo.jpg"), save_folder(tmp_path / "model", VISTA)
    out, action = tmp_path / "out", "speed=8,8,8,8 wheel=0,0,0,0"
    asked = ("--prior", "vista", "--weights", weights, "--size", "64x64", "--action", action)
    made = run("prior", "sample", photo, *asked, "-o", out)
    assert made.code == 0, made
    with av.open(str(out / "video.mp4")) as container:
        shown = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
        assert container.streams.video[0].average_rate == 10
    assert len(shown) == len(list((out / "frames").iterdir())) == FRAMES
    assert shown[0].shape == (64, 64, 3)
    about = json.loads((out / "provenance.json").read_text())
    assert about["files"]["weights"]["name"] == "model"
    assert any("They hold no geometry" in note for note in about["provenance"]["notes"])
    asked_for = json.loads((out / "requested.json").read_text())["world_from_camera"]
    assert asked_for[-1][2][3] == pytest.approx(8 * (FRAMES - 1) / 10)
    assert not (out / "poses.json").exists()
    assert f"--features {out / 'features.safetensors'}" in made.out


@pytest.mark.slow
def test_a_photo_becomes_a_scene_that_claims_no_geometry(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shorten(monkeypatch)
    monkeypatch.setattr("dreamdrive.prior.vista.sampler.sigmas", lambda steps: [700.0, 0.0])
    photo, weights = save_photo(tmp_path / "photo.jpg"), save_folder(tmp_path / "model", VISTA)
    out = tmp_path / "out"
    asked = ("--prior", "vista", "--weights", weights, "-o", out, "--quality", "draft", "--size", "64x64")
    made = run("generate", photo, *asked)
    assert made.code == 0, made
    report = json.loads((out / "report.json").read_text())
    assert any("They hold no geometry" in note for note in report["notes"])
    assert report["fallback"]
    assert (out / "scene").is_dir()
