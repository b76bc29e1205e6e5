"""What may be asked of ``dreamdrive export`` beside the format."""

import json
from pathlib import Path

import numpy as np
import pytest

from dreamdrive import InputError, load_scene
from dreamdrive.cli.terminal.arguments import parse_times
from dreamdrive.data import read_trajectory, write_trajectory
from dreamdrive.data.pictures.picture_file import write_picture
from dreamdrive.datasets.nuscenes import read_nuscenes
from dreamdrive.drive import drives_of
from dreamdrive.edit import EDITS
from dreamdrive.export import EXPORTS
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.stored import save_scene
from tests.cli.conftest import Run
from tests.cli.test_commands import driving
from tests.export.ply_file import columns, count
from tests.export.scenes_of_drives import upright_scene_of
from tests.scene.scenes import make_scene

EXTRAS = {"ncore": "ncore.data.v4", "mcap": "foxglove"}


@pytest.fixture
def out(tmp_path: Path) -> Path:
    save_scene(driving(make_scene()), tmp_path / "out" / "scene")
    return tmp_path / "out"


def test_a_new_drive_takes_the_place_of_the_recorded_one(run: Run, finished: Path, tmp_path: Path) -> None:
    file = tmp_path / "shift.txt"
    done = run("export", finished, "--to", "tum", "--trajectory", "shift", "--shift-m", 1, "-o", file)
    assert done.code == 0, done
    (drive,) = drives_of(load_scene(finished / "scene"), ["shift"], 1.0, None)
    found = read_trajectory(file)
    np.testing.assert_allclose(found.world_from_camera, drive.path.world_from_camera, atol=1e-6)
    np.testing.assert_allclose(found.times_s, drive.path.times_s)


def test_its_pictures_are_rendered_at_its_rate(run: Run, finished: Path, tmp_path: Path) -> None:
    words = ("--trajectory", "stop", "--fps", "4")
    done = run("export", finished, "--to", "nerfstudio", *words, "-o", tmp_path / "set")
    assert done.code == 0, done
    assert "Pictures are rendered from the scene along stop." in done.out
    frames = json.loads((tmp_path / "set" / "transforms.json").read_text())["frames"]
    times_s = [frame["time"] for frame in frames]
    assert np.diff(times_s) == pytest.approx(0.25)
    assert len(frames) == len(list((tmp_path / "set" / "images").iterdir())) == 3


def test_without_an_actor_no_recorded_frame_shows_it(run: Run, out: Path, tmp_path: Path) -> None:
    done = run("export", out, "--to", "colmap", "--without", 0, "-o", tmp_path / "set")
    assert done.code == 0, done
    assert "without what was left out" in done.out
    kept = len(load_scene(out / "scene").without(0).at(0.5).means)
    assert (
        run("export", out, "--to", "ply", "--without", 0, "--times", "0.5", "-o", tmp_path / "a.ply").code
        == 0
    )
    assert count(tmp_path / "a.ply") == kept < len(load_scene(out / "scene").at(0.5).means)


def test_moments_are_those_that_are_asked_for(run: Run, out: Path, tmp_path: Path) -> None:
    scene = load_scene(out / "scene")
    done = run("export", out, "--to", "ply", "--times", "0.4:0.5:0.05", "-o", tmp_path / "all")
    assert done.code == 0, done
    files = sorted((tmp_path / "all" / "frames").iterdir())
    assert len(files) == 3
    for file, time_s in zip(files, (0.4, 0.45, 0.5), strict=True):
        found = columns(file)
        means = np.column_stack([found[axis] for axis in "xyz"])
        np.testing.assert_allclose(means, scene.at(time_s).means.numpy(), atol=1e-6)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("ply --trajectory stop", "--to ply takes no --trajectory; these do: nuscenes, ncore, mcap, colmap"),
        ("tum --times 0.4", "--to tum takes no --times; these do: ply"),
        ("tum --fps 5", "give --trajectory NAME|FILE with it"),
        ("tum --trajectory nowhere", "--trajectory nowhere: no such file"),
        ("ply --times 0.4,0.5", "holds one moment, and 2 are asked for"),
        ("ply --times 7", "--times: 7 to 7 s; the scene is known from 0.333333 to 0.533333 s"),
        ("ply --without 5", "--without: no actor 5; there are 0"),
    ],
)
def test_what_cannot_be_had_is_refused(run: Run, out: Path, tmp_path: Path, words: str, said: str) -> None:
    done = run(
        "export", out, "--to", *words.split(), "-o", tmp_path / f"a{'.ply' if 'ply' in words else '.txt'}"
    )
    assert done.code == 2
    assert said in done.err
    assert [each.name for each in tmp_path.iterdir()] == ["out"]


def test_a_drawn_street_is_written_as_it_was_drawn(run: Run, tmp_path: Path) -> None:
    run("world", "make", "--frames", 2, "--size", "64x40", "--one-ray", "-o", tmp_path / "world")
    words = ("--to", "nuscenes", "--trajectory", "stop", "-o", tmp_path / "set")
    done = run("export", tmp_path / "world", *words)
    assert done.code == 2
    assert "is a drawn street" in done.err


