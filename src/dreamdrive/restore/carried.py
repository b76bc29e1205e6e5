"""What the recorded frames show of the surfaces of another view, and what else the restorer is told of it."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache

import cv2
import numpy as np
import torch
from jaxtyping import Float, Int, UInt8
from torch import Tensor

from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.data.pictures.picture_file import frame_of
from dreamdrive.errors import InputError
from dreamdrive.restore.network import CHANNELS, FRAMES, MOVES, OF_FRAME, OF_VIEW
from dreamdrive.scene.camera import NEAR_M, Camera
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import SceneView, moment_of, render_scene
from dreamdrive.trust import GaussianEvidence, evidence_of, rows_at

_LATER_M_S, _TURNED_M = 3.0, 5.0
"""A frame that much later, or turned by one radian, is as good as one that many metres farther away."""
_NEAR_M = 2.0
_FAR_M = 1e5
_SAME = 0.1
"""Share of the depth by which one surface may differ between views."""
_KEPT = 8
"""Frames that are decoded at a time."""
_ERROR = 4.0


@dataclass
class Recordings:
    """The recorded frames of a scene, ready to be carried over to other views.

    Attributes:
        scene: What is seen.
        evidence: What its recorded views tell of its Gaussians.
        frame: The frame of a recorded view (H, W, 3), as bytes.
        views: Indices of the views whose frames may be used (V,).
    """

    scene: Scene
    evidence: GaussianEvidence
    frame: Callable[[int], UInt8[np.ndarray, "h w 3"]]
    views: Int[np.ndarray, " v"]
    _inverse: dict[int, Float[np.ndarray, "h2 w2"]] = field(default_factory=dict[int, np.ndarray])

    @classmethod
    def of(cls, scene: Scene, evidence: GaussianEvidence) -> "Recordings":
        """Those that the scene holds; frames are decoded when they are needed.

        Raises:
            InputError: The scene was changed, or does not hold its recorded frames.
        """
        kept = scene.frames
        if kept is None or not any(kept):
            raise InputError(
                "views are restored from recorded frames, and the scene holds none: it was changed, or made "
                "by an earlier version; generate it again"
            )

        @lru_cache(maxsize=_KEPT)
        def frame(view: int) -> UInt8[np.ndarray, "h w 3"]:
            camera = scene.cameras[view]
            return frame_of(kept[view], (camera.width_px, camera.height_px))

        return cls(scene, evidence, frame, np.array([view for view, data in enumerate(kept) if data]))

    @classmethod
    def fitted(cls, scene: Scene, frames: UInt8[np.ndarray, "f h w 3"]) -> "Recordings":
        """Those of a scene that was just fitted, with the frames of its clip; withheld ones are not used."""
        assert scene.residual is not None
        evidence = evidence_of(scene, np.square(scene.residual.astype(np.float32)))
        return cls(scene, evidence, lambda view: frames[view], np.flatnonzero(~scene.held_out))

    def nearest(self, camera: Camera, t_s: float, besides: int | None = None) -> list[int]:
        """The recorded views that are nearest in place, direction and time; less one of them, if told."""
        poses = np.stack([self.scene.cameras[view].world_from_camera for view in self.views])
        away_m = np.linalg.norm(poses[:, :3, 3] - camera.world_from_camera[:3, 3], axis=1)
        turned = np.arccos(np.clip(poses[:, :3, 2] @ camera.world_from_camera[:3, 2], -1, 1))
        later_s = np.abs(self.scene.times_s[self.views] - t_s)
        worth = away_m + _TURNED_M * turned + _LATER_M_S * later_s
        order = self.views[np.argsort(worth, kind="stable")]
        return [int(view) for view in order if view != besides][:FRAMES]

    @one_torch_thread()
    @torch.no_grad()
    def told(
        self, camera: Camera, t_s: float, besides: int | None = None
    ) -> tuple[SceneView, Float[np.ndarray, "16 h w"]]:
        """A view as it is, and what the restorer is told of it, float32 (see ``network.CHANNELS``)."""
        moment, rows = moment_of(self.scene, t_s), rows_at(self.scene, t_s)
        views = self.nearest(camera, t_s, besides)
        evidence = torch.stack(self.evidence.error_and_unseen(rows), dim=1)
        # What stands or is seen at the same time is not elsewhere: most views need no shifts.
        elsewhere = [view for view in views if self.scene.times_s[view] != t_s and self.scene.moves_per_frame]
        shifts = [self._shifts_m(moment[0].means, t_s, view) for view in elsewhere]
        seen = render_scene(
            self.scene, camera, t_s, channels=torch.cat([evidence, *shifts], dim=1), moment=moment
        )
        channels = (seen.channels / seen.alpha.clamp(min=1e-3)[..., None]).numpy()
        maps = np.zeros((CHANNELS, camera.height_px, camera.width_px), np.float32)
        maps[:OF_VIEW] = _of_view(seen, channels)
        for number, view in enumerate(views):
            shift_m = None
            if view in elsewhere:
                first = 2 + 3 * elsewhere.index(view)
                shift_m = channels[..., first : first + 3]
            first = OF_VIEW + number * OF_FRAME
            maps[first : first + OF_FRAME] = self._carried(view, camera, seen.seen_depth_m, shift_m)
            if self.scene.times_s[view] != t_s:
                # What moves is elsewhere, and no track is so precise that it would be found there as sharp.
                maps[first + 3] *= 1 - maps[MOVES].clip(0, 1)
        return seen, maps

    def _shifts_m(self, means: Float[Tensor, "m 3"], t_s: float, view: int) -> Float[Tensor, "m 3"]:
        """How far a per-frame street at a time is from where it is at the time of a recorded view."""
        there = self.scene.static_at(float(self.scene.times_s[view])).means
        return torch.cat([there - means[: len(there)], torch.zeros_like(means[len(there) :])])

    def _carried(
        self,
        view: int,
        camera: Camera,
        depth_m: Float[np.ndarray, "h w"],
        shift_m: Float[np.ndarray, "h w 3"] | None,
    ) -> Float[np.ndarray, "4 h w"]:
        """A recorded frame where it shows the same surface, and how surely it does, 0 to 1."""
        there, solid = self.scene.cameras[view], depth_m > 0
        # Single precision, but for the place: two cameras may be far from where the world begins.
        pose = there.camera_from_world @ camera.world_from_camera
        rays, from_m = (camera.rays() @ pose[:3, :3].T).astype(np.float32), pose[:3, 3].astype(np.float32)
        local = np.where(solid, depth_m, np.float32(_FAR_M))[..., None] * rays + from_m
        if shift_m is not None:
            local += shift_m @ there.camera_from_world[:3, :3].T.astype(np.float32)
        z_m = local[..., 2]
        ahead_m = np.maximum(z_m, np.float32(NEAR_M))
        u = local[..., 0] / ahead_m * np.float32(there.fx_px) + np.float32(there.cx_px)
        v = local[..., 1] / ahead_m * np.float32(there.fy_px) + np.float32(there.cy_px)
        inside = (z_m > NEAR_M) & (u >= 0) & (u < there.width_px) & (v >= 0) & (v < there.height_px)
        inverse = self._inverse_depth(view)
        sy, sx = (
            np.float32(a / b) for a, b in zip(inverse.shape, (there.height_px, there.width_px), strict=True)
        )
        known = cv2.remap(
            inverse, u * sx - 0.5, v * sy - 0.5, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        off = np.where(solid, np.abs(ahead_m * known - 1), np.float32(_NEAR_M) * known)
        sure = inside * np.exp(off * np.float32(-1 / _SAME))
        rgb = cv2.remap(self.frame(view), u - 0.5, v - 0.5, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        carried = np.empty((OF_FRAME, *sure.shape), np.float32)
        carried[:3] = rgb.transpose(2, 0, 1)
        carried[:3] *= inside * np.float32(1 / 255)
        carried[3] = sure
        return carried

    def _inverse_depth(self, view: int) -> Float[np.ndarray, "h2 w2"]:
        """Of a recorded view in 1/m, at half its size; 0 where nothing stands."""
        if view not in self._inverse:
            camera = self.scene.cameras[view]
            half = camera.resized(max(1, camera.width_px // 2), max(1, camera.height_px // 2))
            seen = render_scene(self.scene, half, float(self.scene.times_s[view]), exposure=False)
            depth_m = seen.seen_depth_m
            self._inverse[view] = np.where(depth_m > 0, 1 / np.maximum(depth_m, NEAR_M), 0).astype(np.float32)
        return self._inverse[view]


def _of_view(seen: SceneView, channels: Float[np.ndarray, "h w _"]) -> Float[np.ndarray, "8 h w"]:
    """What the restorer is told of the view itself; the channels begin with error and what was unseen."""
    depth_m = seen.seen_depth_m
    inverse = np.where(depth_m > 0, _NEAR_M / np.maximum(depth_m, _NEAR_M), 0)
    moves = (seen.dynamic_share / seen.alpha.clamp(min=1e-3)).numpy()
    error = np.minimum(_ERROR * channels[..., 0], 1)
    rest = [seen.alpha.numpy(), inverse, moves, error, channels[..., 1]]
    return np.concatenate([seen.colour.permute(2, 0, 1).numpy(), np.stack(rest)]).astype(np.float32)
