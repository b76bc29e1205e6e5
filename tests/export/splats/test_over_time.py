"""Formats that hold motion, read by programs that are not ours at all moments and between them."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, cast

import fourdgs
import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.export import EXPORTS, export, function
from dreamdrive.scene.gaussians import SH_C0, Gaussians
from dreamdrive.scene.scene import Scene
from tests.data.splats.some import check_same, up_and_back
from tests.scene.scenes import make_baseline, make_scene, per_frame_scene

Usd, UsdGeom, UsdVol = (cast(Any, import_module(f"pxr.{name}")) for name in ("Usd", "UsdGeom", "UsdVol"))
SCENES: list[Callable[[], Scene]] = [make_scene, per_frame_scene, lambda: make_baseline("vibration")]
_BACK = np.array([1, -1, -1])


def _logits(opacities: np.ndarray) -> np.ndarray:
    inside = np.clip(opacities.astype(np.float64), 1e-9, 1 - 1e-7)
    return np.log(inside / (1 - inside))


def _of_prim(prim: Any, code: Any) -> Gaussians:
    turns = [[q.GetReal(), *q.GetImaginary()] for q in prim.GetOrientationsAttr().Get(code)]
    means = np.array(prim.GetPositionsAttr().Get(code))
    coefficients = (prim.GetRadianceSphericalHarmonicsDegreeAttr().Get() + 1) ** 2
    sh = np.array(prim.GetRadianceSphericalHarmonicsCoefficientsAttr().Get())
    return up_and_back(
        {
            "means": means,
            "quaternions": np.array(turns),
            "log_scales": np.log(np.array(prim.GetScalesAttr().Get(code))),
            "logit_opacities": _logits(np.array(prim.GetOpacitiesAttr().Get(code))),
            "sh": sh.reshape(len(means), coefficients, 3),
        }
    )


@pytest.mark.parametrize("make", SCENES)
def test_openusd_reads_all_moments(make: Callable[[], Scene], tmp_path: Path) -> None:
    scene = make()
    export(scene, "usd", tmp_path / "a.usdc")
    stage = Usd.Stage.Open(str(tmp_path / "a.usdc"))
    assert (UsdGeom.GetStageUpAxis(stage), UsdGeom.GetStageMetersPerUnit(stage)) == ("Y", 1.0)
    for t_s in scene.times_s.tolist():
        code = Usd.TimeCode((t_s - float(scene.times_s[0])) * stage.GetTimeCodesPerSecond())
        parts = [
            _of_prim(UsdVol.ParticleField3DGaussianSplat(stage.GetPrimAtPath(f"/scene/{name}")), code)
            for name in ("static", "moving")
            if stage.GetPrimAtPath(f"/scene/{name}")
        ]
        found, true = Gaussians.concatenate(*parts), scene.at(t_s)
        seen = torch.sigmoid(found.logit_opacities) > 1e-6
        if len(true) < len(found):
            found = found.select(seen)
            true = true.select(torch.sigmoid(true.logit_opacities) > 1e-6)
        check_same(found, true, place_m=1e-5, size=1e-3, opacity=1e-4, colour=1e-4)


def test_openusd_sees_the_drive(tmp_path: Path) -> None:
    scene = make_scene()
    export(scene, "usd", tmp_path / "a.usdc")
    stage = Usd.Stage.Open(str(tmp_path / "a.usdc"))
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/scene/drive"))
    assert camera.GetPrim().GetAttribute("xformOp:transform").GetNumTimeSamples() == 3
    frustum = camera.GetCamera(0).frustum
    ours = scene.cameras[0]
    point = np.array([0.3, -0.2, 2.0])
    ndc = (frustum.ComputeViewMatrix() * frustum.ComputeProjectionMatrix()).Transform(tuple(point * _BACK))
    column, row, _ = ours.project(point[None])[0]
    assert (ndc[0] + 1) / 2 * ours.width_px == pytest.approx(column, abs=1e-3)
    assert (1 - ndc[1]) / 2 * ours.height_px == pytest.approx(row, abs=1e-3)


@pytest.mark.parametrize("make", SCENES)
def test_fourdgs_reads_all_moments(make: Callable[[], Scene], tmp_path: Path) -> None:
    scene = make()
    export(scene, "4dgs", tmp_path / "a.4dgs")
    read = fourdgs.read(str(tmp_path / "a.4dgs"))
    start_s = float(scene.times_s[0])
    for t_s in scene.times_s.tolist():
        state = read.gaussians.state_at(t_s - start_s + 1e-9)
        true = scene.at(t_s)
        opacities = torch.sigmoid(true.logit_opacities).numpy()
        seen = state["opacity"] > 0.03
        assert seen.sum() == (opacities > 0.03).sum() > 0
        rows = state["indices"][seen]
        # In what order they are is the format's business: the nearest one is the same one.
        for place, opacity, row in zip(
            state["centers"][seen] * _BACK, state["opacity"][seen], rows, strict=True
        ):
            away = np.linalg.norm(true.means.numpy() - place, axis=1)
            same = int(away.argmin())
            assert away[same] < 0.05
            assert opacities[same] == pytest.approx(opacity, abs=0.02)
            sizes = np.log(read.gaussians.scales[row])
            assert np.allclose(sizes, true.log_scales[same], atol=0.02)
            colour = np.clip(true.sh[same, 0].numpy() * SH_C0 + 0.5, 0, 1)
            assert np.allclose(read.gaussians.colors[row, :3], colour, atol=0.005)
            turn = np.roll(read.gaussians.rotations[row], 1)
            w, x, y, z = turn
            own = torch.nn.functional.normalize(true.quaternions[same], dim=0).numpy()
            assert abs(own @ [-x, w, -z, y]) > 0.999


def test_fourdgs_moves_straight_and_fades_in_between(tmp_path: Path) -> None:
    scene = per_frame_scene()  # which moves straight itself
    export(scene, "4dgs", tmp_path / "a.4dgs")
    read = fourdgs.read(str(tmp_path / "a.4dgs"))
    between_s = float(scene.times_s[0]) + 0.05
    state = read.gaussians.state_at(0.05)
    true = scene.static_at(between_s)
    for k in range(len(true)):
        away = np.linalg.norm(state["centers"] * _BACK - true.means[k].numpy(), axis=1)
        assert away.min() < 0.05
        opacity = float(torch.sigmoid(true.logit_opacities[k]))
        assert state["opacity"][away.argmin()] == pytest.approx(opacity, abs=0.02)


@pytest.mark.parametrize(("kind", "ending"), [("usd", ".usdc"), ("4dgs", ".4dgs")])
def test_names_and_losses_are_said(kind: str, ending: str, tmp_path: Path) -> None:
    chosen = EXPORTS.choose(kind)
    with pytest.raises(InputError, match=ending):
        export(make_scene(), kind, tmp_path / "a.txt")
    assert chosen.left_out is not None
    assert "no sky, no exposure" in function(chosen.left_out)(make_scene(), tmp_path / f"a{ending}")
