"""Scenes as files of 3D and 4D Gaussians beside PLY."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.export.splats.fourdgs import (
        left_out_of_4dgs as left_out_of_4dgs,
        scene_to_4dgs as scene_to_4dgs,
    )
    from dreamdrive.export.splats.glb import left_out_of_glb as left_out_of_glb, scene_to_glb as scene_to_glb
    from dreamdrive.export.splats.sog import left_out_of_sog as left_out_of_sog, scene_to_sog as scene_to_sog
    from dreamdrive.export.splats.spz import left_out_of_spz as left_out_of_spz, scene_to_spz as scene_to_spz
    from dreamdrive.export.splats.usd import left_out_of_usd as left_out_of_usd, scene_to_usd as scene_to_usd

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
