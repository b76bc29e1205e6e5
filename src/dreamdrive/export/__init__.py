"""Scenes and drawn streets in other formats."""

from collections.abc import Callable
from pathlib import Path

from dreamdrive.choices import ExportKind
from dreamdrive.errors import InputError
from dreamdrive.export.mcap import scene_to_mcap, world_to_mcap, write_mcap
from dreamdrive.export.mcap_file import need_foxglove
from dreamdrive.export.mcap_words import RecordedBox
from dreamdrive.export.mcap_writer import DriveRecording, check_mcap, ground_pose
from dreamdrive.export.ncore import scene_to_ncore, world_to_ncore
from dreamdrive.export.ncore_words import need_ncore
from dreamdrive.export.ncore_writer import KIND as NCORE_KIND
from dreamdrive.export.ncore_writer import write_ncore
from dreamdrive.export.nuscenes import export_scene, export_world
from dreamdrive.export.ply import check_ply, export_ply, left_out_of_ply, write_ply
from dreamdrive.scene.scene import Scene

KINDS: dict[ExportKind, Callable[[Scene, Path], None]] = {
    "ply": export_ply,
    "nuscenes": export_scene,
    "ncore": scene_to_ncore,
    "mcap": scene_to_mcap,
}
"""What ``export --to`` takes."""


def export(scene: Scene, kind: str, path: Path) -> None:
    """Write a scene as one of :data:`KINDS`; ``InputError`` where there is none or it cannot be written."""
    if kind not in KINDS:
        raise InputError(f"unknown export kind {kind!r}; expected {', '.join(KINDS)}")
    KINDS[kind](scene, path)
