"""``dreamdrive evaluate consistency``: its table, its file and its refusals."""

import json
import shutil
from pathlib import Path

import pytest

from dreamdrive.cli.evaluate.consistency import consistency
from dreamdrive.data import read_trajectory, write_trajectory
from dreamdrive.errors import InputError
from dreamdrive.scene.trajectory import Trajectory
from streetworld import make_street
from streetworld.files import write_world


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("world") / "street"
    write_world({"front": make_street(seed=1, frames=5, size=(160, 96))}, folder)
    return folder


def test_figures_are_shown_and_written(
    world: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "new" / "figures.json"
    consistency(
        world / "frames",
        trajectory=world / "poses.json",
        intrinsics=world / "cameras.json",
        fps=10,
        json=file,
    )
    said = " ".join(capsys.readouterr().out.split())
    assert "5 frames, 160 px wide" in said
    assert "path: rotation (RPE)" in said
    assert "5 frames are too few for pairs 8 frames apart." in said
    figures = json.loads(file.read_text())
    assert figures["lines_from"] == "asked"
    assert figures["path"]["translation_percent"] < 5
    assert figures["gaps"][1]["warp"]["grey_levels"] > 0
    assert figures["gaps"][2] == {"gap": 8, "epipolar": None, "warp": None}


def test_a_trajectory_of_another_length_is_refused_with_both_lengths(world: Path, tmp_path: Path) -> None:
    drive = read_trajectory(world / "poses.json")
    file = tmp_path / "short.json"
    write_trajectory(Trajectory(drive.world_from_camera[:4], drive.times_s[:4]), file)
    with pytest.raises(InputError, match="has 4 poses but the video has 5 frames"):
        consistency(world / "frames", trajectory=file)


def test_inputs_that_are_missing_or_too_short_are_refused(world: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        consistency(tmp_path / "video.mp4")
    with pytest.raises(InputError, match=r"none\.json"):
        consistency(world / "frames", trajectory=tmp_path / "none.json")
    shutil.copy(world / "frames" / "0000.png", tmp_path)
    with pytest.raises(InputError, match="a single frame"):
        consistency(tmp_path)
