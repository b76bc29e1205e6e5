"""Priors on their own."""

from dataclasses import replace
from pathlib import Path

import cv2
import pytest

from dreamdrive.errors import InputError
from dreamdrive.prior import Input
from dreamdrive.prior.replay import REPLAY
from dreamdrive.run import sampling
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control
from tests.data.textures import texture


def first(opened: Input, progress: object) -> Clip:
    clip = REPLAY.make(opened, lambda done, total: None)
    names = ("frames", "times_s", "camera", "valid", "held_out", "source_index")
    return replace(clip, features={}, **{name: getattr(clip, name)[:1] for name in names})


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    (tmp_path / "drive").mkdir()
    for index in range(2):
        cv2.imwrite(str(tmp_path / f"drive/{index}.png"), texture(32, 64, index))
    return tmp_path / "drive"


def test_what_is_no_recording_is_not_written(
    drive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(InputError, match="is the input itself"):
        sampling.sample(Control(drive), drive)
    with pytest.raises(InputError, match=r"none.json does not exist; expected the trajectory"):
        sampling.sample(Control(drive, trajectory=tmp_path / "none.json"), tmp_path / "made")
    monkeypatch.setattr(sampling, "choose_prior", lambda name: replace(REPLAY, make=first))
    with pytest.raises(InputError, match="a single frame is no recording"):
        sampling.sample(Control(drive), tmp_path / "made")
    assert not (tmp_path / "made").exists()


def test_frames_are_read_with_the_detail_that_a_network_sees(drive: Path, tmp_path: Path) -> None:
    assert sampling.detailed_size(drive) == (64, 32)
    cv2.imwrite(str(tmp_path / "0.png"), texture(545, 1921, 0))
    assert sampling.detailed_size(tmp_path) == (1024, 290)
