"""Surfaces of a scene: depth, flow and meshes."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.export.surfaces.depth import scene_to_depth as scene_to_depth
    from dreamdrive.export.surfaces.flow import scene_to_flow as scene_to_flow
    from dreamdrive.export.surfaces.fusion import SurfaceMesh as SurfaceMesh
    from dreamdrive.export.surfaces.mesh import mesh_of as mesh_of, scene_to_mesh as scene_to_mesh

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
