"""``dreamdrive evaluate geometry``: its tables, its files and its refusals."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch

from dreamdrive.run import codec
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Provenance, Scene
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive.stored import save_scene
from streetworld.files import write_world
from tests.cli.conftest import Run
from tests.streets import bare_street, street_clip, true_geometry

SIZE = (80, 48)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A world, the same as a recording with depth, and a run of it whose geometry is a tenth too small."""
    street = bare_street()
    folder = tmp_path_factory.mktemp("geometry")
    write_world({"front": street}, folder / "world")
    _record(street, folder / "recording")
    true = true_geometry(street)
    cameras = tuple(
        c.at(np.vstack([c.world_from_camera[:3] * [1, 1, 1, 0.9], [0, 0, 0, 1]])) for c in true.cameras
    )
    geometry = replace(true, cameras=cameras, depth_m=0.9 * true.depth_m)
    clip = street_clip(street)
    codec.write(folder / "out/stages/geometry", geometry, {"key": "g"})
    codec.write(folder / "out/stages/prior", clip, {"key": "p"})
    nothing = Gaussians(
        *(torch.zeros(0, n) for n in (3, 4, 3)),
        logit_opacities=torch.zeros(0),
        sh=torch.zeros(0, 1, 3),
        source_frame=torch.zeros(0, dtype=torch.int64),
    )
    scene = Scene(
        nothing,
        nothing,
        None,
        (),
        None,
        None,
        cameras,
        clip.times_s,
        clip.held_out,
        Provenance(source_index=tuple(range(5)), input="world"),
    )
    save_scene(scene, folder / "out" / "scene")
    return folder


def _record(street: DriveTruth, folder: Path) -> None:
    """What is read quicker than a world: poses, calibration and the depth of all pixels."""
    (folder / "lidar_depth").mkdir(parents=True)
    rows = [" ".join(map(repr, c.world_from_camera[:3].ravel().tolist())) for c in street.cameras]
    (folder / "poses.txt").write_text("\n".join(rows))
    shutil.copy(folder.parent / "world" / "cameras.json", folder / "meta.json")
    for frame, depth_m in enumerate(street.depth_m):
        v, u = np.nonzero(depth_m)
        np.savez(folder / "lidar_depth" / f"{frame:04d}.npz", u=u, v=v, depth=depth_m[v, u])


def test_figures_are_shown_written_and_drawn(run: Run, place: Path, tmp_path: Path) -> None:
    files = tmp_path / "new" / "figures.json", tmp_path / "picture.png"
    result = run(
        "evaluate",
        "geometry",
        place / "out",
        "--truth",
        place / "world",
        "--json",
        files[0],
        "--picture",
        files[1],
    )
    assert result.code == 0, result.err
    assert "5 frames, 80 px wide" in result.out
    assert "scale: lengths of the scene -10.00 % too long" in result.out
    assert "as it is" in result.out
    figures = json.loads(files[0].read_text())
    assert figures["scale"]["metres_per_unit"] == pytest.approx(1 / 0.9, rel=1e-5)
    assert figures["path"]["ate_m"] < 1e-6
    whole = figures["depth"]["groups"][0]
    assert whole["coverage"] == 1
    assert whole["as_is"]["abs_rel"] == pytest.approx(0.1, rel=1e-5)
    assert whole["path_scale"]["abs_rel"] < 1e-5
    assert [g["name"] for g in figures["depth"]["groups"]] == [
        "all",
        "static",
        "moving",
        "0-10 m",
        "10-20 m",
        "20-40 m",
        "40-80 m",
    ]
    picture = cv2.imread(str(files[1]))
    assert picture is not None
    assert picture.shape[1] == 2 * SIZE[0]


def test_a_run_stopped_after_its_geometry_is_enough(run: Run, place: Path, tmp_path: Path) -> None:
    shutil.copytree(place / "out" / "stages", tmp_path / "out" / "stages")
    for out, name in (
        (tmp_path / "out", "stopped"),
        (place / "out", "finished"),
        (place / "out/scene", "inside"),
    ):
        file = tmp_path / f"{name}.json"
        assert run("evaluate", "geometry", out, "--truth", place / "recording", "--json", file).code == 0
    one, *others = ((tmp_path / f"{name}.json").read_text() for name in ("stopped", "finished", "inside"))
    assert others == [one, one]


def test_without_its_stages_a_scene_has_cameras_alone(run: Run, place: Path, tmp_path: Path) -> None:
    shutil.copytree(place / "out" / "scene", tmp_path / "out" / "scene")
    for out in (tmp_path / "out", tmp_path / "out" / "scene"):
        result = run(
            "evaluate", "geometry", out, "--truth", place / "recording", "--json", tmp_path / "f.json"
        )
        assert result.code == 0, result.err
        assert "stages/geometry is not there: depth, confidence and what fixed the scale" in result.out
        figures = json.loads((tmp_path / "f.json").read_text())
        assert figures["depth"] is None
        assert figures["path"]["ate_m"] < 1e-6
        assert "is not there" in figures["notes"][0]


def test_what_cannot_be_compared_is_refused(run: Run, place: Path, tmp_path: Path) -> None:
    def said(out: Path, truth: Path) -> str:
        result = run("evaluate", "geometry", out, "--truth", truth)
        assert result.code == 2
        return result.err.replace(str(tmp_path), "PLACE").replace(str(place), "PLACE")

    none = tmp_path / "none"
    assert said(none, place / "recording") == (
        "error: PLACE/none does not exist; expected the folder that dreamdrive generate wrote"
    )
    assert said(place / "out", none).startswith("error: PLACE/none does not exist; expected a folder of")
    assert said(place / "out", tmp_path).startswith("error: PLACE holds no truth: neither layout.json nor")
    other = shutil.copytree(place / "out", tmp_path / "other")
    geometry = codec.read(other / "stages/geometry")
    codec.write(other / "stages/geometry", replace(geometry, cameras=geometry.cameras[::-1]), {})  # type: ignore[type-var, attr-defined]
    assert said(other, place / "recording") == (
        "error: PLACE/other holds a scene and the geometry of another run: their cameras differ; finish that "
        "run, or run generate again with the options of the scene"
    )
    (other / "stages/geometry/result.safetensors").write_bytes(b"cut")
    assert "stages/geometry is damaged" in said(other, place / "recording")
