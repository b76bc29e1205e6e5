"""From a clip to a scene by DUSt3R, with the smallest network there can be."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch

from dreamdrive import load_scene
from tests.cli.conftest import Run
from tests.geometry.backends.dust3r.network.networks import tiny
from tests.geometry.backends.dust3r.network.test_checkpoint import save_hub, save_pth
from tests.test_generate import shorten

CLIP = ("--prior", "street-world", "--frames", "0:6", "--size", "64x40", "--hold-out", "4")
SHORT = (*CLIP, "--quality", "draft")


@pytest.fixture(autouse=True)
def few_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    shorten(monkeypatch)


@pytest.fixture
def weights(tmp_path: Path) -> Path:
    return save_pth(tmp_path / "tiny.pth", tiny(), img_size=(160, 160))


@pytest.mark.slow
def test_a_clip_becomes_a_scene_and_other_weights_another(run: Run, tmp_path: Path, weights: Path) -> None:
    out, hub = tmp_path / "out", tmp_path / "hub"
    hub.mkdir()
    done = run("generate", *SHORT, "--geometry", "dust3r", "--weights", weights, "-o", out)
    assert done.code == 0, done.err
    report = json.loads((out / "report.json").read_text())
    assert report["geometry"]["pairs_residual"] > 0
    assert any("not to be believed" in note for note in report["detected"])
    assert len(load_scene(out / "scene").cameras) == 6
    same = run("generate", *SHORT, "--geometry", "dust3r", "--weights", weights, "-o", out)
    other = run("generate", *SHORT, "--geometry", "dust3r", "--weights", save_hub(hub, tiny()), "-o", out)
    assert same.code == 0
    assert other.code == 2
    assert "--force" in other.err


def changed(path: Path, changes: dict[str, torch.Tensor | None], **stated: object) -> Path:
    """A checkpoint with tensors replaced, added or (None) left out."""
    network = tiny()
    state = {**network.state_dict(), **changes}
    return save_pth(
        path,
        network,
        {key: value for key, value in state.items() if value is not None},
        **{"img_size": (160, 160), **stated},
    )


def damaged(name: str, folder: Path) -> Path:
    """A checkpoint with something wrong."""
    path = folder / f"{name}.pth"
    if name == "other":
        torch.save({"model": {"layer.weight": torch.zeros(2, 2)}}, path)
    elif name == "truncated":
        whole = save_pth(folder / "whole.pth", tiny(), img_size=(160, 160)).read_bytes()
        path.write_bytes(whole[: len(whole) // 2])
    elif name == "missing":
        changed(path, {"enc_norm.bias": None})
    elif name == "extra":
        changed(path, {"surplus.weight": torch.zeros(3)})
    elif name == "head":
        changed(path, {}, head_type="linear")
    else:
        save_pth(path, tiny(), img_size=(160, 160))
    return path


def pictures(folder: Path, frames: np.ndarray) -> Path:
    folder.mkdir()
    for index, frame in enumerate(frames):
        cv2.imwrite(str(folder / f"{index:04d}.png"), frame)
    return folder


def moved(count: int) -> np.ndarray:
    """Frames of a wall that goes by to the left."""
    random = np.random.default_rng(0)
    wall = cv2.GaussianBlur(random.uniform(0, 255, (160, 400)).astype(np.float32), (0, 0), 2)
    wall = np.clip((wall - wall.mean()) * 4 + 120, 0, 255).astype(np.uint8)
    return np.stack([np.repeat(wall[:, 8 * k : 8 * k + 256, None], 3, 2) for k in range(count)])


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ("other", "no DUSt3R model"),
        ("truncated", "truncated.pth"),
        ("missing", "enc_norm.bias"),
        ("extra", "surplus.weight"),
        ("head", "head is stated as 'linear'"),
        ("few", "gives a single frame"),
        ("alike", "all 4 frames are alike"),
        ("contradict", "the given poses contradict the frames"),
    ],
)
def test_bad_input_is_refused_in_words(run: Run, tmp_path: Path, wrong: str, message: str) -> None:
    frames = moved(1 if wrong == "few" else 8)
    if wrong == "alike":
        frames = frames[[0] * 4]
    more: list[object] = []
    if wrong == "contradict":
        poses = np.tile(np.eye(4), (8, 1, 1))
        poses[:, 1, 3] = np.arange(8)  # upwards
        text = "\n".join(" ".join(map(str, pose[:3].ravel())) for pose in poses)
        (tmp_path / "poses.txt").write_text(text)
        more = ["--geometry-files", tmp_path / "poses.txt"]
    refused = run(
        "generate",
        pictures(tmp_path / "frames", frames),
        *("--size", "256x160", "--quality", "draft", "--knowledge", "none", "--geometry", "dust3r"),
        *("--weights", damaged(wrong, tmp_path), *more, "-o", tmp_path / "out"),
    )
    assert refused.code == 2, refused.err
    assert message in " ".join(refused.err.split())
    assert "Traceback" not in refused.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--geometry", "dust3r"), "needs --weights PATH"),
        (("--weights", "{weights}"), "classical has no network"),
        (("--geometry", "dust3r", "--weights", "none.pth"), "none.pth does not exist"),
        (("--geometry", "dust3r", "--weights", "naver/none"), "hf download naver/none"),
    ],
)
def test_method_and_weights_are_checked_before_anything_is_made(
    run: Run, tmp_path: Path, weights: Path, arguments: tuple[str, ...], message: str
) -> None:
    out = tmp_path / "out"
    given = [each.format(weights=weights) for each in arguments]
    refused = run("generate", *SHORT, *given, "-o", out)
    assert refused.code == 2
    assert message in refused.err
    assert not out.exists()
