"""Options of every stage from a TOML file."""

import json
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import pytest

from dreamdrive.errors import InputError
from dreamdrive.names import QualityName
from dreamdrive.options import QUALITIES, with_method
from dreamdrive.run.options_file import read_options

DRAFT = QUALITIES["draft"]
ELSEWHERE = "quality", "method", "knowledge", "geometry.weights"


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


def written(options: object, before: str = "") -> str:
    """All options as TOML, in tables, but those that flags set."""
    lines, tables = [], []
    for field in fields(options):  # type: ignore[arg-type]
        name, value = f"{before}{field.name}", getattr(options, field.name)
        if is_dataclass(value):
            tables.append(f"[{name}]\n{written(value, f'{name}.')}")
        elif name not in ELSEWHERE:
            lines.append(f"{field.name} = {json.dumps('none' if value is None else value)}\n")
    return "".join([*lines, *tables])


@pytest.mark.parametrize("quality", ["draft", "standard", "high"])
def test_all_options_of_the_papers_method_can_be_written(tmp_path: Path, quality: QualityName) -> None:
    wanted = with_method(QUALITIES[quality], "paper")
    text = written(wanted)
    assert 'window = "none"' in text
    assert read(tmp_path, text) == replace(wanted, quality=DRAFT.quality, method=DRAFT.method)
    assert read(tmp_path, written(DRAFT)) == DRAFT


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[fit]\nstep = 7", "there is no option fit.step; did you mean fit.steps"),
        ("[fit]\nstride_px = 3", "there is no option fit.stride_px; did you mean seeds.stride_px"),
        ("zzzzzzzz = 7", "there is no option zzzzzzzz; expected one of "),
        ("[fit]\nsteps = 'many'", "fit.steps: Expected `int`, got `str`"),
        ("[fit]\nsteps = 'none'", "fit.steps: Expected `int`, got `null`"),
        ("method = 'paper'", "method is set by --method"),
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
