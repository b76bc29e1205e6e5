"""Gaussians over time as .4dgs, which has life spans and straight motion as our scenes between moments."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8

from dreamdrive.errors import InputError
from dreamdrive.export.moving import AtMoments, at_moments, joined, moments_of, turned_back
from dreamdrive.files.output import check_ending, check_new_file, new_file
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.gaussians import SH_C0
from dreamdrive.scene.scene import Scene

_LEAST_SH, _MOST_SH = -4.0, 4.0
_TARGET_M = 10.0
_PROFILE = "fine"
"""Opacities and colours within 1/510, rotations within 0.0005, sizes within 0.5 %."""


def need_fourdgs() -> None:
    """Raise ``InputError`` where the package is missing."""
    try:
        import fourdgs  # noqa: F401
    except ImportError:
        raise InputError("4dgs needs the package fourdgs: pip install 'dreamdrive[4dgs]'") from None


def scene_to_4dgs(
    scene: Scene,
    path: Path,
    *,
    times_s: Sequence[float] | None = None,
    replace: bool = False,
    progress: Progress = silent,
) -> None:
    """Write a scene as a .4dgs file, with axes x right, y up, z back; its time starts at the first moment.

    What moves has a Gaussian for each of its moments, which moves straight until the next one; rotations and
    sizes wait until then. Life spans are exact. The recorded drive is its camera.

    Raises:
        InputError: The path cannot be written, the times do not grow, or the package fourdgs is missing.
    """
    check_ending(path, ".4dgs")
    check_new_file(path, replace)
    need_fourdgs()
    import fourdgs

    moments_s = moments_of(scene, times_s)
    start_s = float(moments_s[0])
    parts = at_moments(scene, moments_s)
    these = _pieces(turned_back(joined(parts)), moments_s - start_s, start_s)
    options = fourdgs.WriteOptions(
        profile=_PROFILE,
        library="dreamdrive",
        metadata={"coordinate_system": "y-up-right-handed", "color_space": "srgb-rec709-display"},
    )
    with new_file(path) as partial:
        duration_s = float(moments_s[-1]) - start_s
        fourdgs.write(str(partial), these, duration_s, options=options, camera=_camera(scene, start_s))
    progress(1, 1)


def left_out_of_4dgs(scene: Scene, path: Path) -> str:
    """What of a scene ``scene_to_4dgs`` finds no place for, in a sentence."""
    del path
    parts = {
        "sky": scene.sky is not None,
        "exposure of the recording": scene.exposure is not None,
        "turning between the moments": scene.moves_per_frame or len(scene.dynamic) > 0,
    }
    missing = ", ".join(f"no {part}" for part, there in parts.items() if there)
    return f".4dgs holds the scene over time{': ' if missing else ''}{missing}."


def _pieces(these: AtMoments, moments_s: Float[np.ndarray, " t"], start_s: float) -> Any:
    """A ``GaussianSet``: each Gaussian once for each pair of its moments, or once where it has one alone."""
    import fourdgs

    pieces = np.maximum(these.last - these.first, 1)
    who = np.repeat(np.arange(len(pieces)), pieces)
    step = np.arange(len(who)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    here = these.offsets[who] + step
    moves = (these.last > these.first)[who]
    there = here + moves
    moment = np.minimum(these.first[who] + step, len(moments_s) - 1)
    after = np.minimum(moment + 1, len(moments_s) - 1)
    lasts_s = np.where(moves, moments_s[after] - moments_s[moment], 1.0)
    motions = (these.means[there] - these.means[here]) / lasts_s[:, None]
    forever = these.lives_s[who, 1] == 0
    full_s = np.where(forever, moments_s[moment], these.lives_s[who, 0] - start_s)
    means = these.means[here] + motions * (full_s - moments_s[moment])[:, None]
    degree = int(these.sh.shape[1] ** 0.5) - 1
    rgb = np.clip(these.sh[:, 0] * SH_C0 + 0.5, 0, 1)
    return fourdgs.GaussianSet(
        positions=means.astype(np.float32),
        scales=np.exp(np.clip(these.log_scales[here], -40, 40)),
        rotations=np.roll(these.quaternions[here], -1, axis=1),
        colors=np.concatenate([rgb, these.opacities[:, None]], axis=1)[who].astype(np.float32),
        motions=motions.astype(np.float32),
        mu_t=full_s.astype(np.float32),
        sigma_t=np.where(forever, np.inf, these.lives_s[who, 1]).astype(np.float32),
        win_lo=np.where(moves, moments_s[moment], 0.0),
        win_hi=np.where(moves & (after < len(moments_s) - 1), moments_s[after], np.inf),
        sh=_further(these.sh)[who] if degree else None,
        sh_degree=degree,
    )


def _further(sh: Float[np.ndarray, "n k 3"]) -> UInt8[np.ndarray, "n c"]:
    """Coefficients beyond the first in bytes, by channel."""
    wholes = np.rint((sh[:, 1:] - _LEAST_SH) / (_MOST_SH - _LEAST_SH) * 255)
    return np.clip(wholes, 0, 255).astype(np.uint8).transpose(0, 2, 1).reshape(len(sh), -1)


def _camera(scene: Scene, start_s: float) -> Any:
    import fourdgs

    drive, camera = scene.trajectory, scene.cameras[int(scene.front[0])]
    back = np.array([1.0, -1.0, -1.0])
    places = drive.positions_m * back
    targets = places + _TARGET_M * drive.world_from_camera[:, :3, 2] * back
    return fourdgs.CameraTrajectory(
        fov_y_deg=float(np.rad2deg(2 * np.arctan(camera.height_px / 2 / camera.fy_px))),
        position=tuple(places[0].tolist()),
        target=tuple(targets[0].tolist()),
        times=(drive.times_s - start_s).tolist(),
        positions=[tuple(each) for each in places.tolist()],
        targets=[tuple(each) for each in targets.tolist()],
        interpolation="linear",
        loop=False,
    )
