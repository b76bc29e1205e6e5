"""The scene folder on disk: all that ``scene`` and ``motion`` hold, checked before it is believed."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.stored import check as check
    from dreamdrive.stored.folder import load_scene as load_scene, save_scene as save_scene

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
