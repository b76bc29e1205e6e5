"""``dreamdrive look``."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch

from dreamdrive.street_network.network import StreetNetwork
from dreamdrive.street_network.weights import Training, write_network
from tests.cli.conftest import Run


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Weights that nothing was learned for."""
    torch.manual_seed(0)
    path = tmp_path_factory.mktemp("weights") / "random.safetensors"
    write_network(StreetNetwork(), Training(0, 0, "none", {}, {}, "none"), path)
    return path


@pytest.fixture
def clip(tmp_path: Path) -> Path:
    """Four pictures of noise."""
    folder = tmp_path / "clip"
    folder.mkdir()
    rng = np.random.default_rng(0)
    for index in range(4):
        cv2.imwrite(str(folder / f"{index}.png"), rng.integers(0, 255, (90, 160, 3), np.uint8))
    return folder


def test_a_photo(run: Run, clip: Path, weights: Path, tmp_path: Path) -> None:
    photo, out = clip / "0.png", tmp_path / "out"
    done = run("look", photo, "-o", out, "--knowledge", weights)
    assert done.code == 0, done.err
    assert "depth in camera heights (give --camera-height for metres)" in done.out
    assert "1 frames in" in done.out
    about = json.loads((out / "look.json").read_text())
    assert (about["width"], about["height"], about["camera_height_m"]) == (160, 90, None)
    assert about["source"] == str(photo)
    assert about["camera"]["focal_spread"] > 0
    assert [path.name for path in sorted(out.glob("[!.]*"))] == [
        "arrays", "classes", "confidence", "depth", "instances", "look.json", "overview",
    ]  # fmt: skip


def test_a_clip_of_a_known_camera(run: Run, clip: Path, weights: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    given = ("--frames", "1:4:2", "--hfov", 60, "--camera-height", 1.4, "--size", "128x72")
    done = run("look", clip, "-o", out, "--knowledge", weights, *given)
    assert done.code == 0, done.err
    assert "field of view 60.0 degrees, given" in done.out
    about = json.loads((out / "look.json").read_text())
    assert [frame["source_index"] for frame in about["frames"]] == [1, 3]
    assert about["depth_unit"] == "1/256 m"
    assert about["camera"]["hfov_deg"] == pytest.approx(60)
    assert cv2.imread(str(out / "classes/0001.png"), cv2.IMREAD_UNCHANGED).shape == (72, 128)


def test_an_earlier_look_stays_without_force(run: Run, clip: Path, weights: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = ("look", clip / "0.png", "-o", out, "--knowledge", weights)
    assert run(*command).code == 0
    refused = run(*command)
    assert refused.code == 2
    assert "--force" in refused.err
    assert run(*command, "--force").code == 0


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--frames", "0:2"), "is one photo; give --frames with a clip"),
        (("--size", "151x90"), "needs an even width and height"),
        (("--camera-height", "-1"), "camera height -1: expected a positive number"),
        (("--hfov", "300"), "expected degrees between 1 and 179"),
    ],
)
def test_mistakes(
    run: Run, clip: Path, weights: Path, tmp_path: Path, more: tuple[str, ...], said: str
) -> None:
    out = tmp_path / "out"
    refused = run("look", clip / "0.png", "-o", out, "--knowledge", weights, *more)
    assert refused.code == 2
    assert said in refused.err
    assert not out.exists()


def test_what_is_missing_is_named(run: Run, weights: Path, tmp_path: Path) -> None:
    refused = run("look", tmp_path / "none.mp4", "-o", tmp_path / "out", "--knowledge", weights)
    assert refused.code == 2
    assert "does not exist" in refused.err
    refused = run("look", tmp_path, "-o", tmp_path / "out", "--knowledge", tmp_path / "none.safetensors")
    assert refused.code == 2
    assert "there is no such file" in refused.err
