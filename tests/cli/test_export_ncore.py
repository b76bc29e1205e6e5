"""``dreamdrive export --to ncore``."""

import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dreamdrive import load_scene
from dreamdrive.run import codec
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from tests.cli.conftest import Run

pytest.importorskip("ncore.data.v4", reason="needs the extra ncore")

from tests.export.ncore_reader import read, world_from_camera


@pytest.fixture
def out(finished: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(finished, tmp_path / "out"))


def test_frames_of_a_run_are_written_with_its_poses(run: Run, out: Path, tmp_path: Path) -> None:
    result = run("export", out, "--to", "ncore", "-o", tmp_path / "set")
    assert result.code == 0, result
    assert "Pictures are the frames that the scene was made of." in result.out
    clip, geometry = codec.read(out / "stages/prior", Clip), codec.read(out / "stages/geometry", Geometry)
    sequence = read(tmp_path / "set")
    sensor = sequence.get_camera_sensor("CAM_FRONT")
    for frame in range(4):
        np.testing.assert_array_equal(sensor.get_frame_image_array(frame), clip.frames[frame])
    poses = world_from_camera(sequence, "CAM_FRONT")
    ours = np.stack([camera.world_from_camera for camera in geometry.cameras])
    np.testing.assert_allclose(np.linalg.inv(poses[0]) @ poses, np.linalg.inv(ours[0]) @ ours, atol=1e-9)
    again = run("export", out / "scene", "--to", "ncore", "-o", tmp_path / "set")
    assert again.code == 2
    assert "exists already" in again.err
    assert (
        "the frames" in run("export", out / "scene", "--to", "ncore", "-o", tmp_path / "set", "--force").out
    )


def test_a_scene_alone_is_rendered(run: Run, out: Path, tmp_path: Path) -> None:
    assert run("clean", out).code == 0
    result = run("export", out, "--to", "ncore", "-o", tmp_path / "set")
    assert result.code == 0, result
    assert "Pictures are rendered from the scene" in result.out
    sensor = read(tmp_path / "set").get_camera_sensor("CAM_FRONT")
    assert sensor.frames_count == len(load_scene(out / "scene").cameras)


@pytest.mark.parametrize("stage", ["prior", "geometry"])
def test_stages_of_another_run_are_refused(run: Run, out: Path, tmp_path: Path, stage: str) -> None:
    if stage == "prior":
        clip = codec.read(out / "stages/prior", Clip)
        codec.write(out / "stages/prior", replace(clip, source_index=clip.source_index + 1), {})
    else:
        geometry = codec.read(out / "stages/geometry", Geometry)
        away = np.eye(4)
        away[0, 3] = 1
        cameras = tuple(camera.at(away @ camera.world_from_camera) for camera in geometry.cameras)
        codec.write(out / "stages/geometry", replace(geometry, cameras=cameras), {})
    result = run("export", out, "--to", "ncore", "-o", tmp_path / "set")
    assert result.code == 2
    assert "does not belong to the scene" in result.err
    assert not (tmp_path / "set").exists()


def test_a_drawn_street_is_written(run: Run, tmp_path: Path) -> None:
    world = tmp_path / "world"
    run("world", "make", "--cameras", "surround", "--frames", 2, "--size", "64x40", "--one-ray", "-o", world)
    result = run("export", world, "--to", "ncore", "-o", tmp_path / "street")
    assert result.code == 0, result
    assert "those of the drawn street" in result.out
    sequence = read(tmp_path / "street")
    assert len(sequence.camera_ids) == 6
    assert sequence.get_camera_sensor("CAM_BACK").frames_count == 2


def test_the_package_is_asked_for(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ncore.data.v4", None)
    result = run("export", tmp_path, "--to", "ncore", "-o", tmp_path / "set")
    assert result.code == 2
    assert "pip install -e '.[ncore]'" in result.err
