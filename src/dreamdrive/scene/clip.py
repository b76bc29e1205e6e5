"""Clips: frames, times, features and whatever is known of the cameras."""

from dataclasses import dataclass, field, replace
from typing import Any

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry, Ground, Scale
from dreamdrive.scene.street.log import OfLog
from dreamdrive.scene.street.look import Look
from dreamdrive.scene.trajectory import Trajectory

OF_GEOMETRY = 2
"""Leading channels that geometry gives: moving evidence and confidence. Those of the clip's frames follow."""


@dataclass(frozen=True)
class Known:
    """What the input itself says about the geometry; each field may be absent.

    Attributes:
        world_from_camera: Poses (F, 4, 4) in metres, unless ``metric`` says otherwise.
        intrinsics: Whether the rig's focal length and principal point are calibrated (not guessed).
        depth_m: Depth along z (F, H, W) in metres; 0 where unknown.
        sky: Sky masks (F, H, W).
        metric: Whether poses, depth and points are in metres; otherwise all share a unit that is not known.
        points: Sparse points of the street (P, 3), in the world of the poses.
        ground: The road plane, in the world of the poses.
        generated: Whether a model drew the frames for these poses, or for the rig's mountings: that the
            frames show something else is then no mistake of the user's.
        hfov: Whether the field of view at least was told; what turning shows may correct it.
        unseen: What stands and no frame shows, in the world of the poses, as the prior made it up: it is no
            part of any fit.
        shared_first: Whether the cameras of the rig are one, on several drives that begin at one frame.
        scale: What metres of poses and depth rest on, where a prior made these; None where they were given.
        focal_guessed: Whether frames were drawn with a focal length that is itself a guess.
    """

    world_from_camera: Float[np.ndarray, "f 4 4"] | None = None
    intrinsics: bool = False
    depth_m: Float[np.ndarray, "f h w"] | None = None
    sky: Bool[np.ndarray, "f h w"] | None = None
    metric: bool = True
    points: Float[np.ndarray, "p 3"] | None = None
    ground: Ground | None = None
    generated: bool = False
    hfov: bool = False
    unseen: Gaussians | None = None
    shared_first: bool = False
    scale: Scale | None = None
    focal_guessed: bool = False

    @property
    def drawn(self) -> bool:
        """Whether frames were drawn from that depth: what they show stands, and the rest is made up."""
        return self.generated and self.depth_m is not None

    @property
    def focal(self) -> bool:
        """Whether the focal length was told, by a calibration or a field of view."""
        return self.intrinsics or self.hfov


@dataclass(frozen=True)
class Recorded:
    """How frames were taken from pictures on disk; sizes are width and height in pixels.

    Attributes:
        path: Of the recording.
        is_video: A video; else a folder of images.
        size: Of its pictures.
        scaled: To which these were scaled.
        offset: Columns and rows that were then cut away at the left and the top.
        lens: What was taken out of the frames, as ``data.SourceLens.from_json`` reads it.
        turned: Whether the frames, and with them offset and lens, are those of pictures turned by half.
    """

    path: str
    is_video: bool
    size: tuple[int, int]
    scaled: tuple[int, int]
    offset: tuple[int, int]
    lens: dict[str, Any] | None = None
    turned: bool = False


