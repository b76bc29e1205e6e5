"""The cameras and depth that the geometry stage found for the frames of a scene."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.geometry import Geometry, Scale


@dataclass(frozen=True)
class Estimate:
    """Cameras and depth of F frames, and which frames of the source they are.

    Attributes:
        cameras: One posed pinhole a frame, all of one size.
        held_out: Frames that have a pose and nothing else (F,).
        index: Which frame of the source each is (F,).
        times_s: Times (F,).
        depth_m: Depth along z (F, H, W), 0 where there is none; None where it was not kept.
        confidence: Trust in the depth (F, H, W) in [0, 1]; None with the depth.
        source: Name of the input's file or folder; None for one that was drawn.
        scale: What fixed the metric scale; None where it was not kept.
        focal_observed: Whether the focal length was calibrated or shown by the clip; None where not kept.
        undistorted: Whether a known lens distortion was taken out of the frames.
    """

    cameras: tuple[Camera, ...]
    held_out: Bool[np.ndarray, " f"]
    index: Int[np.ndarray, " f"]
    times_s: Float[np.ndarray, " f"]
    depth_m: Float[np.ndarray, "f h w"] | None = None
    confidence: Float[np.ndarray, "f h w"] | None = None
    source: str | None = None
    scale: Scale | None = None
    focal_observed: bool | None = None
    undistorted: bool = False

    def __post_init__(self) -> None:
        frames = len(self.cameras)
        for name in ("held_out", "index", "times_s"):
            if len(getattr(self, name)) != frames:
                raise ValueError(f"estimate: {name} has {len(getattr(self, name))} entries, not {frames}")
        shape = frames, self.size[1], self.size[0]
        for name in ("depth_m", "confidence"):
            values = getattr(self, name)
            if values is not None and values.shape != shape:
                raise ValueError(f"estimate: {name} of shape {values.shape}, expected {shape}")

    @staticmethod
    def of(
        geometry: Geometry,
        times_s: Float[np.ndarray, " f"],
        held_out: Bool[np.ndarray, " f"] | None = None,
        index: Int[np.ndarray, " f"] | None = None,
        *,
        source: str | None = None,
        undistorted: bool = False,
    ) -> "Estimate":
        """A geometry, of frames 0, 1, ... of the source unless told otherwise."""
        frames = len(geometry.cameras)
        return Estimate(
            cameras=geometry.cameras,
            held_out=np.zeros(frames, dtype=bool) if held_out is None else held_out,
            index=np.arange(frames) if index is None else index,
            times_s=times_s,
            depth_m=geometry.depth_m,
            confidence=geometry.confidence,
            source=source,
            scale=geometry.scale,
            focal_observed=geometry.focal.observed,
            undistorted=undistorted,
        )

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.cameras[0].width_px, self.cameras[0].height_px
