"""The decomposition into static and dynamic, without labels."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.decompose.actors.actors import (
        ActorOptions as ActorOptions,
        Actors as Actors,
        find_actors as find_actors,
    )
    from dreamdrive.decompose.actors.observations import (
        Placement as Placement,
        PlacingOptions as PlacingOptions,
    )
    from dreamdrive.decompose.actors.paths import Path as Path, find_path as find_path
    from dreamdrive.decompose.between import with_between as with_between
    from dreamdrive.decompose.errors import error_maps as error_maps
    from dreamdrive.decompose.group import (
        Grouping as Grouping,
        GroupOptions as GroupOptions,
        elected as elected,
        group as group,
        source_pixels as source_pixels,
    )
    from dreamdrive.decompose.per_frame import (
        PerFrameOptions as PerFrameOptions,
        outside as outside,
        per_frame_street as per_frame_street,
        pixels_of as pixels_of,
        stands as stands,
        without_sky as without_sky,
    )
    from dreamdrive.decompose.score import (
        ScoreNetwork as ScoreNetwork,
        ScoreOptions as ScoreOptions,
        score as score,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
