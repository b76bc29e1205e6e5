"""The cameras of a scene for programs that reconstruct: COLMAP, nerfstudio, and lists of poses."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.export.cameras.colmap import scene_to_colmap as scene_to_colmap
    from dreamdrive.export.cameras.nerfstudio import scene_to_nerfstudio as scene_to_nerfstudio
    from dreamdrive.export.cameras.tum import scene_to_tum as scene_to_tum

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
