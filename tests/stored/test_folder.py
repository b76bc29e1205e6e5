"""The scene folder: round trip, equal bytes, refusal of what is damaged, nothing lost on failure."""

import hashlib
import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.files.output import MARK
from dreamdrive.scene.scene import Provenance
from dreamdrive.scene.street.log import OfLog
from dreamdrive.stored import load_scene, save_scene
from tests.scene.scenes import make_baseline, make_scene, per_frame_scene
from tests.stored.test_hostile_folder import change


def contents(path: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in sorted(path.iterdir()) if p.name != MARK}


@pytest.mark.parametrize(("dynamic", "full"), [(4, True), (0, True), (0, False)])
def test_round_trip(tmp_path: Path, dynamic: int, full: bool) -> None:
    scene = make_scene(dynamic, full)
    save_scene(scene, tmp_path / "scene")
    loaded = load_scene(tmp_path / "scene")
    before, after = scene.at(0.4).tensors(), loaded.at(0.4).tensors()
    assert before.keys() == after.keys()
    assert all(torch.equal(before[name], after[name]) for name in before)
    assert loaded.static.features is not None
    assert (loaded.times_s == scene.times_s).all()
    assert (loaded.held_out == scene.held_out).all()
    assert loaded.cameras[1].cx_px == 16.5
    assert [a.name for a in loaded.actors] == [a.name for a in scene.actors]
    assert (loaded.sky is None) == (scene.sky is None)
    assert (loaded.exposure is None) == (scene.exposure is None)


@pytest.mark.parametrize("kind", ["hexplane", "vibration"])
def test_round_trip_of_the_other_motions(tmp_path: Path, kind: str) -> None:
    scene = make_baseline(kind)
    save_scene(scene, tmp_path / "a")
    loaded = load_scene(tmp_path / "a")
    assert loaded.deformation.config == scene.deformation.config
    for t_s in (0.1, 0.4):
        before, after = scene.at(t_s).tensors(), loaded.at(t_s).tensors()
        assert before.keys() == after.keys()
        assert all(torch.equal(before[name], after[name]) for name in before)
    assert not torch.equal(loaded.at(0.1).means, loaded.at(0.4).means)
    save_scene(loaded, tmp_path / "b")
    assert contents(tmp_path / "a") == contents(tmp_path / "b")


def test_a_scene_is_of_the_first_format_that_can_hold_it(tmp_path: Path) -> None:
    versions = {}
    scenes = {"old": make_scene(), "new": make_baseline("vibration"), "drifts": per_frame_scene()}
    for name, scene in scenes.items():
        save_scene(scene, tmp_path / name)
        versions[name] = json.loads((tmp_path / name / "scene.json").read_text())["version"]
    assert versions == {"old": 1, "new": 2, "drifts": 3}


def test_a_street_that_drifts_comes_back_and_needs_life_spans(tmp_path: Path) -> None:
    scene = per_frame_scene()
    save_scene(scene, tmp_path / "a")
    loaded = load_scene(tmp_path / "a")
    assert loaded.moves_per_frame
    assert torch.equal(loaded.at(0.4).means, scene.at(0.4).means)
    save_scene(replace(scene, static=replace(scene.static, lifespan=None)), tmp_path / "b")
    with pytest.raises(InputError, match="no life spans"):
        load_scene(tmp_path / "b")


def test_a_motion_of_another_kind_is_refused(tmp_path: Path) -> None:
    scene = make_baseline("vibration")
    scene.deformation.kind = "wobble"
    save_scene(scene, tmp_path / "s")
    with pytest.raises(InputError, match="wobble"):
        load_scene(tmp_path / "s")


def test_equal_scenes_give_equal_bytes(tmp_path: Path) -> None:
    torch.manual_seed(0)
    first = make_scene()
    torch.manual_seed(0)
    second = make_scene()
    save_scene(first, tmp_path / "a")
    save_scene(second, tmp_path / "b")
    assert contents(tmp_path / "a") == contents(tmp_path / "b")
    save_scene(load_scene(tmp_path / "a"), tmp_path / "c")
    assert contents(tmp_path / "a") == contents(tmp_path / "c")


def test_every_flipped_byte_is_noticed(tmp_path: Path) -> None:
    save_scene(make_scene(), tmp_path / "s")
    rng = np.random.default_rng(0)
    for name, data in contents(tmp_path / "s").items():
        for at in rng.integers(0, len(data) - 1, 12):
            flipped = bytearray(data)
            flipped[at] ^= 0x11
            (tmp_path / "s" / name).write_bytes(bytes(flipped))
            if name == "scene.json" and json.loads(data) == _parsed(flipped):
                continue  # white space
            with pytest.raises(InputError):
                load_scene(tmp_path / "s")
        (tmp_path / "s" / name).write_bytes(data)
    load_scene(tmp_path / "s")


def _parsed(data: bytearray) -> object:
    try:
        return json.loads(data)
    except ValueError:
        return None


def test_missing_parts_and_other_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"scene\.json"):
        load_scene(tmp_path)
    save_scene(make_scene(), tmp_path / "s")
    (tmp_path / "s" / "main-sky.safetensors").unlink()
    with pytest.raises(InputError, match="incomplete"):
        load_scene(tmp_path / "s")


def test_a_newer_format_is_named(tmp_path: Path) -> None:
    save_scene(make_scene(), tmp_path / "s")
    index = tmp_path / "s" / "scene.json"
    index.write_text(index.read_text().replace('"version": 1', '"version": 7'))
    with pytest.raises(InputError, match="version 7"):
        load_scene(tmp_path / "s")


