"""What decides over a result counts by its content."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dreamdrive.geometry import GeometryOptions
from dreamdrive.options import QUALITIES, with_method
from dreamdrive.run.request import _with_lens, request_of
from dreamdrive.scene.control import Control


def test_the_lens_of_a_model_is_taken_out_of_the_frames(tmp_path: Path) -> None:
    frames = [{"file_path": f"{i}.png", "transform_matrix": np.eye(4).tolist()} for i in range(2)]
    shared = {"w": 64, "h": 40, "fl_x": 60.0, "k1": -0.1}
    path = tmp_path / "transforms.json"
    path.write_text(json.dumps({**shared, "frames": frames}))
    assert _with_lens(Control(), path).intrinsics == path
    assert _with_lens(Control(), tmp_path).intrinsics == path
    own = Control(intrinsics=tmp_path / "own.json")
    assert _with_lens(own, path) == own
    path.write_text(json.dumps({**shared, "k1": 0.0, "frames": frames}))
    assert _with_lens(Control(), path) == Control()


def test_all_that_decides_over_the_geometry_decides_over_the_result(tmp_path: Path) -> None:
    path = tmp_path / "poses.txt"
    path.write_text("1 0 0 0 0 1 0 0 0 0 1 0\n")
    before = request_of(Control(), prior="street-world", geometry_files=path).digests
    (tmp_path / "geometry.json").write_text("{}")
    assert request_of(Control(), prior="street-world", geometry_files=path).digests != before


@pytest.mark.parametrize("folder", ["frames", "rig"])
def test_pictures_in_folders_below_the_input_count(tmp_path: Path, folder: str) -> None:
    picture = tmp_path / ("frames" if folder == "frames" else "left") / "0000.png"
    picture.parent.mkdir()
    if folder == "rig":
        (tmp_path / "rig.json").write_text("{}")
    picture.write_bytes(b"one")
    before = request_of(Control(tmp_path)).digests
    picture.write_bytes(b"two")
    assert request_of(Control(tmp_path)).digests != before


@pytest.mark.parametrize(
    ("prior", "height", "network"), [("photo", 1, 1), ("replay", 0, 1), ("street-world", 0, 0)]
)
def test_frames_depend_on_what_a_prior_looks_by_and_on_nothing_else(
    tmp_path: Path, prior: str, height: bool, network: bool
) -> None:
    picture = tmp_path / "street.png"
    picture.write_bytes(b"one")
    control = Control() if prior == "street-world" else Control(picture)
    draft = QUALITIES["draft"]
    higher = replace(draft, geometry=replace(draft.geometry, camera_height_m=2.0))
    blind = replace(draft, knowledge="none", device="cuda")
    plain, high, unseen = (request_of(control, prior=prior, options=each) for each in (draft, higher, blind))
    assert (high.reading != plain.reading, unseen.reading != plain.reading) == (height, network)


def test_changed_options_have_no_name_and_what_is_chosen_beside_the_quality_does_not_matter() -> None:
    draft = QUALITIES["draft"]
    street = replace(draft, representation="static", geometry=GeometryOptions(camera_height_m=2.0))
    own = replace(draft, fit=replace(draft.fit, steps=7))
    made = [request_of(Control(seed=3), prior="street-world", options=one) for one in ("draft", street, own)]
    assert [one.options.name for one in made] == ["draft", "draft", "custom"]
    assert [one.document["seed"] for one in made] == [3, 3, 3]
    assert made[1].document["options"]["camera_height_m"] == 2.0
    assert made[2].document["options"]["fit"]["steps"] == 7


def test_the_papers_method_keeps_the_name_of_the_quality() -> None:
    paper = with_method(QUALITIES["draft"], "paper")
    made = request_of(Control(), prior="street-world", options=paper)
    chosen = made.document["options"]
    assert (chosen["quality"], chosen["method"], chosen["group"]["clusters"]) == ("draft", "paper", "density")
    assert (chosen["score"]["target"], chosen["fit"]["loss"], chosen["cast"]["tracks"]) == (
        "error",
        "paper",
        False,
    )
