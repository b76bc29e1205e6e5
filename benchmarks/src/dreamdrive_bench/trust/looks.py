"""Views of drawn streets and of recorded drives: what is known of them, and how far off they are."""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.files.digest import digest, file_digest
from dreamdrive.files.output import new_file
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.similarity import fit_similarity
from dreamdrive.street_network import weights_of
from dreamdrive.trust import SHIFTS_M, SceneTrust, features_of, seen_with
from dreamdrive.vision.residual import residual_of
from dreamdrive_bench.common.drafts import draft_of
from dreamdrive_bench.common.machine import COMMIT
from dreamdrive_bench.drives.drive import Drive
from dreamdrive_bench.street.case import FRAMES, Case, case_digest, clip_of, world_of
from dreamdrive_bench.street.measure import to_scene
from dreamdrive_bench.street.views import NEAR_M, clearance_m, true_cameras

_STEP = 4
"""Every which frame is looked at from aside."""
_FARTHEST_M = 4.0
_OTHERS = (("raise_1", 1.0), ("yaw_10", 0.0))


@dataclass(frozen=True)
class Looks:
    """Views (V,) of one scene.

    Attributes:
        features: What is known of their blocks (V, bh, bw, F).
        squared_error: What their blocks are off (V, bh, bw).
        shift_m: How far they are to the right of the recorded path (V,); NaN of those raised or turned.
        away_m: How far they are from the recorded path (V,).
        frame: The frame at whose time they are (V,).
        novel: Whether no fit has seen such a view (V,).
        off: See ``SceneTrust.off``; what counts for each view, without its own (V,).
    """

    features: Float[np.ndarray, "v bh bw c"]
    squared_error: Float[np.ndarray, "v bh bw"]
    shift_m: Float[np.ndarray, " v"]
    away_m: Float[np.ndarray, " v"]
    frame: Float[np.ndarray, " v"]
    novel: Bool[np.ndarray, " v"]
    off: Float[np.ndarray, " v"]


def of_world(seed: int, knowledge: str, runs: Path) -> Looks:
    """Of a drawn street: the recorded views, and views from both sides, raised and turned ones.

    None of them comes too near to a box.
    """
    case = Case(seed, "estimated", "clean")
    key = digest([COMMIT, file_digest(weights_of(knowledge)), case_digest(case), SHIFTS_M])
    return _kept(runs / f"looks-{seed}.npz", key, lambda: _look_at_world(case, knowledge, runs))


def of_drive(drive: Drive, knowledge: str, runs: Path) -> Looks:
    """Of a recorded drive: the views that no fit has seen."""
    key = digest([COMMIT, file_digest(weights_of(knowledge)), drive])
    return _kept(runs / f"looks-{drive.name}.npz", key, lambda: _look_at_drive(drive, knowledge, runs))


def _look_at_world(case: Case, knowledge: str, runs: Path) -> Looks:
    made = world_of(case.seed)
    scene = draft_of(clip_of(case), knowledge, runs / f"scene-{case.seed}")
    similarity = fit_similarity(scene.cameras, made.cameras)
    seen = _Seen(SceneTrust.of(scene))
    for k, camera in enumerate(scene.cameras):
        seen.add(camera, k, (0.0, 0.0), made.frames[k])
    frames = list(range(_STEP // 2, FRAMES, _STEP))
    for place, cameras in _places(case.seed):
        clear = clearance_m(made.boxes, cameras) >= NEAR_M
        counted = [k for k in frames if clear[k]]
        if not counted:
            continue
        times_s = [float(made.times_s[k]) for k in counted]
        for k, true in zip(counted, made.views([cameras[k] for k in counted], times_s), strict=True):
            # The focal length is the scene's own: with another one the same pixels would show other things.
            own = scene.cameras[k].at(to_scene(cameras[k], similarity).world_from_camera)
            seen.add(own, k, place, true.frame)
    return seen.looks()


def _places(seed: int) -> list[tuple[tuple[float, float], list[Camera]]]:
    """Cameras of all frames beside the path, above it, and turned: ``shift_m`` and ``away_m`` of each."""
    cameras = world_of(seed).cameras
    shifts_m = [side * metres for metres in SHIFTS_M if metres <= _FARTHEST_M for side in (-1, 1)]
    from_aside = [((m, abs(m)), [camera.moved(m) for camera in cameras]) for m in shifts_m]
    others = [((math.nan, away_m), true_cameras(seed, view)) for view, away_m in _OTHERS]
    return [*from_aside, *others]


def _look_at_drive(drive: Drive, knowledge: str, runs: Path) -> Looks:
    clip = drive.clip()
    scene = draft_of(clip, knowledge, runs / f"scene-{drive.name}")
    seen = _Seen(SceneTrust.of(scene))
    for k in np.flatnonzero(scene.held_out).tolist():
        seen.add(scene.cameras[k], k, (0.0, 0.0), clip.frames[k])
    return seen.looks()


class _Seen:
    """Views of a scene as they are looked at."""

    def __init__(self, trust: SceneTrust) -> None:
        self._trust, self._rows = trust, list[dict[str, object]]()

    def add(self, camera: Camera, frame: int, place: tuple[float, float], true: np.ndarray) -> None:
        """A view at the time of a frame, its ``shift_m`` and ``away_m``, and what is truly to be seen."""
        trust, t_s = self._trust, float(self._trust.scene.times_s[frame])
        view, told = seen_with(trust.evidence, trust.scene, camera, t_s)
        hidden = trust.free_space.hidden(camera, view.depth_m)
        recorded = place == (0.0, 0.0)
        novel = not recorded or bool(trust.scene.held_out[frame])
        others = [off for index, off in trust.off.items() if not (recorded and index == frame)]
        off = residual_of(view.colour.numpy(), true).astype(np.float32) ** 2
        features = features_of(view, told.numpy(), hidden.numpy()).astype(np.float32)
        row = features, off, *place, frame, novel, float(np.mean(others)) if others else 0.0
        self._rows.append(dict(zip((f.name for f in fields(Looks)), row, strict=True)))

    def looks(self) -> Looks:
        """All of them."""
        return Looks(**{f.name: np.array([row[f.name] for row in self._rows]) for f in fields(Looks)})


def _kept(path: Path, key: str, make: Callable[[], Looks]) -> Looks:
    """What is in the file if it is of this key, else anew."""
    if path.exists():
        with np.load(path) as stored:
            if str(stored["key"]) == key:
                return Looks(**{f.name: stored[f.name] for f in fields(Looks)})
    looks = make()
    with new_file(path) as partial:
        np.savez_compressed(
            partial, key=np.array(key), **{f.name: getattr(looks, f.name) for f in fields(Looks)}
        )
    return looks


def psnr_db(squared_error: Float[np.ndarray, "v bh bw"]) -> Float[np.ndarray, " v"]:
    """Of each view."""
    return -10 / math.log(10) * np.log(np.maximum(squared_error.mean(axis=(1, 2)), 1e-7))
