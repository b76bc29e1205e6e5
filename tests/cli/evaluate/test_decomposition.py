"""``dreamdrive evaluate decomposition``: its table, its file and its refusals."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from dreamdrive.cli.evaluate.decomposition import decomposition
from dreamdrive.data.layout_file import write_layout
from dreamdrive.errors import InputError
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Provenance, Scene
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive.stored import load_scene, save_scene
from streetworld import StreetOptions, draw_street, drive
from streetworld.files import write_world

INDEX = [1, 3]


@pytest.fixture(scope="module")
def street() -> DriveTruth:
    return drive(draw_street(3, StreetOptions(seconds=0.5)), 5, size=(80, 48))


@pytest.fixture(scope="module")
def place(street: DriveTruth, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a world, its layout and a scene of two of its frames: a wall of one Gaussian a pixel."""
    folder = tmp_path_factory.mktemp("decomposition")
    write_world({"front": street}, folder / "world")
    write_layout(street.world.layout, folder / "layout.json")
    static, dynamic = (_wall(street, street.moving[INDEX[0]] == moving) for moving in (False, True))
    scene = Scene(
        static,
        dynamic,
        None,
        (),
        None,
        None,
        tuple(street.cameras[i] for i in INDEX),
        street.times_s[INDEX] - street.times_s[INDEX[0]],
        np.zeros(2, dtype=bool),
        Provenance(source_index=tuple(INDEX)),
    )
    save_scene(scene, folder / "out" / "scene")
    return folder


def _wall(street: DriveTruth, mask: np.ndarray) -> Gaussians:
    camera, depth = street.cameras[INDEX[0]], street.depth_m[INDEX[0]]
    mask = mask & (depth > 0)
    local = camera.rays()[mask] * depth[mask][:, None]
    means = local @ camera.world_from_camera[:3, :3].T + camera.world_from_camera[:3, 3]
    count = len(means)
    return Gaussians(
        means=torch.from_numpy(means).float(),
        quaternions=torch.tensor([1.0, 0, 0, 0]).repeat(count, 1),
        log_scales=torch.from_numpy(np.log(0.5 * depth[mask] / camera.fx_px)).float()[:, None].repeat(1, 3),
        logit_opacities=torch.full((count,), 3.0),
        sh=torch.zeros(count, 1, 3),
        source_frame=torch.zeros(count, dtype=torch.int64),
    )


def test_figures_are_shown_and_written(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = place / "new" / "figures.json"
    decomposition(place / "out", place / "world", json=file)
    said = " ".join(capsys.readouterr().out.split())
    assert "2 frames, 80 px wide" in said
    assert "Gaussians: average precision" in said
    figures = json.loads(file.read_text())
    assert figures["labels"]["iou"] == 1
    assert figures["mask"]["recall"] > 0.7
    assert figures["fake"] == {"mean_m": 0, "moved_share": 0}
    assert figures["path_rms_m"] < 1e-6


def test_a_layout_is_drawn_as_the_scene_saw_it(place: Path) -> None:
    for world in ("world", "layout.json"):
        decomposition(place / "out", place / world, json=place / f"{world}.figures.json")
    written = [
        json.loads((place / f"{world}.figures.json").read_text()) for world in ("world", "layout.json")
    ]
    assert written[0] == written[1]


def test_what_is_no_scene_or_no_world_is_refused(place: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist; expected the folder that dreamdrive generate"):
        decomposition(tmp_path / "none", place / "world")
    with pytest.raises(InputError, match="none does not exist; expected a folder of dreamdrive world make"):
        decomposition(place / "out", tmp_path / "none")
    with pytest.raises(InputError, match=r"is no world: layout\.json is missing"):
        decomposition(place / "out", tmp_path)
    (tmp_path / "broken.json").write_text("{")
    with pytest.raises(InputError, match="is not JSON"):
        decomposition(place / "out", tmp_path / "broken.json")


def test_a_world_of_other_frames_is_refused(place: Path, street: DriveTruth, tmp_path: Path) -> None:
    short = replace(
        street,
        **{
            name: getattr(street, name)[:3]
            for name in (
                "frames",
                "times_s",
                "cameras",
                "depth_m",
                "instance",
                "semantic",
                "moving",
                "flow_px",
            )
        },
        boxes=(),
    )
    write_world({"front": short}, tmp_path / "short")
    with pytest.raises(InputError, match="has 3 frames but the scene shows frame 3"):
        decomposition(place / "out", tmp_path / "short")
    scene = load_scene(place / "out" / "scene")
    narrow = replace(scene, cameras=tuple(replace(c, width_px=64) for c in scene.cameras))
    save_scene(narrow, tmp_path / "narrow")
    with pytest.raises(InputError, match="are 64x48, those of the world 80x48"):
        decomposition(tmp_path / "narrow", place / "world")
