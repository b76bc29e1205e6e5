"""Pi3 and Pi3X (Wang et al. 2025) from the package ``pi3``, which is not on PyPI.

Signatures, names and conventions of outputs are those of yyfz/Pi3 9fa3ddb. Neither gives a focal length: it
is fitted to the points of each frame. Pi3X takes known intrinsics and poses, and is metric, approximately.
"""

from functools import partial
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from dreamdrive.compute.device import chosen_device
from dreamdrive.errors import PIP
from dreamdrive.geometry.backends.dust3r.align import robust_px
from dreamdrive.geometry.backends.feedforward.load import build, read_stored, upstream
from dreamdrive.geometry.backends.feedforward.network import (
    METRE_SPREAD,
    FeedforwardResult,
    Network,
    Views,
    nearest_rigid,
)
from dreamdrive.geometry.backends.feedforward.reconstruct import FeedForward
from dreamdrive.geometry.protocol import GeometryBackend
from dreamdrive.scene.camera import Camera

EXPECTED = "model.safetensors of Pi3 or Pi3X or its folder, such as yyfz233/Pi3X"
INSTALL = f"git clone https://github.com/yyfz/Pi3 and put the clone on PYTHONPATH; {PIP} huggingface_hub"


def load_pi3(path: Path) -> Network:
    """Load Pi3, or Pi3X where the weights have its token for the metre."""
    stored = read_stored(path, EXPECTED)
    if "metric_token" in stored.state:
        model = upstream("pi3.models.pi3x", INSTALL)
        network = build(lambda: model.Pi3X(use_multimodal=True), stored, stored.state)
        predict = partial(_predict, network, True)
        return Network(predict, "the network Pi3X, metric approximately", 2 * METRE_SPREAD)
    model = upstream("pi3.models.pi3", INSTALL)
    sizes = {name: stored.config[name] for name in ("pos_type", "decoder_size") if name in stored.config}
    network = build(lambda: model.Pi3(**sizes), stored, stored.state)
    return Network(partial(_predict, network, False))


def _predict(network: nn.Module, conditioned: bool, views: Views) -> FeedforwardResult:
    pictures = views.pictures.to(chosen_device())[None]
    out = network(pictures, **_conditions(views)) if conditioned else network(pictures)
    known = views.camera if conditioned else None
    points = out["local_points"][0].cpu().numpy()
    # The logit itself would do for ranks; the focal length asks for odds above one.
    odds = (1 + out["conf"][0, ..., 0].double().exp()).cpu().numpy()
    return FeedforwardResult(
        world_from_camera=nearest_rigid(out["camera_poses"][0]),
        intrinsics=np.stack([_pinhole(*each, known) for each in zip(points, odds, strict=True)]),
        depth=points[..., 2],
        confidence=odds,
    )


def _conditions(views: Views) -> dict[str, Tensor]:
    """What is known, as Pi3X takes it: poses only along with intrinsics."""
    if views.camera is None:
        return {}
    count = len(views.pictures)
    matrices = torch.from_numpy(views.camera.matrix).float().expand(count, 3, 3)
    known = {"intrinsics": matrices[None].to(chosen_device())}
    if views.world_from_camera is not None:
        known["poses"] = torch.from_numpy(views.world_from_camera).float()[None].to(chosen_device())
    return known


def _pinhole(
    points: Float[np.ndarray, "h w 3"], odds: Float[np.ndarray, "h w"], told: Camera | None
) -> Float[np.ndarray, "3 3"]:
    """The pinhole that the points fit best.

    It has square pixels and the middle as its principal point, or those of the camera that the network was
    told of. The fit counts pixels from 0, where principal points are half a pixel less.
    """
    height, width = odds.shape
    cx, cy = (width / 2, height / 2) if told is None else (told.cx_px, told.cy_px)
    stretch = 1.0 if told is None else told.fx_px / told.fy_px
    focal_px = robust_px(points, odds, (cx - 0.5, cy - 0.5), stretch)
    return np.array([[focal_px, 0, cx], [0, focal_px / stretch, cy], [0, 0, 1]])


PI3 = GeometryBackend(
    name="pi3",
    reconstruct=FeedForward("pi3", load_pi3, long_side_px=504),
    about="cameras and depth of 24 frames at a time (Pi3, or Pi3X, which takes known cameras and is metric)",
    licence=(
        "code BSD 3-Clause, a file of it (pos_embed.py) CC BY-NC-SA 4.0; weights CC BY-NC 4.0: "
        "not for commercial use"
    ),
    memory="weights of 4 to 6 GB, and several GB for 24 frames; in float32, on a GPU if torch has one",
    weights=EXPECTED,
    package="pi3",
    install=INSTALL,
)
