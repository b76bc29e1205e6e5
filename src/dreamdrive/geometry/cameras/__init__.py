"""Structure from motion and its gate, focal length, odometry, known poses, checks of paths."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.geometry.cameras import contradiction as contradiction, odometry as odometry, sfm as sfm
    from dreamdrive.geometry.cameras.calm import calmed as calmed
    from dreamdrive.geometry.cameras.creeping import with_creep as with_creep
    from dreamdrive.geometry.cameras.focal import settle as settle
    from dreamdrive.geometry.cameras.mapping import STEPS as STEPS
    from dreamdrive.geometry.cameras.paths import (
        fill as fill,
        rebase as rebase,
        stands as stands,
        unit_in as unit_in,
        without_poses as without_poses,
    )
    from dreamdrive.geometry.cameras.posing import (
        MIN_TRACKS as MIN_TRACKS,
        Posed as Posed,
        as_posed as as_posed,
        pose_clip as pose_clip,
    )
    from dreamdrive.geometry.cameras.refine import refined as refined

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