def test_every_option_is_taken_by_some_format() -> None:
    taken = {option for name in EXPORTS for option in EXPORTS[name].takes}
    assert taken >= {"trajectory", "times", "blur", "labels"}


@pytest.mark.parametrize(
    ("text", "times_s"), [("0.5", [0.5]), ("0,0.5,2", [0, 0.5, 2]), ("0:1:0.25", [0, 0.25, 0.5, 0.75, 1])]
)
def test_times_are_seconds(text: str, times_s: list[float]) -> None:
    assert parse_times(text) == pytest.approx(times_s)


@pytest.mark.parametrize(
    "text", ["", "a", "1,0", "1,1", "nan", "0:1", "1:0:0.1", "0:1:0", "0:1:nan", "0:1e9:1e-9"]
)
def test_other_times_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="expected seconds, such as"):
        parse_times(text)


def test_a_file_with_one_pose_is_a_drive(run: Run, finished: Path, tmp_path: Path) -> None:
    write_trajectory(Trajectory(np.eye(4)[None], np.array([0.1])), tmp_path / "one.json")
    words = ("--trajectory", tmp_path / "one.json", "-o", tmp_path / "path.txt")
    assert run("export", finished, "--to", "tum", *words).code == 0
    assert len(read_trajectory(tmp_path / "path.txt")) == 1


BLURRED = [name for name in EXPORTS if "blur" in EXPORTS[name].takes]
GREY = 77
"""Of all that is written in place of what the network would make."""


@pytest.fixture
def written(monkeypatch: pytest.MonkeyPatch) -> list[np.ndarray]:
    """All pictures of bytes on their way to the disk, where blurring makes them grey."""
    found: list[np.ndarray] = []

    def note(path: Path, picture: np.ndarray, **how: int) -> None:
        if picture.dtype == np.uint8:
            found.append(picture)
        write_picture(path, picture, **how)

    monkeypatch.setattr("dreamdrive.cli.export.blurring", lambda: lambda frame: np.full_like(frame, GREY))
    for module in ("log", "shots", "cameras.views", "surfaces.flow"):
        monkeypatch.setattr(f"dreamdrive.export.{module}.write_picture", note)
    return found


def test_all_formats_with_pictures_can_be_blurred() -> None:
    pictures = {name for name in EXPORTS if "clip" in EXPORTS[name].takes} | {"nuscenes"}
    assert set(BLURRED) == pictures


@pytest.mark.parametrize("kind", BLURRED)
def test_every_picture_of_a_scene_is_blurred(
    run: Run, finished: Path, tmp_path: Path, written: list[np.ndarray], kind: str
) -> None:
    if kind in EXTRAS:
        pytest.importorskip(EXTRAS[kind])
    ending = ".mcap" if kind == "mcap" else ""
    done = run("export", finished, "--to", kind, "--blur", "-o", tmp_path / f"recorded{ending}")
    assert done.code == 0, done
    count = len(written)
    words = ("--trajectory", "stop", "--fps", 4)
    done = run("export", finished, "--to", kind, "--blur", *words, "-o", tmp_path / f"rendered{ending}")
    assert done.code == 0, done
    assert len(written) > count >= 4
    assert all((picture == GREY).all() for picture in written)


@pytest.mark.parametrize("kind", [kind for kind in BLURRED if EXPORTS[kind].world is not None])
def test_every_picture_of_a_drawn_street_is_blurred(
    run: Run, tmp_path: Path, written: list[np.ndarray], kind: str
) -> None:
    if kind in EXTRAS:
        pytest.importorskip(EXTRAS[kind])
    run("world", "make", "--frames", 2, "--size", "64x40", "--one-ray", "-o", tmp_path / "world")
    file = tmp_path / f"set{'.mcap' if kind == 'mcap' else ''}"
    done = run("export", tmp_path / "world", "--to", kind, "--blur", "-o", file)
    assert done.code == 0, done
    assert len(written) == 2
    assert all((picture == GREY).all() for picture in written)


def test_labels_are_those_of_the_drive(run: Run, out: Path, one_drive: Path, tmp_path: Path) -> None:
    words = ("--to", "nuscenes", "--labels", one_drive, "-o", tmp_path / "set")
    done = run("export", out, *words)
    assert done.code == 2
    assert "was made of no drive of a data set" in done.err
    done = run("export", out, "--to", "nuscenes", "--labels", tmp_path / "none", "-o", tmp_path / "set")
    assert done.code == 2
    assert "does not exist; expected a folder of a data set" in done.err


@pytest.mark.parametrize(("edited", "place"), [(False, "."), (True, "."), (True, "scene")])
def test_labels_are_carried_along(
    run: Run, one_drive: Path, tmp_path: Path, edited: bool, place: str
) -> None:
    save_scene(upright_scene_of(read_nuscenes(one_drive, "scene-0001")), tmp_path / "out" / "scene")
    if edited:
        (tmp_path / "out" / EDITS).write_text("{}")
    words = ("--to", "nuscenes", "--labels", one_drive, "-o", tmp_path / "set")
    done = run("export", tmp_path / "out" / place, *words)
    assert done.code == 0, done
    found = {box.id for box in read_nuscenes(tmp_path / "set", "set").boxes}
    assert found == ({"parked", "cone"} if edited else {"car", "parked", "cone"})
