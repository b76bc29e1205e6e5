"""Scenes as files of 3D and 4D Gaussians beside PLY."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.export.splats.glb import left_out_of_glb as left_out_of_glb, scene_to_glb as scene_to_glb
    from dreamdrive.export.splats.spz import left_out_of_spz as left_out_of_spz, scene_to_spz as scene_to_spz

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
