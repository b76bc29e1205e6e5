"""Videos and pictures that ``generate`` makes of a scene."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from jaxtyping import Float, Int, UInt8
from torch import Tensor

from dreamdrive.compute.threads import ahead
from dreamdrive.data import SourceLens
from dreamdrive.data.pictures.picture_file import write_picture
from dreamdrive.data.pictures.video_writer import write_video
from dreamdrive.drive import frame_rate, manoeuvre, smooth
from dreamdrive.errors import InputError
from dreamdrive.files.output import new_file
from dreamdrive.progress import Progress
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.show import panels
from dreamdrive.show.ids import with_ids
from dreamdrive.splat import render, render_scene


@dataclass(frozen=True)
class Scored:
    """Gaussians of the static fit with their dynamic scores in [0, 1], for the panel that shows them.

    Above the threshold a Gaussian votes for moving (eq. 9).
    """

    gaussians: Gaussians
    scores: Float[Tensor, " n"]
    threshold: float


def write_videos(
    folder: Path,
    scene: Scene,
    recorded: UInt8[np.ndarray, "f h w 3"],
    scored: Scored | None,
    progress: Progress,
    *,
    shift_m: float | None,
) -> None:
    """Write ``drive.mp4``, ``shift.mp4``, ``recorded_beside_rendered.mp4`` and ``panels.mp4``.

    The second is ``shift_m`` to the right of the first; without that there is none. All show the rig's first
    camera, with its frames as recorded, in the source's distortion; of several, ``surround.mp4`` shows what
    each of them sees. Without scores their panel is black.
    """
    rate = frame_rate(scene.trajectory)
    drive = smooth(scene.trajectory)
    smooth_hz = frame_rate(drive)
    lens = lens_of(scene)
    drives: list[tuple[str, Iterator[UInt8[np.ndarray, "h w 3"]], float]] = [
        ("drive", drive_frames(scene, drive, lens), smooth_hz),
        ("recorded_beside_rendered", _beside(scene, recorded, lens), rate),
        ("panels", _panels(scene, scored), rate),
    ]
    total = len(drive) + 2 * len(scene.front)
    if shift_m is not None:
        shifted = manoeuvre("shift", drive, scene.up, shift_m)
        drives.insert(1, ("shift", drive_frames(scene, shifted), smooth_hz))
        total += len(shifted)
    if scene.camera is not None:
        drives.append(("surround", _surround(scene, scene.camera), rate))
        total += len(scene.front)
    done = 0

    def counted(frames: Iterator[UInt8[np.ndarray, "h w 3"]]) -> Iterator[UInt8[np.ndarray, "h w 3"]]:
        nonlocal done
        for frame in frames:
            yield frame
            done += 1
            progress(done, total)

    for name, frames, fps in drives:
        write_video(folder / f"{name}.mp4", counted(frames), fps)


def write_held_out(folder: Path, scene: Scene, source_index: list[int]) -> None:
    """Write the view of each held-out frame as ``NNNN.png``, in the source's distortion.

    The number is the frame's index in the source. Of several cameras, those after the first add ``_cameraK``.
    """
    lens = lens_of(scene)
    for i in np.flatnonzero(scene.held_out).tolist():
        camera = scene.of_rig(i)
        image = as_recorded(scene, scene.cameras[i], float(scene.times_s[i]), lens, camera)
        write_png(folder / f"{source_index[i]:04d}{f'_camera{camera}' if camera else ''}.png", image)


def write_png(path: Path, image: UInt8[np.ndarray, "h w 3"]) -> None:
    """Write an RGB picture; the file appears when it is whole."""
    with new_file(path) as partial:
        write_picture(partial, cv2.cvtColor(image, cv2.COLOR_RGB2BGR))


def drive_frames(
    scene: Scene, drive: Trajectory, lens: SourceLens | None = None
) -> Iterator[UInt8[np.ndarray, "h w 3"]]:
    """The frames of a drive, with the camera of the recording, one at a time."""

    def seen(k: int) -> UInt8[np.ndarray, "h w 3"]:
        camera = scene.cameras[0].at(drive.world_from_camera[k])
        return as_recorded(scene, camera, float(drive.times_s[k]), lens)

    return ahead(seen, range(len(drive)))


def as_recorded(
    scene: Scene, camera: Camera, t_s: float, lens: SourceLens | None, of_rig: int = 0
) -> UInt8[np.ndarray, "h w 3"]:
    """A view as a camera of the rig would have shown it, with the distortion of its lens if it has one."""
    if lens is None:
        return render_scene(scene, camera, t_s, of_rig=of_rig).picture
    wide = lens.covering().at(camera.world_from_camera)
    return panels.to_bytes(lens.apply(render_scene(scene, wide, t_s, of_rig=of_rig).colour.numpy(), wide))


def lens_of(scene: Scene) -> SourceLens | None:
    """The lens of the recording, where its distortion is known."""
    values = scene.provenance.lens
    try:
        return None if values is None else SourceLens.from_json(values)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"the scene's lens cannot be used ({error}); generate it again") from error


def _beside(
    scene: Scene, recorded: UInt8[np.ndarray, "f h w 3"], lens: SourceLens | None
) -> Iterator[UInt8[np.ndarray, "h w 3"]]:
    for frame, rendered in zip(recorded, drive_frames(scene, scene.trajectory, lens), strict=True):
        yield panels.grid({"recorded": frame, "rendered": rendered})


def _surround(scene: Scene, camera: Int[np.ndarray, " f"]) -> Iterator[UInt8[np.ndarray, "h w 3"]]:
    """All cameras of the rig at each time: above what looks ahead, below what looks back, mirrored."""
    front = scene.cameras[0].camera_from_world
    rig = np.unique(camera).tolist()
    views = {index: np.flatnonzero(camera == index).tolist() for index in rig}
    ahead = {index: front[:3, :3] @ scene.cameras[views[index][0]].world_from_camera[:3, 2] for index in rig}
    above = sorted((i for i in rig if ahead[i][2] > 0), key=lambda i: ahead[i][0])
    below = sorted((i for i in rig if ahead[i][2] <= 0), key=lambda i: ahead[i][0])
    for step in range(min(len(each) for each in views.values())):
        rows: list[UInt8[np.ndarray, "h w 3"]] = []
        for row in (above, below):
            frames = [(i, views[i][step]) for i in row]
            seen = [as_recorded(scene, scene.cameras[f], float(scene.times_s[f]), None, i) for i, f in frames]
            rows += [np.concatenate(seen, axis=1)] if seen else []
        width = max(row.shape[1] for row in rows)
        yield np.concatenate([np.pad(r, ((0, 0), (0, width - r.shape[1]), (0, 0))) for r in rows])


def _panels(scene: Scene, scored: Scored | None) -> Iterator[UInt8[np.ndarray, "h w 3"]]:
    front = scene.front.tolist()

    def of(k: int) -> UInt8[np.ndarray, "h w 3"]:
        camera, t_s = scene.cameras[front[k]], float(scene.times_s[front[k]])
        near = front[max(k - 1, 0) : k + 2]
        whole = render_scene(scene, camera, t_s)
        still, moving = (render_scene(scene, camera, t_s, part=part).colour for part in ("static", "dynamic"))
        score = torch.zeros_like(whole.alpha) if scored is None else score_image(scored, camera, near)
        images = {
            "static": panels.to_bytes(still.numpy()),
            "dynamic": with_ids(panels.to_bytes(moving.numpy()), scene, camera, t_s),
            "score": panels.score_colours(score.numpy()),
            "depth": panels.depth_colours(whole.depth_m.numpy()),
        }
        return panels.grid(images)

    return ahead(of, range(len(front)))


@torch.no_grad()
def score_image(scored: Scored, camera: Camera, frames: list[int]) -> Float[Tensor, "h w"]:
    """Scores composited like colour (eq. 8).

    The seeds hold a moving thing once a frame; of those only the ones from ``frames`` are shown.
    """
    source = scored.gaussians.source_frame
    near = torch.isin(source, torch.tensor(frames, device=source.device))
    rows = torch.nonzero(near | (scored.scores <= scored.threshold)).squeeze(1)
    shown = scored.gaussians.select(rows)
    return render(shown, camera, channels=scored.scores[rows][:, None], sh_degree=0).channels[..., 0].cpu()
