"""Scenes at draft quality that several benchmarks look at."""

from dataclasses import replace
from pathlib import Path

from dreamdrive.build import build_scene
from dreamdrive.options import QUALITIES
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.scene import Scene
from dreamdrive.stored import load_scene, save_scene


def draft_of(clip: Clip, knowledge: str, folder: Path) -> Scene:
    """The scene of a clip; one that lies in the folder already is taken as it is."""
    if not folder.exists():
        built = build_scene(clip, replace(QUALITIES["draft"], knowledge=knowledge))
        save_scene(built.scene, folder)
    return load_scene(folder)
