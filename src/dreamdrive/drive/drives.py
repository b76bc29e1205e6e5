"""Drives that are asked for, and whether the scene has seen what lies along them."""

import logging
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from dreamdrive.data import read_trajectory
from dreamdrive.drive.manoeuvres import LANE_M, MANOEUVRES, manoeuvre, resampled, smooth
from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.splat import render_scene

MAX_FRAMES = 100_000
"""Most frames of a drive: an hour and a half at 20 Hz."""
LEAST_SEEN = 0.1
"""Share of what the recorded drive sees that another one has to see, see ``share_seen``.

Moved to the right, a drawn street between houses has 0.77 at 5 m, 0.43 at 10 m, 0.13 at 20 m and 0.02 at
30 m; a recorded highway 0.84 at 5 m, 0.65 at 10 m, 0.39 at 20 m, 0.18 at 50 m and 0.06 at 100 m.
"""
_ASIDE_M = 1.1 * LANE_M
_SAME = 1e-6
_PROBES, _PROBE_WIDTH_PX = 8, 96

_log = logging.getLogger("dreamdrive")


@dataclass(frozen=True)
class Drive:
    """A drive to render, and what its results are called."""

    name: str
    path: Trajectory


def drives_of(scene: Scene, wanted: Sequence[str], shift_m: float, fps: float | None) -> list[Drive]:
    """The drives that ``--trajectory`` names; ``InputError`` where a scene has not seen enough of one.

    Manoeuvres run at the smooth rate of ``generate``; without a rate a file keeps its own.
    """
    drives = [_drive(scene, each, shift_m, fps) for each in wanted]
    twice = [name for name, count in Counter(drive.name for drive in drives).items() if count > 1]
    if twice:
        raise InputError(
            f"--trajectory: two drives are called {twice[0]}; rename a file, or render them one by one"
        )
    for drive, each in zip(drives, wanted, strict=True):
        away_m = distance_m(drive.path, smooth(scene.trajectory))
        # A file may look anywhere; manoeuvres near the recorded path look along it.
        if away_m > _ASIDE_M or each not in MANOEUVRES:
            option = f"--shift-m {shift_m:g}" if each == "shift" else f"--trajectory {each}"
            _check_seen(share_seen(scene, drive.path), away_m, option)
    return drives


def along(scene: Scene, path: Trajectory) -> Scene:
    """The scene with the views that its cameras have on another drive in place of the recorded ones.

    The path is that of the first camera. The others of a rig are carried along as they were mounted at their
    first view; those that saw the street from where the first one did, on drives of their own, are left out.
    """
    front = scene.trajectory
    rig: dict[int, tuple[Camera, Float[np.ndarray, "4 4"]]] = {}
    for view, camera in enumerate(scene.cameras):
        if scene.of_rig(view) not in rig:
            first_from_world = np.linalg.inv(front.at(scene.times_s[view : view + 1])[0])
            rig[scene.of_rig(view)] = camera, first_from_world @ camera.world_from_camera
    same = [k for k, (_, mounted) in rig.items() if np.allclose(mounted, np.eye(4), atol=_SAME)]
    rig = {k: each for k, each in rig.items() if k not in same[1:]}
    about = scene.provenance
    height_m = about.camera_height_m
    if height_m is not None:
        height_m += float((path.positions_m[0] - front.positions_m[0]) @ scene.up)
    return replace(
        scene,
        cameras=tuple(
            camera.at(pose @ mounted) for pose in path.world_from_camera for camera, mounted in rig.values()
        ),
        times_s=np.repeat(path.times_s, len(rig)),
        held_out=np.zeros(len(path) * len(rig), bool),
        provenance=replace(about, source_index=None, camera_height_m=height_m),
        camera=None if scene.camera is None else np.tile(list(rig), len(path)),
        residual=None,
        frames=None,
    )


def _drive(scene: Scene, wanted: str, shift_m: float, fps: float | None) -> Drive:
    if wanted in MANOEUVRES:
        name, path = wanted, manoeuvre(wanted, smooth(scene.trajectory), scene.up, shift_m)
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


def _check_seen(seen: float, away_m: float, option: str) -> None:
    """Refuse a drive that sees next to nothing of what was recorded; say how much where it goes far aside."""
    where = f"{option} goes {away_m:.3g} m from the recorded path and sees {seen:.0%} of what is seen there"
    if seen < LEAST_SEEN:
        raise InputError(
            f"{where}; expected a drive up to about a lane's width ({LANE_M:g} m) aside, looking the same "
            "way; a file's poses are in the world of the first recorded camera: x right, y down, z "
            "forward, metres"
        )
    if away_m > _ASIDE_M:
        _log.warning("%s; beyond about a lane's width (%g m) expect gaps and torn shapes", where, LANE_M)


def distance_m(path: Trajectory, recorded: Trajectory) -> float:
    """How far a path goes at most from the nearest place of another one."""
    return max(
        float(np.linalg.norm(recorded.positions_m - place, axis=1).min()) for place in path.positions_m
    )


def share_seen(scene: Scene, path: Trajectory) -> float:
    """How much of the scene another drive sees, over what the recorded one sees; 0 where nothing is near.

    Small pictures are spread evenly over both drives. A pixel counts as far as Gaussians cover it, and beyond
    the median depth of the recorded views by the square of that depth over its own: hills far away and the
    sky's panorama look the same from anywhere.
    """
    recorded, other = _probed(scene, scene.trajectory), _probed(scene, path)
    depths_m = recorded[0][recorded[0] > 0]
    if not depths_m.size:
        return 1.0
    near_m = np.median(depths_m)
    seen = [
        (alpha * (near_m / np.maximum(depth_m, near_m)) ** 2).mean() for depth_m, alpha in (other, recorded)
    ]
    return float(seen[0] / seen[1])


def _probed(scene: Scene, path: Trajectory) -> tuple[Float[np.ndarray, "p h w"], Float[np.ndarray, "p h w"]]:
    """Depth and alpha of small views along a drive."""
    camera = scene.cameras[0]
    height = max(1, round(_PROBE_WIDTH_PX * camera.height_px / camera.width_px))
    camera = camera.resized(_PROBE_WIDTH_PX, height)
    rows = np.linspace(0, len(path) - 1, _PROBES).round().astype(int).tolist()
    views = [render_scene(scene, camera.at(path.world_from_camera[i]), float(path.times_s[i])) for i in rows]
    return np.stack([v.depth_m.numpy() for v in views]), np.stack([v.alpha.numpy() for v in views])
