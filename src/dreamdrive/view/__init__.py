"""The scene in a browser: pictures of our own splat, streamed while the camera moves."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.view.during import RunWatch as RunWatch
    from dreamdrive.view.gate import LOOPBACK as LOOPBACK, Gate as Gate
    from dreamdrive.view.layers import LAYERS as LAYERS, Layer as Layer
    from dreamdrive.view.listing import SceneOnDisk as SceneOnDisk, scenes_below as scenes_below
    from dreamdrive.view.opened import Viewer as Viewer, view_run as view_run, view_scene as view_scene
    from dreamdrive.view.saving import Desk as Desk
    from dreamdrive.view.server import listen as listen
    from dreamdrive.view.session import Session as Session

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
