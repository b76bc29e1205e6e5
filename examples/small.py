"""Small inputs that the examples share: made at the first call, found again by all later ones."""

import subprocess
import sys
from pathlib import Path

from dreamdrive import Control, generate


def small_street(beside: Path) -> Path:
    """A drawn street: twelve frames of 160x96 in ``frames``, with all truth and its layout."""
    street = beside / "small_street"
    if not street.exists():
        run("world", "make", "--frames", "12", "--size", "160x96", "-o", street)
    return street


def small_scene(beside: Path) -> Path:
    """The folder of a scene of that street, as a draft: a quarter of a minute on two cores."""
    scene = beside / "small_scene"
    control = Control(small_street(beside), fps=10, hfov_deg=64, hold_out=4)
    generate(control, scene, quality="draft", camera_height_m=1.5)
    return scene


def small_drive(beside: Path) -> Path:
    """The same street as a data set of one drive, in the format of nuScenes."""
    drive = beside / "small_drive"
    if not drive.exists():
        run("export", small_street(beside), "--to", "nuscenes", "-o", drive)
    return drive


def run(*command: str | Path) -> None:
    """A command of dreamdrive, as one would type it."""
    subprocess.run([sys.executable, "-m", "dreamdrive", *map(str, command)], check=True)
