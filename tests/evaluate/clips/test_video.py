"""Two sets of clips in, figures out."""

from pathlib import Path

import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.evaluate.clips import video
from dreamdrive.evaluate.clips.extractors import Extractor, Toolbox, WeightFiles, open_toolbox
from dreamdrive.evaluate.clips.frechet import frechet_distance
from dreamdrive.evaluate.clips.video import VideoReport, VideoSettings, evaluate_video, windows
from dreamdrive.evaluate.networks.i3d import I3d
from dreamdrive.evaluate.networks.inception import Inception
from dreamdrive.evaluate.networks.lpips import CHANNELS, alex
from tests.evaluate.sets import write_clip, write_set

QUICK = VideoSettings(window=2, resamples=20)


def colours(frames: torch.Tensor) -> np.ndarray:
    return frames.double().mean(dim=(1, 2)).numpy()


@pytest.fixture
def toolbox(monkeypatch: pytest.MonkeyPatch) -> Toolbox:
    """Mean colours of frames, and of windows, for networks."""
    box = Toolbox()
    box.extractors.append(Extractor("frechet_colour", "kernel_colour", False, colours))
    box.extractors.append(
        Extractor("frechet_window", "kernel_window", True, lambda f: colours(f).mean(axis=0, keepdims=True))
    )
    box.likenesses["gap"] = lambda a, b: (a.double() - b.double()).abs().mean(dim=(1, 2, 3)).numpy()
    box.missing["fid"] = "no weights"
    monkeypatch.setattr(video, "open_toolbox", lambda *_, **__: box)
    return box


@pytest.fixture
def report(toolbox: Toolbox, tmp_path: Path) -> VideoReport:
    real, fake = write_set(tmp_path / "real"), write_set(tmp_path / "fake", noise=30)
    return evaluate_video(real, fake, QUICK)


def test_a_distance_is_of_the_features_of_all_clips(report: VideoReport, tmp_path: Path) -> None:
    sets = [
        np.concatenate([colours(torch.from_numpy(video.read_frames(c))) for c in clips.values()])
        for clips in (video.open_clips(tmp_path / "real"), video.open_clips(tmp_path / "fake"))
    ]
    figure = report.distances["frechet_colour"]
    assert figure.value == pytest.approx(frechet_distance(*sets))
    assert (figure.real_samples, figure.real_clips) == (12, 3)
    assert report.distances["frechet_window"].real_samples == 6
    assert set(report.distances) == {"frechet_colour", "kernel_colour", "frechet_window", "kernel_window"}


def test_paired_frames_are_compared_one_by_one(report: VideoReport) -> None:
    figure = report.likenesses["gap"]
    assert report.paired
    assert (figure.frames, figure.clips) == (12, 3)
    assert 15 < figure.value < 30
    assert report.not_computed == {"fid": "no weights"}
    assert report.size == (48, 40)


def test_sets_of_other_names_are_compared_as_sets_only(toolbox: Toolbox, tmp_path: Path) -> None:
    real = write_set(tmp_path / "real")
    write_clip(tmp_path / "fake" / "z", 0, frames=8)
    found = evaluate_video(real, tmp_path / "fake", QUICK)
    assert not found.paired
    assert found.likenesses == {}
    assert found.not_computed["gap"] == "the names of the clips differ: a is in the real set only"
    assert found.distances["frechet_colour"].fake_clips == 1


def test_pairs_of_other_length_are_not_compared_frame_by_frame(toolbox: Toolbox, tmp_path: Path) -> None:
    write_clip(tmp_path / "real", 0, frames=5)
    write_clip(tmp_path / "fake", 0, frames=4)
    found = evaluate_video(tmp_path / "real", tmp_path / "fake", QUICK)
    assert found.likenesses == {}
    assert "has 5 frames" in found.not_computed["gap"]


def test_few_windows_leave_the_other_figures(toolbox: Toolbox, tmp_path: Path) -> None:
    write_clip(tmp_path / "a", 0)
    found = evaluate_video(tmp_path / "a", tmp_path / "a", QUICK)
    assert set(found.distances) == {"frechet_colour", "kernel_colour"}
    assert found.not_computed["frechet_window, kernel_window"].startswith("2 real and 2 fake windows")
    assert "gap" in found.likenesses


def test_windows_drop_the_remainder() -> None:
    frames = torch.arange(7, dtype=torch.uint8).reshape(7, 1, 1, 1).expand(7, 2, 2, 3)
    assert [w[:, 0, 0, 0].tolist() for w in windows(frames, 3)] == [[0, 1, 2], [3, 4, 5]]
    assert [w[0, 0, 0, 0].item() for w in windows(frames, 3, 2)] == [0, 2, 4]
    assert windows(frames, 8) == []


