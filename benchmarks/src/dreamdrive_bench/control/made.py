"""A street with the scene that is made of it."""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dreamdrive.data.layout_file import write_layout
from dreamdrive.evaluate import Truth, offset_m, views_of
from dreamdrive.files.output import new_file
from dreamdrive.generate import generate
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.control import Control
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.similarity import Similarity, fit_similarity
from dreamdrive.scene.street.layout import Layout
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive.splat import render_scene
from dreamdrive.stored import load_scene
from dreamdrive_bench.common.drawn import write_cameras
from streetworld import drive

FPS = 10.0


@dataclass(frozen=True)
class Made:
    """A street with its scene."""

    drive: DriveTruth
    truth: Truth
    scene: Scene
    views: tuple[Camera, ...]


def make(layout: Layout, name: str, seed: int, options: argparse.Namespace) -> Made:
    """Draw a street and generate its scene, unless it is there already."""
    seen = drive(layout, options.frames, FPS, options.size)
    folder = options.runs / f"{options.geometry}-{options.size[0]}-{options.frames}-{options.quality}" / name
    folder.mkdir(parents=True, exist_ok=True)
    write_layout(layout, folder / "layout.json")
    given = write_geometry(seen, folder / "geometry") if options.geometry == "true" else None
    control = Control(
        path=folder / "layout.json", frames=f"0:{options.frames}", fps=FPS, size=options.size, seed=seed
    )
    generate(
        control,
        folder / "out",
        prior="street-world",
        options=options.quality,
        geometry_files=given,
        force=True,
    )
    scene, truth = load_scene(folder / "out" / "scene"), Truth.of(seen)
    return Made(seen, truth, scene, views_of(scene, truth))


def write_geometry(seen: DriveTruth, folder: Path) -> Path:
    """Exact poses and depth as ``generate --geometry-files`` reads them."""
    write_cameras(seen, folder / "cameras.json")
    for i, depth_m in enumerate(seen.depth_m):
        with new_file(folder / "depth" / f"{i:04d}.npz") as partial:
            np.savez(partial, depth_m=depth_m)
    return folder


def aligned(made: Made) -> Similarity:
    """Brings a scene onto its truth."""
    return fit_similarity(made.views, made.truth.cameras)


def found_in(made: Made) -> set[str]:
    """Names of the moving boxes that dynamic Gaussians show in half of the frames or more."""
    scene, truth, brought = made.scene, made.truth, aligned(made)
    found: set[str] = set()
    for box in made.drive.boxes:
        places = [
            offset_m(scene, view, truth, frame, box.instance, brought)
            for frame, view in enumerate(made.views)
            if box.moving
        ]
        if sum(place is not None for place in places) > len(places) / 2:
            found.add(box.id)
    return found


def render(made: Made, frame: int) -> np.ndarray:
    """A frame of a scene (H, W, 3) in [0, 1]."""
    return render_scene(made.scene, made.views[frame], float(made.scene.times_s[frame])).colour.numpy()
