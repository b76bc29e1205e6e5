"""Which drives through a scene are asked for, and whether the scene has seen what lies along them."""

import logging
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from dreamdrive.data import read_trajectory
from dreamdrive.drive import MANOEUVRES, manoeuvre, resampled
from dreamdrive.drive.manoeuvres import LANE_M
from dreamdrive.errors import InputError
from dreamdrive.pictures import smooth, up_of
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.splat.scene_view import render_scene

RATES_HZ = (0.1, 240.0)
"""Rates that ``--fps`` takes: from a picture every ten seconds to the fastest that players show."""
MAX_FRAMES = 100_000
"""Most frames of a drive: an hour and a half at 20 Hz."""
LEAST_SEEN = 0.05
"""Share of what is near on the recorded drive that another one has to see.

Moved to the right, a drawn street between houses shows 0.75 at 5 m, 0.33 at 10 m, 0.10 at 15 m and none at
20 m; a recorded highway 0.78 at 5 m, 0.51 at 10 m, 0.23 at 20 m and 0.01 at 50 m.
"""
_PROBES, _PROBE_WIDTH_PX = 8, 96

_log = logging.getLogger("dreamdrive")


@dataclass(frozen=True)
class Drive:
    """A drive to render.

    Attributes:
        name: What its results are called.
        path: Its poses and times.
    """

    name: str
    path: Trajectory


def check_numbers(shift_m: float, fps: float | None) -> None:
    """Refuse what no drive can be made with, before anything is loaded.

    Raises:
        InputError: A number is out of its range.
    """
    if not math.isfinite(shift_m):
        raise InputError(f"--shift-m {shift_m:g}: expected metres to the right, such as 2 or -2")
    if fps is not None and not RATES_HZ[0] <= fps <= RATES_HZ[1]:
        raise InputError(f"--fps {fps:g}: expected {RATES_HZ[0]:g} to {RATES_HZ[1]:g} frames a second")


def drives_of(scene: Scene, wanted: Sequence[str], shift_m: float, fps: float | None) -> list[Drive]:
    """The drives that ``--trajectory`` names, each of which the scene has seen enough of.

    Args:
        scene: Where to drive.
        wanted: Names of manoeuvres, which run at the smooth rate of ``generate``, or files.
        shift_m: How far ``shift`` goes to the right.
        fps: Rate to bring all of them to; without it a file keeps its own.

    Raises:
        InputError: There is no such drive, two have one name, or the scene shows next to nothing along it.
    """
    drives = [_drive(scene, each, shift_m, fps) for each in wanted]
    twice = [name for name, count in Counter(drive.name for drive in drives).items() if count > 1]
    if twice:
        raise InputError(
            f"--trajectory: two drives are called {twice[0]}; rename a file, or render them one by one"
        )
    for drive, each in zip(drives, wanted, strict=True):
        option = f"--shift-m {shift_m:g}" if each == "shift" else f"--trajectory {each}"
        _check_seen(scene, drive.path, option)
    return drives


def _drive(scene: Scene, wanted: str, shift_m: float, fps: float | None) -> Drive:
    if wanted in MANOEUVRES:
        name, path = wanted, manoeuvre(wanted, smooth(scene.trajectory), up_of(scene), shift_m)
    else:
        file = Path(wanted)
        if not file.exists():
            raise InputError(
                f"--trajectory {wanted}: no such file; expected a file with a trajectory or one of "
                f"{', '.join(MANOEUVRES)}"
            )
        name, path = file.stem, read_trajectory(file)
    if fps is None:
        return Drive(name, path)
    seconds = float(path.times_s[-1] - path.times_s[0])
    if seconds * fps > MAX_FRAMES:
        raise InputError(
            f"--trajectory {wanted} lasts {seconds:.6g} s, {seconds * fps:.6g} frames at --fps {fps:g}; "
            f"expected {MAX_FRAMES} at most: check the times of the file, or choose a lower rate"
        )
    return Drive(name, resampled(path, fps))


def _check_seen(scene: Scene, path: Trajectory, option: str) -> None:
    """Refuse a drive that sees next to nothing of what was recorded; say so where it goes far aside."""
    away_m = distance_m(path, smooth(scene.trajectory))
    if away_m <= 1.1 * LANE_M:
        return
    seen = share_seen(scene, path)
    where = f"{option} goes {away_m:.3g} m from the recorded path and sees {seen:.0%} of what is near there"
    if seen < LEAST_SEEN:
        raise InputError(
            f"{where}; expected a drive near the recorded one, in the world of its first camera (x right, y "
            f"down, z forward, metres): up to about a lane's width ({LANE_M:g} m) aside is sensible"
        )
    _log.warning("%s; beyond about a lane's width (%g m) expect gaps and torn shapes", where, LANE_M)


def distance_m(path: Trajectory, recorded: Trajectory) -> float:
    """How far a path goes at most from the nearest place of another one."""
    return max(
        float(np.linalg.norm(recorded.positions_m - place, axis=1).min()) for place in path.positions_m
    )


def share_seen(scene: Scene, path: Trajectory) -> float:
    """How much of what is near on the recorded drive is near on another one, too.

    Near is what lies within the median depth of the recorded views. Compared is how much of the pictures
    Gaussians cover there, on small pictures spread evenly over both drives; the sky's panorama, which looks
    the same from anywhere, does not count.

    Args:
        scene: What to see.
        path: The other drive.

    Returns:
        0 where nothing of the scene is near, 1 where as much is as on the recorded drive.
    """
    depth_m, alpha = _probed(scene, scene.trajectory)
    if not (depth_m > 0).any():
        return 1.0
    near_m = np.median(depth_m[depth_m > 0])
    recorded = np.where(depth_m <= near_m, alpha, 0).mean()
    depth_m, alpha = _probed(scene, path)
    return float(np.where(depth_m <= near_m, alpha, 0).mean() / recorded)


def _probed(scene: Scene, path: Trajectory) -> tuple[Float[np.ndarray, "p h w"], Float[np.ndarray, "p h w"]]:
    """Depth and alpha of small views along a drive."""
    camera = scene.cameras[0]
    height = max(1, round(_PROBE_WIDTH_PX * camera.height_px / camera.width_px))
    camera = camera.resized(_PROBE_WIDTH_PX, height)
    rows = np.linspace(0, len(path) - 1, _PROBES).round().astype(int).tolist()
    views = [render_scene(scene, camera.at(path.world_from_camera[i]), float(path.times_s[i])) for i in rows]
    return np.stack([v.depth_m.numpy() for v in views]), np.stack([v.alpha.numpy() for v in views])