def test_replaces_only_when_told_and_only_scenes(tmp_path: Path) -> None:
    save_scene(make_scene(), tmp_path / "s")
    with pytest.raises(InputError, match="exists already"):
        save_scene(make_scene(), tmp_path / "s")
    save_scene(make_scene(full=False), tmp_path / "s", replace=True)
    assert load_scene(tmp_path / "s").sky is None
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "1.png").write_text("mine")
    with pytest.raises(InputError, match="other files"):
        save_scene(make_scene(), tmp_path / "photos", replace=True)
    assert (tmp_path / "photos" / "1.png").read_text() == "mine"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["photos", "s"]


def test_an_unwritable_place_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="cannot write"):
        save_scene(make_scene(), tmp_path / "file" / "scene")


def test_a_failing_write_loses_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_scene(make_scene(), tmp_path / "s")
    before = contents(tmp_path / "s")
    written = []

    def full_disk(self: Path, data: bytes) -> int:
        written.append(self.name)
        if len(written) > 1:
            raise OSError(28, "No space left on device")
        return len(data)

    monkeypatch.setattr(Path, "write_bytes", full_disk)
    with pytest.raises(InputError, match="No space left"):
        save_scene(make_scene(full=False), tmp_path / "s", replace=True)
    assert contents(tmp_path / "s") == before
    assert [p.name for p in tmp_path.iterdir()] == ["s"]


def test_a_failing_rename_puts_the_old_scene_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_scene(make_scene(), tmp_path / "s")
    before = contents(tmp_path / "s")
    replace = os.replace

    def failing(source: Path, target: Path) -> None:
        if Path(source).name == "new":
            raise OSError(5, "Input/output error")
        replace(source, target)

    monkeypatch.setattr(os, "replace", failing)
    with pytest.raises(InputError, match="Input/output"):
        save_scene(make_scene(full=False), tmp_path / "s", replace=True)
    assert contents(tmp_path / "s") == before


def test_a_kill_between_the_renames_is_repaired(tmp_path: Path) -> None:
    save_scene(make_scene(), tmp_path / "s")
    before = contents(tmp_path / "s")
    key = hashlib.sha256(b"s").hexdigest()[:12]
    aside = tmp_path / f".dreamdrive-{key}-0123456789abcdef"
    aside.mkdir()
    os.replace(tmp_path / "s", aside / "retired")
    with pytest.raises(InputError, match="exists already"):
        save_scene(make_scene(full=False), tmp_path / "s")
    assert contents(tmp_path / "s") == before


def test_round_trip_of_a_rig(tmp_path: Path) -> None:
    scene = make_scene()
    assert scene.exposure is not None
    exposure = replace(scene.exposure, times_s=np.zeros(2), camera=np.array([0, 1]))
    rig = replace(scene, camera=np.array([0, 1, 0]), exposure=exposure)
    save_scene(rig, tmp_path / "scene")
    loaded = load_scene(tmp_path / "scene")
    assert loaded.camera is not None
    assert loaded.camera.tolist() == [0, 1, 0]
    assert loaded.front.tolist() == [0, 2]
    assert loaded.exposure is not None
    assert loaded.exposure.camera is not None
    assert loaded.exposure.camera.tolist() == [0, 1]
    assert len(loaded.trajectory) == 2


def test_round_trip_of_residuals_and_those_of_other_views_are_refused(tmp_path: Path) -> None:
    scene = make_scene()
    shape = len(scene.cameras), scene.cameras[0].height_px // 8, scene.cameras[0].width_px // 8
    residual = np.random.default_rng(0).uniform(size=shape).astype(np.float16)
    save_scene(replace(scene, residual=residual), tmp_path / "s")
    loaded = load_scene(tmp_path / "s")
    assert loaded.residual is not None
    assert loaded.residual.dtype == np.float16
    np.testing.assert_array_equal(loaded.residual, residual)
    save_scene(scene, tmp_path / "none")
    assert load_scene(tmp_path / "none").residual is None
    for number, wrong in enumerate((residual[:, :-1], residual - 2, residual + 2)):
        save_scene(replace(scene, residual=wrong), tmp_path / f"{number}")
        with pytest.raises(InputError, match="residuals are none of these views"):
            load_scene(tmp_path / f"{number}")


ROWS = ((0.0, 0.0, 1.0, 1 / 3), (-1.0, 0.0, 0.0, 5.25e6), (0.0, -1.0, 0.0, 1.4), (0.0, 0.0, 0.0, 1.0))


def test_round_trip_of_the_place_in_a_log(tmp_path: Path) -> None:
    about = Provenance(log=OfLog("scene-0061", ROWS, 0.3, level_z_m=-0.1), prior="street-world")
    save_scene(replace(make_scene(), provenance=about), tmp_path / "s")
    assert load_scene(tmp_path / "s").provenance == about


def test_scenes_from_before_priors_were_told_are_read(tmp_path: Path) -> None:
    about = Provenance(log=OfLog("scene-0061", ROWS, 0.3))
    save_scene(replace(make_scene(), provenance=about), tmp_path / "s")

    def older(index: dict[str, Any]) -> None:
        del index["provenance"]["prior"]
        del index["provenance"]["log"]["level_z_m"]

    change(tmp_path / "s", older)
    assert load_scene(tmp_path / "s").provenance == about
