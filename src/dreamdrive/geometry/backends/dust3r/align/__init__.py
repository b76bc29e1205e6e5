"""Global alignment: from pointmaps of pairs to one world (Wang et al. 2024, section 3.4)."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.geometry.backends.dust3r.align.aligned import Aligned as Aligned
    from dreamdrive.geometry.backends.dust3r.align.alignment import (
        AlignOptions as AlignOptions,
        KnownCameras as KnownCameras,
        align as align,
        check_memory as check_memory,
        predicted_bytes as predicted_bytes,
    )
    from dreamdrive.geometry.backends.dust3r.align.focal import robust_px as robust_px
    from dreamdrive.geometry.backends.dust3r.align.graph import Graph as Graph, graph_of as graph_of
    from dreamdrive.geometry.backends.dust3r.align.spanning_tree import (
        BASE_SCALE as BASE_SCALE,
        AlignmentStart as AlignmentStart,
        spanning_tree as spanning_tree,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
