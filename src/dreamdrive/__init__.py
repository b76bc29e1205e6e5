"""From a dashcam clip to a 4D Gaussian scene and a new drive through it, on a laptop CPU."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dreamdrive.errors import InputError as InputError
    from dreamdrive.knowledge import look as look
    from dreamdrive.options import Options as Options
    from dreamdrive.pipeline import Given as Given
    from dreamdrive.pipeline import build_scene as build_scene
    from dreamdrive.pipeline import generate as generate
    from dreamdrive.run import Outcome as Outcome
    from dreamdrive.scene.camera import Camera as Camera
    from dreamdrive.scene.clip import Clip as Clip
    from dreamdrive.scene.control import Control as Control
    from dreamdrive.scene.gaussians import Gaussians as Gaussians
    from dreamdrive.scene.geometry import Geometry as Geometry
    from dreamdrive.scene.look import Look as Look
    from dreamdrive.scene.scene import Scene as Scene
    from dreamdrive.scene.trajectory import Trajectory as Trajectory
    from dreamdrive.splat import render_scene as render_scene
    from dreamdrive.stored import load_scene as load_scene
    from dreamdrive.stored import save_scene as save_scene

__version__ = "0.1.0"

# Where each public name lives; loaded at first use, so that importing the package costs nothing.
_HOME = {
    "Camera": "dreamdrive.scene.camera",
    "Clip": "dreamdrive.scene.clip",
    "Control": "dreamdrive.scene.control",
    "Gaussians": "dreamdrive.scene.gaussians",
    "Geometry": "dreamdrive.scene.geometry",
    "Given": "dreamdrive.pipeline",
    "InputError": "dreamdrive.errors",
    "Look": "dreamdrive.scene.look",
    "Options": "dreamdrive.options",
    "Outcome": "dreamdrive.run",
    "Scene": "dreamdrive.scene.scene",
    "Trajectory": "dreamdrive.scene.trajectory",
    "build_scene": "dreamdrive.pipeline",
    "generate": "dreamdrive.pipeline",
    "load_scene": "dreamdrive.stored.folder",
    "look": "dreamdrive.knowledge",
    "render_scene": "dreamdrive.splat",
    "save_scene": "dreamdrive.stored.folder",
}


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module 'dreamdrive' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted(_HOME)
