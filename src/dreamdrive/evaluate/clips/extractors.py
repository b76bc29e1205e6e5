"""Figures that can be computed with the weights at hand, and the features of each."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, UInt8
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.evaluate.networks import (
    MissingWeightsError,
    efficientnet_lite,
    i3d,
    inception,
    lpips,
    stlpips,
    transnet,
)
from dreamdrive.models import sha256
from dreamdrive.names import Resize, Stlpips
from dreamdrive.vision.pixels import psnr, ssim

Frames = UInt8[Tensor, "t h w 3"]


@dataclass(frozen=True)
class WeightFiles:
    """Files of weights that the user has, see ``FILE`` of each network; figures without theirs are left out.

    Without TransNetV2's that of the installed package is taken.
    """

    inception: Path | None = None
    i3d: Path | None = None
    lpips_trunk: Path | None = None
    lpips_heads: Path | None = None
    transnet: Path | None = None


@dataclass(frozen=True)
class Extractor:
    """A network whose features two sets are compared by, and the names of their two distances.

    From frames come features (t, d), or one vector (1, d) where they describe a ``window`` of frames.
    """

    frechet: str
    kernel: str
    window: bool
    features: Callable[[Frames], Float[np.ndarray, "_ _"]]


@dataclass(frozen=True)
class Toolbox:
    """What can be computed: distances of sets, and what compares each frame with the real one it belongs to.

    Figures that are ``missing`` have a reason; ``weights`` are file and sha256 behind those with a network.
    """

    extractors: list[Extractor] = field(default_factory=list)
    likenesses: dict[str, Callable[[Frames, Frames], Float[np.ndarray, " t"]]] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)
    weights: dict[str, dict[str, str]] = field(default_factory=dict)

    def note(self, figure: str, path: Path) -> None:
        """Keep which file is behind a figure."""
        self.weights[figure] = {"file": path.name, "sha256": sha256(path)}

    def add(self, extractor: Extractor, path: Path) -> None:
        """Offer a network with the weights of a file."""
        self.note(extractor.frechet, path)
        self.extractors.append(extractor)


def open_toolbox(
    files: WeightFiles, *, resize: Resize = "tf1", windows: bool = True, stlpips_kind: Stlpips = "alex"
) -> Toolbox:
    """Load every network whose weights are there; those of video only if windows are wanted."""
    box = Toolbox()
    box.likenesses["psnr"] = lambda a, b: np.array([psnr(*pair) for pair in _scaled(a, b)])
    box.likenesses["ssim"] = lambda a, b: np.array([ssim(*pair) for pair in _scaled(a, b)])
    wanted: dict[str, Callable[[], None]] = {
        "fid, kid": lambda: _add_inception(box, files.inception, resize),
        "frechet_efficientnet_lite0": lambda: _add_efficientnet(box),
        "fvd, kvd": lambda: _add_i3d(box, files.i3d),
        "frechet_transnetv2": lambda: _add_transnet(box, files.transnet),
        "lpips": lambda: _add_lpips(box, files.lpips_trunk, files.lpips_heads),
    }
    if not windows:
        del wanted["fvd, kvd"], wanted["frechet_transnetv2"]
        box.missing["fvd, kvd, frechet_transnetv2"] = "figures of video are left out (--window 0)"
    for kind in ("alex", "vgg"):
        if stlpips_kind in (kind, "both"):
            wanted[f"stlpips_{kind}"] = partial(_add_stlpips, box, kind)
        else:
            box.missing[f"stlpips_{kind}"] = "left out unless asked for: --stlpips both"
    for figures, add in wanted.items():
        try:
            add()
        except MissingWeightsError as error:
            box.missing[figures] = str(error)
    return box


def _add_inception(box: Toolbox, path: Path | None, resize: Resize) -> None:
    if path is None:
        raise MissingWeightsError(f"no weights: --inception FILE, {inception.FILE}")
    network = inception.load_inception(path)
    box.add(
        Extractor("fid", "kid", False, lambda f: inception.inception_features(network, f, resize).numpy()),
        path,
    )


def _add_i3d(box: Toolbox, path: Path | None) -> None:
    if path is None:
        raise MissingWeightsError(f"no weights: --i3d FILE, {i3d.FILE}")
    network = i3d.load_i3d(path)
    box.add(Extractor("fvd", "kvd", True, lambda f: i3d.i3d_features(network, f).numpy()[None]), path)


def _add_efficientnet(box: Toolbox) -> None:
    name, network = "efficientnet_lite0", efficientnet_lite.load_efficientnet_lite0()
    features = efficientnet_lite.efficientnet_lite0_features
    box.add(
        Extractor(f"frechet_{name}", f"kernel_{name}", False, lambda f: features(network, f).numpy()),
        efficientnet_lite.FILE.locate(),
    )


def _add_transnet(box: Toolbox, path: Path | None) -> None:
    try:
        network = transnet.load_transnet(path)
    except MissingWeightsError as error:
        raise MissingWeightsError(f"{error}; or --transnet FILE") from None
    name, features = "transnetv2", transnet.transnet_features
    box.add(
        Extractor(f"frechet_{name}", f"kernel_{name}", True, lambda f: features(network, f).numpy()[None]),
        path or transnet.FILE.locate(),
    )


def _add_lpips(box: Toolbox, trunk: Path | None, heads: Path | None) -> None:
    if trunk is None or heads is None:
        if trunk or heads:
            raise InputError("LPIPS needs both files: give --lpips-trunk and --lpips-heads")
        raise MissingWeightsError("no weights: --lpips-trunk FILE --lpips-heads FILE")
    distance = lpips.load_lpips(trunk, heads)
    name = f"lpips_{distance.kind}"
    box.note(name, trunk)
    box.note(f"{name}_heads", heads)
    box.likenesses[name] = lambda a, b: distance(_planes(a) * 2 - 1, _planes(b) * 2 - 1).numpy()
    # 3DGS and its relatives hand in [0, 1]; their tables can only be compared with this one.
    box.likenesses[f"{name}_3dgs"] = lambda a, b: distance(_planes(a), _planes(b)).numpy()


def _add_stlpips(box: Toolbox, kind: str) -> None:
    distance = stlpips.load_stlpips(kind)
    box.note(f"stlpips_{kind}", stlpips.FILES[kind].locate())
    box.likenesses[f"stlpips_{kind}"] = lambda a, b: distance(_planes(a) * 2 - 1, _planes(b) * 2 - 1).numpy()


def _scaled(a: Frames, b: Frames) -> list[tuple[Tensor, Tensor]]:
    return [(x.float() / 255, y.float() / 255) for x, y in zip(a, b, strict=True)]


def _planes(frames: Frames) -> Float[Tensor, "t 3 h w"]:
    return frames.permute(0, 3, 1, 2).to(torch.float32) / 255