def test_input_that_cannot_be_compared(toolbox: Toolbox, tmp_path: Path) -> None:
    real = write_set(tmp_path / "real")
    with pytest.raises(InputError, match="4 frames, fewer than a window of 16"):
        evaluate_video(real, real)
    write_clip(tmp_path / "wide", 0, size=(64, 40))
    with pytest.raises(InputError, match="is 64x40, the clips before are 48x40"):
        evaluate_video(real / "a", tmp_path / "wide", QUICK)
    write_clip(tmp_path / "tiny", 0, size=(31, 40))
    with pytest.raises(InputError, match="expected 32 pixels or more"):
        evaluate_video(tmp_path / "tiny", tmp_path / "tiny", QUICK)
    with pytest.raises(InputError, match="--window 8: FVD needs 9 frames"):
        evaluate_video(real, real, VideoSettings(window=8), WeightFiles(i3d=tmp_path / "i3d.pt"))


@pytest.mark.parametrize(
    ("settings", "message"),
    [({"window": -1}, "--window"), ({"stride": 0}, "--stride"), ({"resamples": -1}, "0 or")],
)
def test_settings_that_cannot_be(settings: dict[str, int], message: str) -> None:
    with pytest.raises(InputError, match=message):
        VideoSettings(**settings)


def test_the_toolbox_says_what_is_missing(tmp_path: Path) -> None:
    box = open_toolbox(WeightFiles(), windows=False)
    assert {"psnr", "ssim"} <= set(box.likenesses)
    assert "pt_inception-2015-12-05" in box.missing["fid, kid"]
    assert "--window 0" in box.missing["fvd, kvd, frechet_transnetv2"]
    assert "--lpips-heads" in box.missing["lpips"]
    assert box.missing["stlpips_vgg"] == "left out unless asked for: --stlpips both"
    assert not {"fid", "fvd"} & set(box.weights)
    with pytest.raises(InputError, match="needs both files"):
        open_toolbox(WeightFiles(lpips_trunk=tmp_path / "trunk.pth"))


def test_networks_of_given_files_describe_frames_and_windows(tmp_path: Path) -> None:
    torch.save(Inception().state_dict(), tmp_path / "inception.pth")
    torch.save(I3d().state_dict(), tmp_path / "i3d.pt")
    box = open_toolbox(WeightFiles(inception=tmp_path / "inception.pth", i3d=tmp_path / "i3d.pt"))
    frames = torch.randint(0, 256, (9, 40, 48, 3), dtype=torch.uint8)
    by_name = {e.frechet: e for e in box.extractors}
    assert by_name["fid"].features(frames[:2]).shape == (2, 2048)
    assert by_name["fvd"].features(frames).shape == (1, 400)
    assert (by_name["fid"].window, by_name["fvd"].window) == (False, True)
    assert {box.weights[name]["file"] for name in ("fid", "fvd")} == {"inception.pth", "i3d.pt"}


def test_lpips_comes_in_both_habits(tmp_path: Path) -> None:
    torch.manual_seed(0)
    torch.save(alex().state_dict(), tmp_path / "trunk.pth")
    heads = {f"lin{k}.model.1.weight": torch.rand(1, c, 1, 1) for k, c in enumerate(CHANNELS["alex"])}
    torch.save(heads, tmp_path / "heads.pth")
    files = WeightFiles(lpips_trunk=tmp_path / "trunk.pth", lpips_heads=tmp_path / "heads.pth")
    box = open_toolbox(files, windows=False)
    frames = torch.randint(0, 256, (2, 2, 40, 48, 3), dtype=torch.uint8)
    assert box.likenesses["lpips_alex"](*frames).shape == (2,)
    assert (box.likenesses["lpips_alex"](*frames) > box.likenesses["lpips_alex_3dgs"](*frames)).all()
    assert box.weights["lpips_alex"]["file"] == "trunk.pth"
    assert len(box.weights["lpips_alex_heads"]["sha256"]) == 64


def test_equal_sets_have_no_distance(toolbox: Toolbox, tmp_path: Path) -> None:
    real = write_set(tmp_path / "real")
    found = evaluate_video(real, real, QUICK)
    assert found.distances["frechet_colour"].value == pytest.approx(0, abs=1e-8)
    assert found.likenesses["gap"].value == 0