@dataclass(frozen=True)
class Clip:
    """Frames of one drive in the order of time; those of several cameras at one time in that of the rig.

    Attributes:
        frames: RGB (F, H, W, 3).
        times_s: Time of each frame (F,).
        camera: Index into ``rig`` of each frame (F,).
        rig: Pinholes of the frames' size; their poses are the mounting on the car (``car_from_camera``, in
            metres), the identity for a single camera.
        valid: False where the frame holds no picture, such as the corners of an undistorted image (F, H, W).
        held_out: Frames that no fit may see (F,).
        source_index: Index of each frame in the source, in file or decode order (F,).
        features: Named per-pixel features (F, h, w, C), the paper's Z_ref; h and w a whole fraction of H, W.
        latents: What the frames were decoded from, for priors with a latent space (F, h, w, C).
        known: What the input says about the geometry.
        requested: The trajectory a generative prior was asked for.
        set_in_motion: Pixels of what a generative prior made move (F, H, W), to judge by; no stage sees them.
        looks: What the street network sees, one look a camera of the rig; empty where it was not asked.
        cuts: Index of each first frame of its camera after a change to another scene.
        recorded: How the frames were taken from pictures on disk; None where they were drawn or generated.
        log: The drive of a data set that the frames are of, or that they were drawn or generated for. The
            world that it places is the camera of the clip's first frame.
        provenance: Where the frames come from, in words and JSON values; ``provenance["notes"]`` is a list
            of sentences for the report.
    """

    frames: UInt8[np.ndarray, "f h w 3"]
    times_s: Float[np.ndarray, " f"]
    camera: Int[np.ndarray, " f"]
    rig: tuple[Camera, ...]
    valid: Bool[np.ndarray, "f h w"]
    held_out: Bool[np.ndarray, " f"]
    source_index: Int[np.ndarray, " f"]
    features: dict[str, Float[np.ndarray, "f _ _ _"]] = field(default_factory=dict)
    latents: Float[np.ndarray, "f _ _ _"] | None = None
    known: Known = field(default_factory=Known)
    requested: Trajectory | None = None
    set_in_motion: Bool[np.ndarray, "f h w"] | None = None
    looks: tuple[Look, ...] = ()
    cuts: tuple[int, ...] = ()
    recorded: Recorded | None = None
    log: OfLog | None = None
    provenance: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        count = len(self.frames)
        for name in ("times_s", "camera", "valid", "held_out", "source_index"):
            if len(getattr(self, name)) != count:
                raise ValueError(f"clip: {name} has {len(getattr(self, name))} entries for {count} frames")
        if not all(0 < cut < count for cut in self.cuts):
            raise ValueError(f"clip: cuts {self.cuts} are not all inside its {count} frames")
        seen = [len(look) for look in self.looks]
        if self.looks and seen != [int((self.camera == k).sum()) for k in range(len(self.rig))]:
            raise ValueError(f"clip: looks of {seen} frames are not those of its cameras")
        if count and not 0 <= int(self.camera.min()) <= int(self.camera.max()) < len(self.rig):
            raise ValueError("clip: camera indexes beyond the rig")

    def __len__(self) -> int:
        return len(self.frames)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.frames.shape[2], self.frames.shape[1]

    @property
    def interval_s(self) -> float:
        """Seconds between two frames, the median where they are not even."""
        return _interval_s(self.times_s)

    @property
    def seen_interval_s(self) -> float:
        """The same between two frames that may be seen."""
        return _interval_s(self.times_s[~self.held_out])

    @property
    def step(self) -> Int[np.ndarray, " f"]:
        """Number of earlier frames of the same camera, for each frame (F,)."""
        step = np.zeros(len(self), dtype=np.int64)
        for camera in np.unique(self.camera):
            own = self.camera == camera
            step[own] = np.arange(np.count_nonzero(own))
        return step

    @property
    def look(self) -> Look | None:
        """What the street network sees in the frames of the one camera, where it was asked."""
        return self.looks[0] if self.looks else None

    def of_camera(self, camera: int) -> Int[np.ndarray, " k"]:
        """Indices of the frames of one camera of the rig, in the order of time."""
        return np.flatnonzero(self.camera == camera)

    def seen_of(self, camera: int) -> list[int]:
        """Indices of those of them that a fit may see."""
        return np.flatnonzero((self.camera == camera) & ~self.held_out).tolist()

    def of_frames(self, rows: Int[np.ndarray, " k"]) -> "Clip":
        """Some of the frames, in their order, with what is known of them but what the street network saw."""
        known, motion = self.known, self.set_in_motion
        return replace(
            self,
            frames=self.frames[rows],
            times_s=self.times_s[rows],
            camera=self.camera[rows],
            valid=self.valid[rows],
            held_out=self.held_out[rows],
            source_index=self.source_index[rows],
            features={name: values[rows] for name, values in self.features.items()},
            latents=None if self.latents is None else self.latents[rows],
            set_in_motion=None if motion is None else motion[rows],
            looks=(),
            cuts=tuple(row for row in np.flatnonzero(np.isin(rows, self.cuts)).tolist() if row),
            known=replace(
                known,
                world_from_camera=None if known.world_from_camera is None else known.world_from_camera[rows],
                depth_m=None if known.depth_m is None else known.depth_m[rows],
                sky=None if known.sky is None else known.sky[rows],
            ),
        )

    def only(self, camera: int) -> "Clip":
        """The frames of one camera of the rig, with what is known of them; it is mounted at the identity."""
        own = self.of_frames(self.of_camera(camera))
        return replace(
            own,
            camera=np.zeros(len(own), dtype=np.int64),
            rig=(self.rig[camera].at(np.eye(4)),),
            looks=self.looks[camera : camera + 1],
        )

    def with_features(self, **features: Float[np.ndarray, "f _ _ _"]) -> "Clip":
        """The clip with more named features."""
        return replace(self, features={**self.features, **features})


def pixel_features(clip: Clip, geometry: Geometry, frame: int) -> Float[np.ndarray, "h w c"]:
    """Z_ref of one frame at the frame's size: what geometry gives, then all features of the clip by name."""
    size = clip.size
    maps = [geometry.moving[frame][..., None], geometry.confidence[frame][..., None]]
    for name in sorted(clip.features):
        feature = np.asarray(clip.features[name][frame], dtype=np.float32)
        resized = cv2.resize(feature, size, interpolation=cv2.INTER_LINEAR)
        maps.append(resized.reshape(size[1], size[0], -1))
    return np.concatenate(maps, axis=2).astype(np.float32)


def _interval_s(times_s: Float[np.ndarray, " f"]) -> float:
    return float(np.median(np.diff(np.unique(times_s))))
