"""Where results go: never out of the folder, never where generate would stumble over them."""

from pathlib import Path

import numpy as np
import pytest

from dreamdrive.drive.drives import Drive
from dreamdrive.errors import InputError
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.show.rendering import RenderOptions, places

PATH = Trajectory(np.eye(4)[None], np.zeros(1))
ONE, TWO = [Drive("stop", PATH)], [Drive("stop", PATH), Drive("mine", PATH)]


@pytest.mark.parametrize(
    ("options", "names"),
    [
        (RenderOptions(), ["stop.mp4", "mine.mp4"]),
        (RenderOptions("depth"), ["stop_depth.mp4", "mine_depth.mp4"]),
        (RenderOptions(format="png"), ["stop", "mine"]),
        (RenderOptions("static", "npz"), ["stop_static_npz", "mine_static_npz"]),
    ],
)
def test_each_kind_of_result_has_its_own_place(
    tmp_path: Path, options: RenderOptions, names: list[str]
) -> None:
    assert places(tmp_path, None, TWO, options) == [tmp_path / "video" / name for name in names]
    assert places(tmp_path / "out", tmp_path / "mine", TWO, options) == [
        tmp_path / "mine" / name for name in names
    ]


def test_of_one_drive_the_result_is_what_was_named(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert places(out, tmp_path / "film.MP4", ONE, RenderOptions()) == [tmp_path / "film.MP4"]
    assert places(out, tmp_path / "film", ONE, RenderOptions(format="png")) == [tmp_path / "film"]
    assert places(out, out / "video" / "a.mp4", ONE, RenderOptions()) == [out / "video" / "a.mp4"]


def refusal(out: Path, output: Path | None, drives: list[Drive], options: RenderOptions) -> str:
    with pytest.raises(InputError) as error:
        places(out, output, drives, options)
    return str(error.value)


def test_names_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    out, film = tmp_path / "out", tmp_path / "film.avi"
    assert refusal(out, film, ONE, RenderOptions()) == f"-o {film}: expected a name that ends in .mp4"
    film = tmp_path / "film.mp4"
    assert refusal(out, film, TWO, RenderOptions()) == (
        f"-o {film}: expected a folder for 2 trajectories, not the name of a file"
    )
    assert refusal(out, film, ONE, RenderOptions(format="npz")) == (
        f"-o {film}: expected a folder for --format npz, not the name of a file"
    )
    assert refusal(out, Path(), ONE, RenderOptions(format="png")) == "-o .: expected the name of a new folder"


def test_nothing_is_put_among_the_results_of_generate(tmp_path: Path) -> None:
    out = tmp_path / "out"
    (out / "video").mkdir(parents=True)
    (tmp_path / "link").symlink_to(out)
    for output in (out / "a.mp4", tmp_path / "link" / "a.mp4", out / "video" / ".." / "a.mp4"):
        assert refusal(out, output, ONE, RenderOptions()) == (
            f"-o {output} lies in {out}, where generate would refuse to go on beside it; choose "
            f"{out / 'video'} or another place"
        )


def test_links_in_the_folder_are_not_followed(tmp_path: Path) -> None:
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    out.mkdir()
    elsewhere.mkdir()
    (out / "video").symlink_to(elsewhere)
    said = "is a link; dreamdrive neither reads nor writes through links there"
    assert refusal(out, None, ONE, RenderOptions()) == f"{out / 'video'} {said}"
    (out / "video").unlink()
    (out / "video").mkdir()
    (out / "video" / "stop").symlink_to(elsewhere)
    assert refusal(out, None, ONE, RenderOptions(format="png")) == f"{out / 'video' / 'stop'} {said}"
