"""What the files of any format say about the selected frames of a clip."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.data.formats.cameras import LensCamera


@dataclass(frozen=True)
class DepthFiles:
    """Where depth lies.

    Attributes:
        of: File of each selected frame that has one, by its row.
        unit: What the stored number 1 means, in metres or in the poses' unit; ``None`` where that is not
            declared and the kind of file decides.
        metric: Whether that is metres; otherwise it is the unit of the poses.
        kitti: Whether they lie beside KITTI's calibration, in whose PNG the number 1 is 1/256 m.
    """

    of: Mapping[int, Path] = field(default_factory=dict[int, Path])
    unit: float | None = None
    metric: bool = True
    kitti: bool = False


@dataclass(frozen=True)
class SparsePoints:
    """Points of a sparse model.

    Attributes:
        points: Points (P, 3) in the world of the poses.
        seen: Which selected frame sees which point (F, P).
    """

    points: Float[np.ndarray, "p 3"]
    seen: Bool[np.ndarray, "f p"]


@dataclass(frozen=True)
class Given:
    """Poses, cameras and depth of the selected frames, as a reader found them.

    Attributes:
        world_from_camera: Rigid poses (F, 4, 4), axes x right, y down, z forward, in the file's own world.
        metric: Whether the unit of the poses is the metre.
        cameras: That of each frame, at the size of its picture; none where the format has no intrinsics.
        depth: Where depth lies.
        sparse: Sparse points, where the format has them.
        notes: What the report should say, a sentence each.
    """

    world_from_camera: Float[np.ndarray, "f 4 4"]
    metric: bool
    cameras: Sequence[LensCamera] = ()
    depth: DepthFiles = field(default_factory=DepthFiles)
    sparse: SparsePoints | None = None
    notes: tuple[str, ...] = ()
