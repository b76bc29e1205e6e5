"""A plan that keeps clear of what a scene shows.

    python examples/09_plan.py [SCENE] [--out DIR]

A planner meets a scene at one moment: an `Instant` has the speed of the car and the cells that are taken
from now on, read off the Gaussians; what moves goes on at the rate of its track. `avoid` varies how the car
brakes and how far beside its path it drives. The same from the shell, with pictures and a video:
`dreamdrive plan SCENE`.

SCENE is a folder that `generate` wrote; without it a small one is made.
"""

import argparse
from pathlib import Path

import numpy as np
from small import small_scene

from dreamdrive import load_scene
from dreamdrive.tasks.plan import (
    STEP_S,
    STEPS,
    Plan,
    PlanResult,
    avoid,
    instant_of,
    path_of_plan,
    write_planned,
)


def main() -> None:
    """Plan three seconds straight on from the middle of the drive, and move that plan."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("scene", nargs="?", type=Path)
    arguments.add_argument("--out", type=Path, default=Path("out/09_plan"))
    given = arguments.parse_args()

    scene = load_scene((given.scene or small_scene(given.out.parent)) / "scene")
    now_s = float(scene.trajectory.times_s[len(scene.trajectory) // 2])
    instant = instant_of(scene, now_s, STEP_S / 2 * np.arange(1, 2 * STEPS + 1))
    ahead_m = instant.speed_m_s * STEP_S * np.arange(1, STEPS + 1)
    plan = Plan(np.column_stack([np.zeros(STEPS), ahead_m]))

    moved = avoid(plan, instant.speed_m_s, instant.obstacles_m)
    print(
        f"the plan passes what is there by {moved.clear_before_m:.1f} m, moved by {moved.clear_after_m:.1f} m"
    )
    for before, after in zip(plan.waypoints_m, moved.plan.waypoints_m, strict=True):
        print(f"right, ahead: {before[0]:5.1f} {before[1]:5.1f} m  to  {after[0]:5.1f} {after[1]:5.1f} m")
    drive = path_of_plan(moved.plan, instant, now_s, 20.0)
    planned = PlanResult(now_s, plan, moved, instant, drive)
    write_planned(given.out, scene, planned, force=True, progress=lambda done: None)
    print(f"picture and video are in {given.out}")


if __name__ == "__main__":
    main()
