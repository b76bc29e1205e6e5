"""From a dashcam clip to a 4D Gaussian scene and a new drive through it, on a laptop CPU.

Most need no more than::

    outcome = generate("drive.mp4", "out", quality="draft", camera_height_m=1.4)
    scene = load_scene("out/scene")
    frames = scene.render(scene.trajectory)  # uint8 (frames, height, width, 3)
    view = render_scene(scene, scene.cameras[0], t_s=0.5)  # colour, alpha, depth_m, dynamic_share
    seen = look(frames)  # depth, classes, road users and the camera, of each picture by itself

``Control`` says how an input is read, ``Options`` how a scene is built; ``build_scene`` goes from a ``Clip``
to a ``Scene`` without a folder. In notebooks scenes, trajectories, looks and outcomes show themselves. More
is in packages: ``drive`` (new paths), ``edit``, ``export``, ``evaluate``, ``splat``, ``show``, ``tasks``;
``prior``, ``geometry`` and ``data`` hold what others add to.

World: the first camera, x right, y down, z forward, metres. Pictures are NumPy, Gaussians torch. A user's
mistake is an ``InputError``.
"""

import sys
from typing import TYPE_CHECKING

from dreamdrive.registry import MovedFinder, offer

if TYPE_CHECKING:
    from dreamdrive.build import Given as Given, build_scene as build_scene
    from dreamdrive.edit import edited as edited
    from dreamdrive.errors import InputError as InputError
    from dreamdrive.generate import generate as generate
    from dreamdrive.options import Options as Options
    from dreamdrive.run import Outcome as Outcome
    from dreamdrive.scene.camera import Camera as Camera
    from dreamdrive.scene.clip import Clip as Clip
    from dreamdrive.scene.control import Control as Control
    from dreamdrive.scene.gaussians import Gaussians as Gaussians
    from dreamdrive.scene.geometry import Geometry as Geometry
    from dreamdrive.scene.scene import Scene as Scene
    from dreamdrive.scene.street.look import Look as Look
    from dreamdrive.scene.trajectory import Trajectory as Trajectory
    from dreamdrive.splat import render_scene as render_scene
    from dreamdrive.stored import load_scene as load_scene, save_scene as save_scene
    from dreamdrive.street_network import look as look

__version__ = "0.1.0"
# By this ``help`` lists them.
__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
sys.meta_path.insert(0, MovedFinder())
