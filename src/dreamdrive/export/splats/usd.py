"""Gaussians over time as OpenUSD: two ParticleField3DGaussianSplat, and the camera of the recorded drive."""

from collections.abc import Generator, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from dreamdrive.data.splats.splats import UP_AND_BACK
from dreamdrive.errors import InputError
from dreamdrive.export.moving import AtMoments, at_moments, moments_of, turned_back
from dreamdrive.files.output import check_ending, check_new_file, new_file
from dreamdrive.files.undisturbed import undisturbed
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.scene import Scene

RATE_HZ = 24.0
"""Time codes a second, of which moments may be parts."""
_REACH = 3.0
_APERTURE_MM = 36.0


def need_usd() -> None:
    """Raise ``InputError`` where the package is missing, or older than its Gaussians."""
    try:
        with undisturbed():  # its C++ imports Python, and prints what a signal raises there
            from pxr import UsdVol
    except ImportError:
        UsdVol = None
    if not hasattr(UsdVol, "ParticleField3DGaussianSplat"):
        raise InputError("usd needs usd-core 26.3 or newer: pip install 'dreamdrive[usd]'")


def _pxr(name: str) -> Any:
    """A module of OpenUSD, whose types tell less than there is."""
    return import_module(f"pxr.{name}")


def scene_to_usd(
    scene: Scene,
    path: Path,
    *,
    times_s: Sequence[float] | None = None,
    replace: bool = False,
    progress: Progress = silent,
) -> None:
    """Write a scene as a .usdc file: y up, metres, 24 time codes a second from the first moment on.

    ``/scene/static`` never changes, ``/scene/moving`` has a time sample at each moment, with life spans as
    opacity; ``/scene/drive`` is the recorded camera. All numbers are float32.

    Raises:
        InputError: The path cannot be written, the times do not grow, or usd-core is missing.
    """
    check_ending(path, ".usdc")
    check_new_file(path, replace)
    need_usd()
    Usd, UsdGeom = _pxr("Usd"), _pxr("UsdGeom")
    moments_s = moments_of(scene, times_s)
    with new_file(path) as partial, _said_by_the_system():
        stage: Any = Usd.Stage.CreateNew(str(partial))
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
        UsdGeom.SetStageMetersPerUnit(stage, 1.0)
        stage.SetTimeCodesPerSecond(RATE_HZ)
        stage.SetStartTimeCode(0)
        stage.SetEndTimeCode(float(moments_s[-1] - moments_s[0]) * RATE_HZ)
        stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/scene").GetPrim())
        for name, these in zip(("static", "moving"), at_moments(scene, moments_s), strict=True):
            if len(these.first):
                _write(stage, f"/scene/{name}", turned_back(these), moments_s)
        _write_drive(stage, scene, float(moments_s[0]))
        stage.GetRootLayer().Save()
    progress(1, 1)


@contextmanager
def _said_by_the_system() -> Generator[None, None, None]:
    """Make an ``OSError`` of a disk that is full, of which OpenUSD tells in an error of its own."""
    try:
        yield
    except _pxr("Tf").ErrorException as error:
        said = str(error).strip().splitlines()
        raise OSError(said[0].rpartition(" : ")[2].strip("' ") if said else "OpenUSD failed") from error


def left_out_of_usd(scene: Scene, path: Path) -> str:
    """What of a scene ``scene_to_usd`` finds no place for, in a sentence."""
    del path
    parts = {
        "sky": scene.sky is not None,
        "exposure of the recording": scene.exposure is not None,
        "life spans between the moments": scene.dynamic.lifespan is not None,
    }
    missing = ", ".join(f"no {part}" for part, there in parts.items() if there)
    return f"USD holds the scene over time{': ' if missing else ''}{missing}."


def _write(stage: Any, place: str, these: AtMoments, moments_s: Float[np.ndarray, " t"]) -> None:
    Usd, UsdVol, Vt = _pxr("Usd"), _pxr("UsdVol"), _pxr("Vt")
    prim: Any = UsdVol.ParticleField3DGaussianSplat.Define(stage, place)
    prim.CreateRadianceSphericalHarmonicsDegreeAttr(int(these.sh.shape[1] ** 0.5) - 1)
    prim.CreateRadianceSphericalHarmonicsCoefficientsAttr(_vectors(these.sh.reshape(-1, 3)))
    changes = bool((these.last > these.first).any() or (these.lives_s[:, 1] > 0).any())
    for moment, t_s in enumerate(moments_s.tolist()):
        if moment and not changes:
            return
        when = Usd.TimeCode((t_s - float(moments_s[0])) * RATE_HZ) if changes else Usd.TimeCode.Default()
        row = these.offsets + np.clip(moment, these.first, these.last) - these.first
        means, sizes = these.means[row], np.exp(np.clip(these.log_scales[row], -40, 40))
        turns = np.ascontiguousarray(np.roll(these.quaternions[row], -1, axis=1))
        opacities = these.opacities * _share(these, t_s)
        prim.CreatePositionsAttr().Set(_vectors(means), when)
        prim.CreateScalesAttr().Set(_vectors(sizes), when)
        prim.CreateOrientationsAttr().Set(Vt.QuatfArray.FromNumpy(turns), when)
        prim.CreateOpacitiesAttr().Set(Vt.FloatArray.FromNumpy(opacities.astype(np.float32)), when)
        reach = _REACH * sizes.max(axis=1, keepdims=True)
        prim.CreateExtentAttr().Set(
            _vectors(np.stack([(means - reach).min(axis=0), (means + reach).max(axis=0)])), when
        )


def _vectors(values: Float[np.ndarray, "n 3"]) -> Any:
    return _pxr("Vt").Vec3fArray.FromNumpy(np.ascontiguousarray(values, np.float32))


def _share(these: AtMoments, t_s: float) -> Float[np.ndarray, " n"]:
    """What life spans leave of the opacities."""
    deviation_s = np.where(these.lives_s[:, 1] > 0, these.lives_s[:, 1], np.inf)
    return np.exp(-0.5 * np.square((t_s - these.lives_s[:, 0]) / deviation_s))


def _write_drive(stage: Any, scene: Scene, start_s: float) -> None:
    Gf, Usd, UsdGeom = _pxr("Gf"), _pxr("Usd"), _pxr("UsdGeom")
    camera, drive = scene.cameras[int(scene.front[0])], scene.trajectory
    prim: Any = UsdGeom.Camera.Define(stage, "/scene/drive")
    mm = _APERTURE_MM / camera.width_px
    prim.CreateHorizontalApertureAttr(_APERTURE_MM)
    prim.CreateVerticalApertureAttr(camera.height_px * mm * camera.fx_px / camera.fy_px)
    prim.CreateFocalLengthAttr(camera.fx_px * mm)
    prim.CreateHorizontalApertureOffsetAttr((camera.width_px / 2 - camera.cx_px) * mm)
    prim.CreateVerticalApertureOffsetAttr((camera.cy_px - camera.height_px / 2) * mm)
    prim.CreateClippingRangeAttr(Gf.Vec2f(0.2, 1e4))
    moved = prim.AddTransformOp()
    back = np.eye(4)
    back[:3, :3] = UP_AND_BACK
    for pose, t_s in zip(drive.world_from_camera, drive.times_s.tolist(), strict=True):
        # USD's vectors are rows.
        moved.Set(Gf.Matrix4d((back @ pose @ back).T.tolist()), Usd.TimeCode((t_s - start_s) * RATE_HZ))
