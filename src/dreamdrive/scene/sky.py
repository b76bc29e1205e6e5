"""The sky: a far panorama that only the direction of a ray selects from."""

import math
from dataclasses import dataclass, replace

import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive.scene.camera import Camera


@dataclass(frozen=True)
class Sky:
    """A background at infinity, RGB in [0, 1], stored by azimuth and elevation in the world frame.

    Azimuth is ``atan2(x, z)`` (0 forward, positive to the right), elevation ``atan2(-y, hypot(x, z))``
    (positive up), both in radians. Row 0 is the highest elevation, column 0 the smallest azimuth; texels are
    areas, so the ranges are those of their outer borders.
    """

    texture: Float[Tensor, "hs ws 3"]
    azimuth_rad: tuple[float, float]
    elevation_rad: tuple[float, float]

    def __post_init__(self) -> None:
        for name in ("azimuth_rad", "elevation_rad"):
            low, high = getattr(self, name)
            if not high > low:
                raise ValueError(f"sky: {name} must grow, got {low}..{high}")

    def on(self, device: torch.device) -> "Sky":
        """The same with its texture on a device."""
        return replace(self, texture=self.texture.to(device))

    def grid(self, camera: Camera) -> Float[Tensor, "h w 2"]:
        """Where each pixel of a camera looks in the texture, in [-1, 1]; serves many textures."""
        dtype, device = self.texture.dtype, self.texture.device
        rotation = torch.tensor(camera.world_from_camera[:3, :3], dtype=dtype, device=device)
        columns = torch.arange(camera.width_px, dtype=dtype, device=device)
        rows = torch.arange(camera.height_px, dtype=dtype, device=device)
        x, y = (columns + 0.5 - camera.cx_px) / camera.fx_px, (rows + 0.5 - camera.cy_px) / camera.fy_px
        across, down, ahead = (
            row[0] * x[None, :] + row[1] * y[:, None] + row[2] for row in rotation.unbind(0)
        )
        middle = 0.5 * sum(self.azimuth_rad)
        # Relative to the middle, so that the jump of the angle lies opposite to what is covered.
        azimuth = torch.atan2(across, ahead) - middle
        azimuth = torch.remainder(azimuth + math.pi, 2 * math.pi) - math.pi
        elevation = torch.atan2(-down, torch.hypot(across, ahead)) - 0.5 * sum(self.elevation_rad)
        half_width = 0.5 * (self.azimuth_rad[1] - self.azimuth_rad[0])
        half_height = 0.5 * (self.elevation_rad[1] - self.elevation_rad[0])
        return torch.stack([azimuth / half_width, -elevation / half_height], dim=-1)

    def sample(self, grid: Float[Tensor, "h w 2"]) -> Float[Tensor, "h w 3"]:
        """Bilinear colours at the result of ``grid``, edges continued; differentiable in the texture."""
        image = self.texture.permute(2, 0, 1)[None]
        sampled = torch.nn.functional.grid_sample(
            image, grid[None], mode="bilinear", padding_mode="border", align_corners=False
        )
        return sampled[0].permute(1, 2, 0)

    def colour(self, camera: Camera) -> Float[Tensor, "h w 3"]:
        """What a camera sees of the sky alone (H, W, 3)."""
        return self.sample(self.grid(camera))
