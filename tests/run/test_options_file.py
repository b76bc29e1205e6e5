"""Options of every stage from a TOML file."""

from dataclasses import replace
from pathlib import Path

import pytest

from dreamdrive.errors import InputError
from dreamdrive.options import QUALITIES
from dreamdrive.run.options_file import read_options

DRAFT = QUALITIES["draft"]


def read(folder: Path, text: str):
    path = folder / "own.toml"
    path.write_text(text)
    return read_options(path, DRAFT)


def test_what_the_file_names_is_changed_and_nothing_else(tmp_path: Path) -> None:
    made = read(
        tmp_path,
        'representation = "static"\n[fit]\nsteps = 7\n[geometry]\ncamera_height_m = 2\n'
        "[geometry.moving]\nrounds = 1\noncoming = false\n",
    )
    moving = replace(DRAFT.geometry.moving, rounds=1, oncoming=False)
    wanted = replace(
        DRAFT,
        representation="static",
        fit=replace(DRAFT.fit, steps=7),
        geometry=replace(DRAFT.geometry, camera_height_m=2.0, moving=moving),
    )
    assert made == wanted
    assert read(tmp_path, "") == DRAFT


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[fit]\nstep = 7", "there is no option fit.step; did you mean fit.steps"),
        ("[fit]\nstride_px = 3", "there is no option fit.stride_px; did you mean seeds.stride_px"),
        ("zzzzzzzz = 7", "there is no option zzzzzzzz; expected one of "),
        ("[fit]\nsteps = 'many'", "fit.steps: Expected `int`, got `str`"),
        ("[fit]\nsteps = -1", "fit.steps = -1; expected a finite number, not below 0"),
        ("[fit]\ndepth_weight = nan", "fit.depth_weight = nan; expected a finite number"),
        ("fit = 3", "fit is a table of options: write [fit] and one name = value a line"),
        ("seed = 3", "seed is set by --seed"),
        ("[geometry]\nweights = 'a'", "geometry.weights is set by --weights or --geometry-weights"),
        ("representation = 'cubes'", "representation: Invalid enum value 'cubes'"),
        ("[geometry]\ncamera_height_m = 0.0", "--camera-height 0: expected metres above the road"),
        ("fit = [", "is not TOML"),
    ],
)
def test_what_is_wrong_is_said_with_what_is_near(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    assert said in str(caught.value)
