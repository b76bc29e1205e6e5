"""The small network that mends a drawn view: it fills holes, sharpens what is stretched, keeps the look."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from jaxtyping import Float, UInt8
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.models import HalfUNet, fill_network, read_state
from dreamdrive.names import FILL_INPAINT, FILL_NETWORK
from dreamdrive.prior.photo.sight import Sight, places_in
from dreamdrive.scene.camera import Camera

CHANNELS = 11
"""RGB of the view, alpha, made up, nearer, inverse depth; RGB of the frame before, and where it is known."""
WIDTHS = (40, 80, 144, 208)
_NEAR_M = 2.0
_FILE = Path(__file__).with_name("photo.safetensors")
EXPECTED = "weights of the network of the prior photo, as `dreamdrive train photo` writes them"


class PhotoNetwork(HalfUNet):
    """Its answer is what to add to the view's colours.

    Its last features, before the answer, are Z_ref.
    """

    def __init__(self, widths: tuple[int, ...] = WIDTHS) -> None:
        super().__init__(CHANNELS, 3, widths)

    def forward(
        self, seen: Float[Tensor, "n 11 h w"]
    ) -> tuple[Float[Tensor, "n 3 h w"], Float[Tensor, "n c h2 w2"]]:
        """The mended view, RGB about [0, 1], and its features; sides are multiples of 2."""
        more, features = self.answered(seen)
        return seen[:, :3] + more, features


@dataclass(frozen=True)
class Before:
    """The frame before, its holes filled by a library, and its camera.

    Not as it was mended: what a network makes of its own answers drifts from frame to frame.
    """

    rgb: UInt8[np.ndarray, "h w 3"]
    camera: Camera


def told(sight: Sight, camera: Camera, before: Before | None) -> Float[np.ndarray, "11 h w"]:
    """What the network is told of a view, its holes filled, and of the frame before it, float32."""
    shape = sight.alpha.shape
    carried = np.zeros((*shape, 4), np.float32) if before is None else _carried(sight, camera, before)
    inverse = np.where(sight.depth_m > 0, _NEAR_M / np.maximum(sight.depth_m, _NEAR_M), 0)
    maps = [sight.alpha, sight.made_up, np.clip(sight.nearer, -1, 3), inverse]
    rgb = sight.filled.astype(np.float32) / 255
    return np.concatenate([rgb.transpose(2, 0, 1), np.stack(maps), carried.transpose(2, 0, 1)]).astype(
        np.float32
    )


def _carried(sight: Sight, camera: Camera, before: Before) -> Float[np.ndarray, "h w 4"]:
    """The frame before where it shows the same surface, and 1 there; 0 elsewhere."""
    at = places_in(before.camera, camera, sight.depth_m)
    shown = before.camera.shows(at.reshape(-1, 3)).reshape(sight.depth_m.shape)
    rgb = cv2.remap(
        before.rgb, at[..., 0] - 0.5, at[..., 1] - 0.5, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    known = (shown & (sight.depth_m > 0)).astype(np.float32)[..., None]
    return np.concatenate([known * rgb / 255, known], axis=2).astype(np.float32)


def load_photo_network(given: str | Path = FILL_NETWORK) -> PhotoNetwork:
    """The network with the weights that ship, or with those that ``dreamdrive train photo`` wrote to a file.

    Raises:
        InputError: There is no such file, or it is of something else.
    """
    path = _FILE if given == FILL_NETWORK else Path(given)
    if not path.is_file():
        names = f"{FILL_NETWORK}, {FILL_INPAINT} or {EXPECTED}"
        raise InputError(f"--fill {given}: there is no such file; expected {names}")
    return fill_network(PhotoNetwork, read_state(path, EXPECTED), str(path), EXPECTED)


@torch.inference_mode()
def mended(
    network: PhotoNetwork, sight: Sight, camera: Camera, before: Before | None
) -> tuple[UInt8[np.ndarray, "h w 3"], Float[np.ndarray, "h2 w2 c"]]:
    """The view with what the photo does not show as the network mends it, and the network's features."""
    seen = told(sight, camera, before)
    rgb, features = network(torch.from_numpy(seen)[None])
    made_up = np.clip(2 * np.maximum(sight.made_up, sight.holes), 0, 1).astype(np.float32)[..., None]
    mixed = made_up * rgb[0].permute(1, 2, 0).numpy() + (1 - made_up) * seen[:3].transpose(1, 2, 0)
    picture = np.rint(np.clip(mixed, 0, 1) * 255).astype(np.uint8)
    return picture, features[0].permute(1, 2, 0).numpy()
