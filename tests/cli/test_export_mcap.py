"""``dreamdrive export --to mcap``."""

import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dreamdrive import load_scene
from dreamdrive.run import codec
from dreamdrive.scene.clip import Clip
from tests.cli.conftest import Run

pytest.importorskip("foxglove", reason="needs the extra mcap")
pytest.importorskip("mcap_protobuf", reason="pip install mcap-protobuf-support")

from tests.export.mcap_reader import picture_of, placed, read

FRONT = "/CAM_FRONT/image_rect_compressed"


def test_frames_of_a_run_are_written_with_its_poses(run: Run, finished: Path, tmp_path: Path) -> None:
    file = tmp_path / "drive.mcap"
    result = run("export", finished, "--to", "mcap", "-o", file)
    assert result.code == 0, result
    assert "Pictures are the frames that the scene was made of." in result.out
    clip, scene = codec.read(finished / "stages/prior", Clip), load_scene(finished / "scene")
    found = read(file)
    times_ns = found.times(FRONT)
    for time_ns, frame in zip(times_ns, clip.frames, strict=True):
        np.testing.assert_array_equal(picture_of(found.at(FRONT, time_ns)), frame)
    poses = np.stack([placed(found, time_ns, "CAM_FRONT") for time_ns in times_ns])
    ours = np.stack([camera.world_from_camera for camera in scene.cameras])
    np.testing.assert_allclose(np.linalg.inv(poses[0]) @ poses, np.linalg.inv(ours[0]) @ ours, atol=1e-9)
    assert np.diff(times_ns) / 1e9 == pytest.approx(np.diff(clip.times_s), abs=1e-8)


def test_an_older_file_is_replaced_by_force(run: Run, finished: Path, tmp_path: Path) -> None:
    file = tmp_path / "drive.mcap"
    file.write_bytes(b"older")
    result = run("export", finished / "scene", "--to", "mcap", "-o", file)
    assert result.code == 2
    assert "exists already" in result.err
    assert "--force" in result.err
    assert file.read_bytes() == b"older"
    assert "the frames" in run("export", finished / "scene", "--to", "mcap", "-o", file, "--force").out
    assert len(read(file).times(FRONT)) == 6


def test_a_scene_alone_is_rendered(run: Run, finished: Path, tmp_path: Path) -> None:
    shutil.copytree(finished / "scene", tmp_path / "alone" / "scene")
    result = run("export", tmp_path / "alone", "--to", "mcap", "-o", tmp_path / "drive.mcap")
    assert result.code == 0, result
    assert "Pictures are rendered from the scene" in result.out
    assert len(read(tmp_path / "drive.mcap").times(FRONT)) == 6


def test_stages_of_another_run_are_refused(run: Run, finished: Path, tmp_path: Path) -> None:
    out = Path(shutil.copytree(finished, tmp_path / "out"))
    clip = codec.read(out / "stages/prior", Clip)
    codec.write(out / "stages/prior", replace(clip, source_index=clip.source_index + 1), {})
    result = run("export", out, "--to", "mcap", "-o", tmp_path / "drive.mcap")
    assert result.code == 2
    assert "does not belong to the scene" in result.err
    assert [each.name for each in tmp_path.iterdir()] == ["out"]


def test_a_drawn_street_is_written(run: Run, tmp_path: Path) -> None:
    world, file = tmp_path / "world", tmp_path / "street.mcap"
    run("world", "make", "--cameras", "surround", "--frames", 2, "--size", "64x40", "--one-ray", "-o", world)
    result = run("export", world, "--to", "mcap", "-o", file)
    assert result.code == 0, result
    assert "those of the drawn street" in result.out
    found = read(file)
    assert len([topic for topic in found.messages if topic.endswith("image_rect_compressed")]) == 6
    assert len(found.times("/CAM_BACK/image_rect_compressed")) == 2


@pytest.mark.parametrize("name", ["drive", "drive.bag"])
def test_the_name_ends_in_mcap(run: Run, finished: Path, tmp_path: Path, name: str) -> None:
    result = run("export", finished, "--to", "mcap", "-o", tmp_path / name)
    assert result.code == 2
    assert "ends in .mcap, such as drive.mcap" in result.err
    assert list(tmp_path.iterdir()) == []


def test_the_package_is_asked_for(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "foxglove.channels", None)
    result = run("export", tmp_path, "--to", "mcap", "-o", tmp_path / "drive.mcap")
    assert result.code == 2
    assert "pip install -e '.[mcap]'" in result.err
