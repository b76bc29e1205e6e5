"""Files of ``dreamdrive plan``: the plan before and after, its drive, a picture from above and a video."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from dreamdrive.data.cameras.poses import write_trajectory
from dreamdrive.data.pictures.video_writer import write_video
from dreamdrive.files.json_file import write_json
from dreamdrive.files.output import new_folder
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.show import drive_frames, lens_of, write_png
from dreamdrive.tasks.plan.avoid import Avoided
from dreamdrive.tasks.plan.instant import Instant
from dreamdrive.tasks.plan.picture import MOVED, PLANNED, draw_plans
from dreamdrive.tasks.plan.trajectory import Plan

NOTE = "plan.json"
"""The figures; a folder without it is not replaced."""


@dataclass(frozen=True)
class PlanResult:
    """A plan at a moment of a scene, and what became of it."""

    now_s: float
    before: Plan
    after: Avoided
    instant: Instant
    path: Trajectory


def write_planned(
    folder: Path, scene: Scene, planned: PlanResult, *, force: bool, progress: Callable[[int], None]
) -> None:
    """Write ``plan.json``, ``trajectory.json``, ``plan.png`` and ``drive.mp4``; the folder appears whole.

    Waypoints are in the planning frame: x right, y ahead of the car at the moment of planning, in metres. The
    trajectory is that of the camera in the world of the scene, as ``render --trajectory`` takes it.
    """
    with new_folder(folder, replace=force, kind="plan") as partial:
        write_json(partial / NOTE, _figures(planned))
        write_trajectory(planned.path, partial / "trajectory.json")
        plans = [(planned.before, PLANNED), (planned.after.plan, MOVED)]
        write_png(partial / "plan.png", draw_plans(planned.instant.obstacles_m, plans))
        times_s = planned.path.times_s
        rate_hz = (len(times_s) - 1) / float(times_s[-1] - times_s[0])

        frames = drive_frames(scene, planned.path, lens_of(scene))
        write_video(partial / "drive.mp4", _counted(frames, progress), rate_hz)


def _figures(planned: PlanResult) -> dict[str, object]:
    return {
        "now_s": planned.now_s,
        "speed_m_s": planned.instant.speed_m_s,
        "step_s": planned.before.step_s,
        "planned_m": planned.before.waypoints_m,
        "waypoints_m": planned.after.plan.waypoints_m,
        "changed": planned.after.changed,
        "clear_before_m": planned.after.clear_before_m,
        "clear_after_m": planned.after.clear_after_m,
    }


def _counted(
    frames: Iterator[UInt8[np.ndarray, "h w 3"]], progress: Callable[[int], None]
) -> Iterator[UInt8[np.ndarray, "h w 3"]]:
    for number, frame in enumerate(frames):
        yield frame
        progress(number + 1)
