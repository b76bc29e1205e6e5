"""Colour of the recording camera: one affine transform a frame."""

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor


@dataclass(frozen=True)
class Exposure:
    """Affine colour transforms [A | b] (F, 3, 4) of the frames they were trained on.

    Times strictly increase for each camera of the rig; ``camera`` is None where there is one only.
    """

    transforms: Float[Tensor, "f 3 4"]
    times_s: Float[np.ndarray, " f"]
    camera: Int[np.ndarray, " f"] | None = None

    def __post_init__(self) -> None:
        cameras = [0] if self.camera is None else np.unique(self.camera).tolist()
        times = [self.of(camera)[1] for camera in cameras]
        if len(self.times_s) == 0 or any((np.diff(each) <= 0).any() for each in times):
            raise ValueError("exposure: expected at least one frame and strictly increasing times")

    def on(self, device: torch.device) -> "Exposure":
        """The same with its transforms on a device."""
        return replace(self, transforms=self.transforms.to(device))

    def at(self, t_s: float, camera: int = 0) -> Float[Tensor, "3 4"]:
        """The transform at a time: linear between the neighbouring trained frames, constant outside."""
        transforms, times_s = self.of(camera)
        after = int(np.searchsorted(times_s, t_s, side="right"))
        if after == 0 or after == len(times_s):
            return transforms[min(after, len(times_s) - 1)]
        before = after - 1
        weight = (t_s - times_s[before]) / (times_s[after] - times_s[before])
        return torch.lerp(transforms[before], transforms[after], float(weight))

    def apply(self, image: Float[Tensor, "h w 3"], t_s: float, camera: int = 0) -> Float[Tensor, "h w 3"]:
        """An image of the scene as a camera of the rig would have recorded it at ``t_s``; not clipped."""
        return transform_colour(image, self.at(t_s, camera))

    def of(self, camera: int) -> tuple[Float[Tensor, "k 3 4"], Float[np.ndarray, " k"]]:
        """The transforms of a camera of the rig, and their times."""
        if self.camera is None:
            return self.transforms, self.times_s
        own = np.flatnonzero(self.camera == camera)
        return self.transforms[torch.from_numpy(own).to(self.transforms.device)], self.times_s[own]


def transform_colour(image: Float[Tensor, "h w 3"], affine: Float[Tensor, "3 4"]) -> Float[Tensor, "h w 3"]:
    """``A rgb + b`` for every pixel, with ``affine`` = [A | b]."""
    return image @ affine[:, :3].T + affine[:, 3]
