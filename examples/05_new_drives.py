"""Drives that nobody recorded: beside the path, into the next lane, and along a path of your own.

    python examples/05_new_drives.py [SCENE] [--out DIR]

Manoeuvres have names. Any other drive is a `Trajectory`: poses of the camera over times, in the world of
the scene (x right, y down, z forward, metres). Written to a file it is what `dreamdrive render --trajectory
FILE` takes. A drive through what the scene has not seen is refused.

SCENE is a folder that `generate` wrote; without it a small one is made.
"""

import argparse
from pathlib import Path

import numpy as np
from small import small_scene

from dreamdrive import Trajectory, load_scene
from dreamdrive.data import write_trajectory
from dreamdrive.drive import drives_of
from dreamdrive.show import RenderOptions, write_drive


def main() -> None:
    """Render three drives as videos."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("scene", nargs="?", type=Path)
    arguments.add_argument("--out", type=Path, default=Path("out/05_new_drives"))
    given = arguments.parse_args()

    scene = load_scene((given.scene or small_scene(given.out.parent)) / "scene")
    file = given.out / "swaying.json"
    given.out.mkdir(parents=True, exist_ok=True)
    write_trajectory(swaying(scene.trajectory), file)

    for drive in drives_of(scene, ["shift", "lane-left", str(file)], shift_m=-1.0, fps=None):
        video = given.out / f"{drive.name}.mp4"
        write_drive(video, scene, drive, RenderOptions(), lambda done: None)
        print(f"{video}: {len(drive.path)} frames, {drive.path.length_m:.1f} m")


def swaying(recorded: Trajectory) -> Trajectory:
    """The recorded path at half its speed, half a metre from side to side."""
    poses = recorded.world_from_camera.copy()
    right = poses[:, :3, 0]
    poses[:, :3, 3] += 0.5 * np.sin(np.linspace(0, 2 * np.pi, len(poses)))[:, None] * right
    return Trajectory(poses, 2 * recorded.times_s)


if __name__ == "__main__":
    main()
