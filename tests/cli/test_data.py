"""``dreamdrive data``, and drives of a data set through ``generate``."""

import json
import shutil
from pathlib import Path

import cv2
import pytest

from dreamdrive.datasets.lidar_file import read_points
from dreamdrive.datasets.nuscenes import read_nuscenes
from dreamdrive.export.nuscenes.writer import write_nuscenes
from tests.cli.conftest import Run, code_of
from tests.logs import log
from tests.test_generate import shorten


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    logs = [log(tmp_path / name, name) for name in ("scene-0001", "scene-0002")]
    write_nuscenes(logs, tmp_path / "set", read_points)
    return tmp_path / "set"


@pytest.fixture(scope="module")
def street(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drawn street of six cameras in the format of nuScenes; who changes it takes a copy."""
    world, written = (tmp_path_factory.mktemp("drawn") / name for name in ("world", "street"))
    size = ("--frames", 6, "--size", "96x54", "--one-ray")
    with pytest.MonkeyPatch.context() as patch:
        assert code_of(patch, "world", "make", "--cameras", "surround", *size, "-o", world) == 0
        assert code_of(patch, "export", world, "--to", "nuscenes", "-o", written) == 0
    return written


def test_data_sets_are_listed(run: Run) -> None:
    result = run("data", "list")
    assert result.code == 0
    assert "nuscenes a folder of nuScenes" in result.out


def test_scenes_are_listed(run: Run, folder: Path) -> None:
    assert run("data", "list", folder).out == "0 scene-0001 1 scene-0002"


def test_a_whole_data_set_is_told(run: Run, folder: Path) -> None:
    result = run("data", "check", folder)
    assert result.code == 0
    assert "scene-0001 1.0 2 26 3 3 13 yes 5 scene-0002 1.0 2 26 3 3 13 yes 5 all is there" in result.out


def test_what_is_missing_is_told_and_the_rest_works(run: Run, folder: Path) -> None:
    for file in read_nuscenes(folder, "scene-0002").cameras[1].files:
        file.unlink()
    (folder / "v1.0-mini/log.json").touch()
    result = run("data", "check", folder)
    assert result.code == 2
    assert "scene-0001 1.0 2 26 3 3 13 yes 5 scene-0002 1.0 1 13 3 3 13 yes 5" in result.out
    assert "scene-0002: CAM_BACK_LEFT: none of its 13 pictures is there; the camera is left out" in result.out
    assert run("data", "check", folder, "--scene", "scene-0001").code == 0


def test_a_recording_has_no_scenes(run: Run, tmp_path: Path) -> None:
    result = run("data", "check", tmp_path)
    assert result.code == 2
    assert (
        "is a video or a folder of images, without scenes and labels; expected a folder of nuScenes"
        in result.err
    )


def test_nothing_is_no_data_set(run: Run, tmp_path: Path) -> None:
    assert "does not exist; expected a folder of a data set" in run("data", "list", tmp_path / "no").err


def test_a_scene_is_drawn(run: Run, folder: Path, tmp_path: Path) -> None:
    result = run("data", "show", folder, "--scene", 1, "-o", tmp_path / "seen.png")
    assert result.code == 0, result
    image = cv2.imread(str(tmp_path / "seen.png"))
    assert image.shape == (480, 2 * 640 + 625, 3)
    assert (
        "labelled times 0 to 2"
        in run("data", "show", folder, "--scene", 1, "--step", 9, "-o", tmp_path / "seen.png").err
    )


def test_which_scene_has_to_be_said(run: Run, folder: Path, tmp_path: Path) -> None:
    result = run("generate", folder, "-o", tmp_path / "out")
    assert result.code == 2
    assert "holds 2 scenes, scene-0001, scene-0002, and no --scene is given" in result.err


def test_fields_of_recordings_are_refused(run: Run, folder: Path, tmp_path: Path) -> None:
    result = run("generate", folder, "--scene", 0, "--fps", 3, "-o", tmp_path / "out")
    assert result.code == 2
    assert (
        "takes no --fps; it takes --cameras, --dataset, --frames, --hold-out, --scene, --size" in result.err
    )


def test_a_scene_is_made_of_a_drive(
    run: Run, street: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shorten(monkeypatch)
    written, out = tmp_path / "street", tmp_path / "out"
    shutil.copytree(street, written)
    which = ("--cameras", "front,front_left", "--frames", "0:4", "--hold-out", 4)
    chosen = (*which, "--knowledge", "none", "--quality", "draft")
    result = run("generate", written, *chosen, "-o", out)
    assert result.code == 0, result
    report = json.loads((out / "report.json").read_text())
    assert set(report["held_out"]) == {"2", "2_camera1"}
    assert "already finished" in run("generate", written, *chosen, "-o", out).out
    back = run("export", out, "--to", "nuscenes", "-o", tmp_path / "back")
    assert back.code == 0, back
    assert run("data", "check", tmp_path / "back").code == 0
    assert [c.name for c in read_nuscenes(tmp_path / "back", "back").cameras] == [
        "CAM_FRONT",
        "CAM_FRONT_LEFT",
    ]
    camera = read_nuscenes(written, "world").cameras[0]
    camera.files[0].write_bytes(camera.files[1].read_bytes())
    assert "other" in run("generate", written, *chosen, "-o", out).err  # the pictures decide


@pytest.mark.slow
def test_samples_are_made_of_drives_and_of_scenes(
    run: Run, street: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shorten(monkeypatch)
    written, out = street, tmp_path / "out"
    chosen = ("--cameras", "all", "--frames", "0:3", "--knowledge", "none", "--quality", "draft")
    assert run("generate", written, *chosen, "-o", out).code == 0
    small = ("--size", "64x32", "--cells", 16)
    result = run("dataset", "make", written, *small, "-o", tmp_path / "real")
    assert result.code == 0, result
    assert "2 samples in" in result.out
    made = ("dataset", "make", out, *small, "--per-scene", 4, "--seed", 1)
    assert "expected one that was made of a drive" in run(*made, "-o", tmp_path / "none").err
    result = run(*made, "--labels", written, "-o", tmp_path / "made")
    assert result.code == 0, result
    manifest = json.loads((tmp_path / "made" / "manifest.json").read_text())
    assert len(manifest["samples"]) + sum(manifest["left_out"].values()) == 4
    assert len(manifest["samples"][0]["cameras"]) == 6
    sets = ("--real", tmp_path / "real", "--synthetic", tmp_path / "made", "--validation", tmp_path / "real")
    refused = run("evaluate", "perception", "--mode", "augment", *sets, "--batch", 2, "-o", tmp_path / "n")
    assert refused.code == 2
    assert "has pictures of 64x32 and 16 cells, and the network takes pictures of 480x224" in refused.err


@pytest.mark.slow
def test_a_network_is_trained_on_samples_and_tested(run: Run, street: Path, tmp_path: Path) -> None:
    real = tmp_path / "real"
    run("dataset", "make", street, "--size", "208x96", "--cells", 104, "-o", real)
    sets = ("--real", real, "--synthetic", real, "--validation", real)
    asked = ("evaluate", "perception", "--mode", "synthetic-train", *sets, "--network", "quick")
    quick = (*asked, "--trunk", "street", "--steps", 1, "--batch", 2, "--alpha", 0.75, "-o", tmp_path / "n")
    result = run(*quick, "--json", tmp_path / "said.json")
    assert result.code == 0, result
    said = json.loads((tmp_path / "said.json").read_text())
    assert [each["trained_on"] for each in said["trials"]] == ["real", "synthetic"]
    assert said["trials"][0]["iou"] == said["trials"][1]["iou"]  # the same samples, the same seed
    training = said["regime"]["training"]
    assert (training["frozen_layers"], training["losses"]["alpha"]) == (2, 0.75)
    assert "--alpha 1: expected a number between 0 and 1" in run(*asked, "--alpha", 1, "-o", tmp_path).err


@pytest.mark.slow
def test_samples_are_made_of_scenes_that_a_prior_drew(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two scenes of one drive in one set, whose samples say which prior drew their frames."""
    shorten(monkeypatch)
    world, written, out = tmp_path / "world", tmp_path / "street", tmp_path / "out"
    run("world", "make", "--frames", 6, "--size", "96x54", "--one-ray", "-o", world)
    run("export", world, "--to", "nuscenes", "-o", written)
    chosen = ("--prior", "street-world", "--knowledge", "none", "--quality", "draft", "--size", "96x54")
    assert run("generate", written, *chosen, "-o", out).code == 0
    small = ("--size", "64x32", "--cells", 16, "--per-scene", 2)
    result = run("dataset", "make", out, out, "--labels", written, *small, "-o", tmp_path / "made")
    assert result.code == 0, result
    made = json.loads((tmp_path / "made" / "manifest.json").read_text())["samples"]
    assert {(each["kind"], each["prior"]) for each in made} == {("rendered", "street-world")}
    assert [each["id"] for each in made] == [f"world-rendered-000{number}" for number in range(4)]
    assert made[0]["boxes"] > 0


def test_sizes_of_samples_are_checked(run: Run, folder: Path, tmp_path: Path) -> None:
    made = ("dataset", "make", folder, "-o", tmp_path / "samples")
    assert "cut away; at most 270" in run(*made, "--size", "480x300").err
    assert "--cells 2: expected 8 or more" in run(*made, "--cells", 2).err
    assert (
        "is neither a scene nor a data set with labels"
        in run("dataset", "make", tmp_path, "-o", tmp_path / "samples").err
    )


def test_a_letter_is_not_drawn_over(run: Run, tmp_path: Path) -> None:
    letter = tmp_path / "letter.txt"
    letter.write_text("Dear reader")
    result = run("data", "show", tmp_path, "-o", letter)
    assert result.code == 2
    assert result.err == f"error: {letter}: expected a name that ends in .png, such as letter.png"
    assert letter.read_text() == "Dear reader"


@pytest.mark.parametrize("what", ["consistency", "decomposition", "geometry", "video"])
def test_figures_take_the_place_of_no_letter(run: Run, tmp_path: Path, what: str) -> None:
    letter = tmp_path / "letter.txt"
    letter.write_text("Dear reader")
    given = {
        "consistency": ("evaluate", "consistency", tmp_path),
        "decomposition": ("evaluate", "decomposition", tmp_path, tmp_path),
        "geometry": ("evaluate", "geometry", tmp_path, "--truth", tmp_path),
        "video": ("evaluate", "video", tmp_path, tmp_path),
    }
    result = run(*given[what], "--json", letter)
    assert result.code == 2
    assert f"{letter}: expected a name that ends in .json" in result.err
    assert letter.read_text() == "Dear reader"
