"""``dreamdrive plan``: a drive through a scene, moved out of the way of what stands and moves in it."""

import math
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from dreamdrive.cli.scene import open_scene
from dreamdrive.cli.terminal.console import plain
from dreamdrive.cli.terminal.machine import use_all_cores
from dreamdrive.cli.terminal.progress import Bars
from dreamdrive.errors import InputError
from dreamdrive.files.given import SCENE, check_there
from dreamdrive.names import PlanMethod
from dreamdrive.scene.control import check_numbers

if TYPE_CHECKING:
    from dreamdrive.scene.scene import Scene
    from dreamdrive.scene.trajectory import Trajectory
    from dreamdrive.tasks.plan import Avoided, Instant, Plan

CURRENT = "current"
_LOOKS, _RATE_HZ = 2, 20.0


def plan(
    out: Annotated[Positional[Path], arg(metavar="OUT")],
    *,
    trajectory: Annotated[str, arg(metavar="current|NAME|FILE")] = CURRENT,
    at: Annotated[float | None, arg(metavar="S", help_behavior_hint="")] = None,
    method: PlanMethod = "avoid",
    shift_m: Annotated[float, arg(metavar="M")] = 2.0,
    output: Annotated[Path | None, arg(aliases=["-o"], metavar="DIR", help_behavior_hint="")] = None,
    force: bool = False,
) -> None:
    """Move a planned drive out of the way of what the scene shows, and write it, a picture and a video.

    Args:
        out: The folder that generate wrote.
        trajectory: What is planned: current goes straight on as fast as the car drives; or a drive as render
            takes it: forward, left, right, stop, lane-left, lane-right, shift, or a file with a trajectory.
        at: The moment of planning on the clock of the scene; three seconds from it are planned. Without it
            the last recorded moment for current, and the middle of other drives.
        method: avoid moves a car, with its shape, its speed and its limits; uniad six points, each whatever
            the others do, as UniAD does.
        shift_m: How far shift goes to the right in metres; negative is to the left.
        output: The folder to write; without it OUT/video/plan_NAME.
        force: Replace an older plan.
    """
    if at is not None and not math.isfinite(at):
        raise InputError(f"--at {at}: expected seconds on the clock of the scene")
    check_numbers(shift_m, None)
    check_there(out, SCENE)
    use_all_cores()
    from dreamdrive.tasks.plan import PlanResult, path_of_plan, write_planned

    scene = open_scene(out)
    name, path, now_s = _wanted(scene, trajectory, at, shift_m)
    instant, planned = _planned(scene, path, now_s)
    after = _moved(planned, instant, method)
    drive = path_of_plan(after.plan, instant, now_s, _RATE_HZ)
    folder = out / "video" / f"plan_{name}" if output is None else output
    console = plain()
    with Bars(console) as bars:
        said = partial(bars, "plan", total=len(drive))
        write_planned(
            folder, scene, PlanResult(now_s, planned, after, instant, drive), force=force, progress=said
        )
    console.print(f"{folder}: {_told(after)}")


def _wanted(
    scene: "Scene", trajectory: str, at: float | None, shift_m: float
) -> "tuple[str, Trajectory | None, float]":
    """Name and path of the camera, None for going on as recorded, and the moment of planning."""
    from dreamdrive.drive import drives_of

    if trajectory == CURRENT:
        return CURRENT, None, float(scene.trajectory.times_s[-1]) if at is None else at
    drive = drives_of(scene, [trajectory], shift_m, None)[0]
    first_s, last_s = float(drive.path.times_s[0]), float(drive.path.times_s[-1])
    return drive.name, drive.path, (first_s + last_s) / 2 if at is None else at


def _planned(scene: "Scene", path: "Trajectory | None", now_s: float) -> "tuple[Instant, Plan]":
    import numpy as np

    from dreamdrive.tasks.plan import STEP_S, STEPS, Plan, instant_of, plan_of_path

    straight = np.column_stack([np.zeros(STEPS), STEP_S * np.arange(1, STEPS + 1)])
    count = STEPS
    if path is not None:
        count = len(plan_of_path(path, instant_of(scene, now_s, np.zeros(0), path=path), now_s))
    later_s = STEP_S / _LOOKS * np.arange(1, _LOOKS * count + 1)
    instant = instant_of(scene, now_s, later_s, path=path)
    if path is None:
        return instant, Plan(straight * max(instant.speed_m_s, 0.0))
    return instant, plan_of_path(path, instant, now_s)


def _moved(planned: "Plan", instant: "Instant", method: PlanMethod) -> "Avoided":
    from dreamdrive.tasks.plan import avoid, avoid_as_uniad

    how = avoid if method == "avoid" else avoid_as_uniad
    return how(planned, instant.speed_m_s, instant.obstacles_m)


def _told(after: "Avoided") -> str:
    if not after.changed:
        return f"nothing is in the way within {after.clear_before_m:.1f} m; the drive stays as planned"
    if after.clear_after_m < 0:
        return "something is in the way, and no drive near this one is clear of it; the best one is written"
    return f"something was in the way; the drive that is written passes it by {after.clear_after_m:.1f} m"
