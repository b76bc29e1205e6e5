"""``dreamdrive evaluate video`` from its arguments to the table and the file."""

import json
from pathlib import Path

import pytest
import torch

from dreamdrive.evaluate.clips import extractors
from tests.cli.conftest import Run
from tests.evaluate.sets import write_clip, write_set

SETS = ("real", 0), ("fake", 20)


@pytest.fixture
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the network that is always there."""
    monkeypatch.setattr(extractors, "_add_efficientnet", lambda _: None)


def test_figures_are_printed_and_written(run: Run, tmp_path: Path) -> None:
    real, fake = (write_set(tmp_path / name, frames=2, noise=noise) for name, noise in SETS)
    file = tmp_path / "out" / "figures.json"
    result = run("evaluate", "video", real, fake, "--window", 0, "--resamples", 20, "--json", file)
    assert result.code == 0, result
    assert "likeness of paired frames" in result.out
    assert "not computed: fid, kid: no weights: --inception FILE" in result.out
    values = json.loads(file.read_text())
    assert values["settings"]["window"] == 0
    assert values["size"] == [48, 40]
    likeness = values["likenesses"]["psnr"]
    assert 15 < likeness["low"] < likeness["value"] < likeness["high"] < 30
    assert (likeness["frames"], likeness["clips"]) == (6, 3)
    assert f"{likeness['value']:.4g}" in result.out


@pytest.mark.usefixtures("plain")
def test_what_is_infinite_is_null_on_disk(run: Run, tmp_path: Path) -> None:
    real = write_set(tmp_path / "real", clips=1)
    result = run("evaluate", "video", real, real, "--window", 0, "--json", tmp_path / "f.json")
    assert result.code == 0, result
    assert "psnr inf -" in result.out
    likeness = json.loads((tmp_path / "f.json").read_text())["likenesses"]
    assert likeness["psnr"]["value"] is None
    assert likeness["ssim"]["value"] == pytest.approx(1)


@pytest.mark.usefixtures("plain")
def test_mistakes_have_one_message(run: Run, tmp_path: Path) -> None:
    real, file = write_set(tmp_path / "real"), tmp_path / "weights.pth"
    write_clip(tmp_path / "small", 0, size=(40, 40))
    torch.save({"fc.weight": torch.zeros(3)}, file)
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "0.png").write_bytes(b"not a picture")
    for arguments, message in (
        ((real, tmp_path / "none"), "none does not exist; expected a folder of clips"),
        ((real / "a", tmp_path / "small", "--window", 0), "40x40, the clips before are 48x40"),
        ((real / "a", tmp_path / "broken", "--window", 0), "cannot be read as an image"),
        ((real, real, "--inception", tmp_path / "none"), "expected pt_inception-2015-12-05-6726825d.pth"),
        ((real, real, "--inception", file), "missing: Conv2d_1a_3x3.bn.bias"),
        ((real, real, "--i3d", file), "expected i3d_pretrained_400.pt"),
        ((real, real, "--lpips-trunk", file), "give --lpips-trunk and --lpips-heads"),
        ((real, real, "--window", -3), "--window -3"),
    ):
        result = run("evaluate", "video", *arguments)
        assert result.code == 2, result
        assert message in result.err
    assert run("evaluate").code == 2
    assert run("evaluate", "nothing").code == 2
