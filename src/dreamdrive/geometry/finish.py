"""From measured cameras and depth to a geometry: metres, road, sky, what moves."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from dreamdrive.geometry.classical import assemble
from dreamdrive.geometry.classical import scale as scales
from dreamdrive.geometry.classical.dense import StaticDepth, densify
from dreamdrive.geometry.classical.evidence import Evidence
from dreamdrive.geometry.classical.known import depth_points
from dreamdrive.geometry.classical.paths import rebase
from dreamdrive.geometry.classical.poses import as_posed
from dreamdrive.geometry.classical.scale import Metric, Street
from dreamdrive.geometry.measured import Measured
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.geometry import Geometry

_MEDIAN_DEPTH_M = 12.0  # of a street seen from a car; makes "near" a word before the metre is known


def finish(
    clip: Clip, measured: Measured, evidence: Evidence, *, camera_height_m: float | None = None, seed: int = 0
) -> Geometry:
    """Bring what was measured to metres and find road, sky and what moves, as for any clip.

    The metre comes from the unit where that is one, else from the height of the camera above the road.

    Args:
        clip: The frames.
        measured: Their cameras and depth.
        evidence: The first look at them.
        camera_height_m: Height of the camera above the road; None assumes 1.5 m.
        seed: Seed of everything random.
    """
    factor = 1.0 if measured.unit is not None else _rough_factor(measured)
    poses = measured.world_from_camera.astype(np.float64)
    poses[:, :3, 3] *= factor
    metric = _metric(clip, measured, evidence, poses, factor, camera_height_m, seed)
    poses, _ = rebase(poses, np.zeros((0, 3)))
    poses[:, :3, 3] *= metric.factor
    details = {**measured.details, "metres_per_unit": factor * metric.factor}
    notes = [*measured.notes, *metric.notes]
    posed = as_posed(clip, evidence, poses, measured.camera, metric, measured.focal_observed, notes, details)
    depth_m = (measured.depth * np.float32(factor * metric.factor)).astype(np.float32)
    dense = densify(clip, posed, StaticDepth(depth_m, measured.confidence))
    return assemble(clip, posed, dense)


def _rough_factor(measured: Measured) -> float:
    depth = measured.depth[measured.depth > 0]
    return _MEDIAN_DEPTH_M / float(np.median(depth)) if len(depth) else 1.0


def _metric(
    clip: Clip,
    measured: Measured,
    evidence: Evidence,
    poses: Float[np.ndarray, "f 4 4"],
    factor: float,
    height_m: float | None,
    seed: int,
) -> Metric:
    """Scale and road of the poses, which are in metres or roughly so."""
    known = Known(poses, True, (measured.depth * np.float32(factor)).astype(np.float32))
    points = depth_points(replace(clip, rig=(measured.camera,), known=known))
    poses, points = rebase(poses, points)
    small = measured.camera.resized(evidence.small.width_px, evidence.small.height_px)
    asked_m_s = scales.asked_m_s(clip)
    street = Street(evidence.grey, evidence.street, small, poses, points, clip.times_s, asked_m_s)
    if measured.unit is None:
        return scales.from_ground(street, height_m, measured.focal_observed, seed)
    return scales.as_given(street, measured.unit, measured.unit_spread, measured.unit, height_m, seed)
