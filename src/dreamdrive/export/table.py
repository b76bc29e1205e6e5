"""Exports by their names."""

from pathlib import Path
from typing import TYPE_CHECKING

from dreamdrive.registry import Table

if TYPE_CHECKING:
    from dreamdrive.export.kinds import Export
    from dreamdrive.scene.scene import Scene

EXPORTS: "Table[Export]" = Table(
    "--to",
    "dreamdrive.exports",
    "dreamdrive.export:Export",
    {
        "ply": "dreamdrive.export.kinds:PLY",
        "nuscenes": "dreamdrive.export.kinds:NUSCENES",
        "ncore": "dreamdrive.export.kinds:NCORE",
        "mcap": "dreamdrive.export.kinds:MCAP",
        "colmap": "dreamdrive.export.kinds:COLMAP",
        "nerfstudio": "dreamdrive.export.kinds:NERFSTUDIO",
        "tum": "dreamdrive.export.kinds:TUM",
        "depth": "dreamdrive.export.kinds:DEPTH",
        "flow": "dreamdrive.export.kinds:FLOW",
        "mesh": "dreamdrive.export.kinds:MESH",
        "spz": "dreamdrive.export.kinds:SPZ",
        "glb": "dreamdrive.export.kinds:GLB",
        "sog": "dreamdrive.export.kinds:SOG",
        "usd": "dreamdrive.export.kinds:USD",
        "4dgs": "dreamdrive.export.kinds:FOURDGS",
        "html": "dreamdrive.export.kinds:HTML",
    },
)
"""From a scene to a file or a folder that other programs read."""


def export(scene: "Scene", kind: str, path: Path) -> None:
    """Write a scene as one of ``EXPORTS``; ``InputError`` where there is none or it cannot be written."""
    from dreamdrive.export.kinds import function

    function(EXPORTS.choose(kind).scene)(scene, path)
