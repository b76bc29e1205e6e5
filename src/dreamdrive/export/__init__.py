"""Scenes and drawn streets in other formats."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.export.cameras import (
        scene_to_colmap as scene_to_colmap,
        scene_to_nerfstudio as scene_to_nerfstudio,
        scene_to_tum as scene_to_tum,
    )
    from dreamdrive.export.kinds import Export as Export, function as function
    from dreamdrive.export.labels import Labels as Labels, labels_of as labels_of
    from dreamdrive.export.log import take as take
    from dreamdrive.export.mcap.file import need_foxglove as need_foxglove
    from dreamdrive.export.mcap.mcap import (
        scene_to_mcap as scene_to_mcap,
        world_to_mcap as world_to_mcap,
        write_mcap as write_mcap,
    )
    from dreamdrive.export.mcap.words import RecordedBox as RecordedBox
    from dreamdrive.export.mcap.writer import DriveRecording as DriveRecording, ground_pose as ground_pose
    from dreamdrive.export.ncore.ncore import (
        scene_to_ncore as scene_to_ncore,
        world_to_ncore as world_to_ncore,
    )
    from dreamdrive.export.ncore.words import need_ncore as need_ncore
    from dreamdrive.export.ncore.writer import write_ncore as write_ncore
    from dreamdrive.export.nuscenes.nuscenes import export_scene as export_scene, export_world as export_world
    from dreamdrive.export.nuscenes.writer import (
        write_nuscenes as write_nuscenes,
        write_points as write_points,
    )
    from dreamdrive.export.ply import (
        export_ply as export_ply,
        left_out_of_ply as left_out_of_ply,
        write_ply as write_ply,
    )
    from dreamdrive.export.surfaces import (
        SurfaceMesh as SurfaceMesh,
        mesh_of as mesh_of,
        scene_to_depth as scene_to_depth,
        scene_to_flow as scene_to_flow,
        scene_to_mesh as scene_to_mesh,
    )
    from dreamdrive.export.table import EXPORTS as EXPORTS, export as export
    from dreamdrive.export.world_log import taken_of_world as taken_of_world

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
