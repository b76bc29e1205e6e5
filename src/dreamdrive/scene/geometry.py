"""The geometry of a clip: cameras, depth and how far these can be trusted."""

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from jaxtyping import Bool, Float, Int, UInt16

from dreamdrive.scene.camera import Camera

Basis = Literal[
    "given", "asked path", "height", "usual height", "seen sizes", "asked speed", "usual speed", "usual depth"
]
"""What the metre rests on: what was given in metres; a path that generated frames were asked to follow; the
height of the camera above the road, given, assumed, or told by sizes that a picture shows; a speed, asked for
or assumed; an assumed distance."""

Fallback = Literal["few", "blank", "standing", "refused"]
"""Why the full reconstruction did not run: too few frames, nothing to follow in them, a camera that stands,
or a path that nobody could believe."""


CREEP_M = 0.3
"""As far a car that waits may roll, and still show everything from one place."""


@dataclass(frozen=True)
class Scale:
    """What fixed the metric scale.

    Attributes:
        source: ``"poses"``, ``"depth"``, ``"ground plane, camera height 1.50 m"``, ``"none: ..."``: in words.
        spread: Relative spread of the scale, as a fraction; infinite when there is no metric scale.
        others: What else tells metres, by its source: its metres for one of this scale, 1 where both agree.
        basis: The kind of that source.
        against: Why it cannot be right, in words; empty where nothing is against it.
    """

    source: str
    spread: float
    others: dict[str, float] = field(default_factory=dict)
    basis: Basis = "given"
    against: str = ""

    @property
    def disagreement(self) -> float | None:
        """How far the others are from this scale at most, as a fraction; None where there are none."""
        return max((abs(ratio - 1) for ratio in self.others.values()), default=None)


@dataclass(frozen=True)
class Focal:
    """The focal length at the clip's size; observed where it is calibrated or constrained by turning."""

    px: float
    observed: bool


@dataclass(frozen=True)
class Ground:
    """The road as a plane: points x with ``normal_world . x + offset_m = 0``, the unit normal pointing up.

    Up is about -y in the world frame; ``offset_m`` is the height of the world's origin above the plane.
    """

    normal_world: Float[np.ndarray, "3"]
    offset_m: float

    def seen_from(self, world_from_camera: Float[np.ndarray, "4 4"]) -> "Ground":
        """The same plane in the frame of a camera at that pose."""
        rotation, place = world_from_camera[:3, :3], world_from_camera[:3, 3]
        return Ground(rotation.T @ self.normal_world, float(self.height_m(place)))

    def height_m(self, points_world: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n"]:
        """Height of points (..., 3) above the plane."""
        return np.asarray(points_world @ self.normal_world + self.offset_m)

    def depth_m(self, camera: Camera) -> Float[np.ndarray, "h w"]:
        """Depth along z (H, W) at which each pixel's ray meets the plane; infinite above the horizon."""
        rays_world = camera.rays() @ camera.world_from_camera[:3, :3].T
        height = float(self.height_m(camera.world_from_camera[:3, 3]))
        slope = -(rays_world @ self.normal_world)
        return np.where(slope > 1e-9, height / np.maximum(slope, 1e-9), np.inf)


@dataclass(frozen=True)
class Geometry:
    """Cameras and dense geometry of a clip, in metres, in the frame of the first camera.

    Attributes:
        cameras: One posed pinhole a frame.
        depth_m: Depth along z (F, H, W); 0 where there is none.
        confidence: Trust in the depth (F, H, W) in [0, 1]; 0 in sky, invalid and camera-fixed pixels.
        sky: Sky masks (F, H, W).
        moving: Evidence that a pixel belongs to something that moves (F, H, W) in [0, 1].
        spread: Relative half width of the interval that holds the depth with 68 % (F, H, W), 0 where there is
            none; None where nothing tells it.
        road_users: The road user that a pixel belongs to (F, H, W), one number over all frames in which it
            was followed, from 1; 0 where there is none. None where nobody looked for them.
        stereo_ratio: Depth by stereo alone over ``depth_m`` (F, H, W), 1 where stereo says nothing; None
            where no network has a part in ``depth_m``, or stereo none.
        stereo_confidence: Trust in that depth (F, H, W), as ``confidence``; None where there is none.
        stands: Whether withheld frames are predicted by a street that stands; None where they were not asked.
        fixed_regions: 0 for the street; otherwise 1 + the index into ``region_names`` of what is fixed to the
            camera (bonnet, mirror, bar, overlay) and stays empty in the scene; one map for each camera of the
            clip's rig (K, H, W).
        region_names: Names of the regions in ``fixed_regions``.
        ground: The road plane, where found.
        scale: What fixed the metric scale.
        focal: Focal length and whether it was observed.
        detected: What was noticed about the clip, a sentence each.
        fallback: Why the fallback ran, in words, or None when the full reconstruction did.
        details: Figures for the report, as JSON values.
        fallback_kind: Why depth is a guess; set without that reason where given poses stand still.
        placed: Frames whose cameras were found, rather than put between their neighbours; None for all.
        metres_per_unit: What makes metres of known poses and depth; None where their unit stays unknown.
    """

    cameras: tuple[Camera, ...]
    depth_m: Float[np.ndarray, "f h w"]
    confidence: Float[np.ndarray, "f h w"]
    sky: Bool[np.ndarray, "f h w"]
    moving: Float[np.ndarray, "f h w"]
    fixed_regions: Int[np.ndarray, "k h w"]
    region_names: tuple[str, ...]
    ground: Ground | None
    scale: Scale
    focal: Focal
    detected: tuple[str, ...] = ()
    fallback: str | None = None
    details: dict[str, Any] = field(default_factory=dict)
    fallback_kind: Fallback | None = None
    placed: int | None = None
    metres_per_unit: float | None = 1.0
    spread: Float[np.ndarray, "f h w"] | None = None
    road_users: UInt16[np.ndarray, "f h w"] | None = None
    stereo_ratio: Float[np.ndarray, "f h w"] | None = None
    stereo_confidence: Float[np.ndarray, "f h w"] | None = None
    stands: bool | None = None

    @property
    def at_one_place(self) -> bool:
        """Whether cameras that look different ways, if at all, stay where the first is, but for a creep."""
        places_m = np.stack([camera.world_from_camera[:3, 3] for camera in self.cameras])
        return len(places_m) > 1 and bool((np.ptp(places_m, axis=0) <= CREEP_M).all())

    def points_world(self, frame: int) -> Float[np.ndarray, "h w 3"]:
        """Points (H, W, 3) of one frame in the world; the camera centre where there is no depth."""
        camera = self.cameras[frame]
        points = camera.rays() * self.depth_m[frame][..., None]
        return points @ camera.world_from_camera[:3, :3].T + camera.world_from_camera[:3, 3]
