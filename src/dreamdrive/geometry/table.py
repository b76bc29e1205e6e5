"""Ways to the geometry of a clip by their names."""

from typing import TYPE_CHECKING

from dreamdrive.registry import Table

if TYPE_CHECKING:
    from dreamdrive.geometry.protocol import GeometryBackend

BACKENDS: "Table[GeometryBackend]" = Table(
    "--geometry",
    "dreamdrive.geometry",
    "dreamdrive.geometry:GeometryBackend",
    {
        "classical": "dreamdrive.geometry.backends.classical:CLASSICAL",
        "dust3r": "dreamdrive.geometry.backends.dust3r:DUST3R",
        "da3": "dreamdrive.geometry.backends.feedforward.da3:DA3",
        "mapanything": "dreamdrive.geometry.backends.feedforward.mapanything:MAPANYTHING",
        "vggt": "dreamdrive.geometry.backends.feedforward.vggt:VGGT",
        "pi3": "dreamdrive.geometry.backends.feedforward.pi3:PI3",
    },
)
"""From a clip to cameras and depth."""
