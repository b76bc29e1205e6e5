"""From a clip to a scene by DUSt3R, with the smallest network there can be."""

import json
from pathlib import Path

import pytest
from tests.cli.conftest import Run
from tests.geometry.dust3r.network.golden import tiny
from tests.geometry.dust3r.network.test_checkpoint import save_hub, save_pth
from tests.test_pipeline import shorten

from dreamdrive import load_scene

CLIP = ("--prior", "street-world", "--frames", "0:6", "--size", "64x40", "--hold-out", "4")
SHORT = (*CLIP, "--quality", "draft")


@pytest.fixture(autouse=True)
def few_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    shorten(monkeypatch)


@pytest.fixture
def weights(tmp_path: Path) -> Path:
    return save_pth(tmp_path / "tiny.pth", tiny(), img_size=(160, 160))


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
