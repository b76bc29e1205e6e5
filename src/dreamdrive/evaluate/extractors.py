"""Which figures can be computed with the weights at hand, and what each is made of."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, UInt8
from torch import Tensor

from dreamdrive.choices import Resize, Stlpips
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
from dreamdrive.evaluate.pixels import psnr, ssim
from dreamdrive.models import sha256

Frames = UInt8[Tensor, "t h w 3"]


@dataclass(frozen=True)
class WeightFiles:
    """Files of weights that the user has; figures without theirs are left out.

    Attributes:
        inception: Inception-v3 of FID (``inception.FILE``).
        i3d: I3D of FVD (``i3d.FILE``).
        lpips_trunk: VGG16 or AlexNet (``lpips.TRUNK_FILE``).
        lpips_heads: The heads of LPIPS that belong to it (``lpips.HEADS_FILE``).
        transnet: TransNetV2; without it that of the installed package.
    """

    inception: Path | None = None
    i3d: Path | None = None
    lpips_trunk: Path | None = None
    lpips_heads: Path | None = None
    transnet: Path | None = None


@dataclass(frozen=True)
class Extractor:
    """A network whose features two sets are compared by.

    Attributes:
        frechet: Name of the Fréchet distance of its features.
        kernel: Name of their kernel distance.
        window: Whether a feature vector describes a window of frames, not a frame.
        features: From frames (t, h, w, 3) to (t, d), or to one vector (1, d) of a window.
    """

    frechet: str
    kernel: str
    window: bool
    features: Callable[[Frames], Float[np.ndarray, "_ _"]]


@dataclass(frozen=True)
class Toolbox:
    """What can be computed.

    Attributes:
        extractors: Networks for distances of sets.
        likenesses: By name, what compares each frame with the real one it belongs to: from both clips to a
            value a frame.
        missing: Figures that cannot be computed, and why.
        weights: File and sha256 behind each figure with a network.
    """

    extractors: list[Extractor] = field(default_factory=list)
    likenesses: dict[str, Callable[[Frames, Frames], Float[np.ndarray, " t"]]] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)
    weights: dict[str, dict[str, str]] = field(default_factory=dict)


def open_toolbox(
    files: WeightFiles, *, resize: Resize = "tf1", windows: bool = True, stlpips_kind: Stlpips = "alex"
) -> Toolbox:
    """Load every network whose weights are there.

    Args:
        files: Weights that the user has.
        resize: How images are brought to the size of Inception.
        windows: Whether figures of video are wanted.
        stlpips_kind: Which shift-tolerant LPIPS.

    Raises:
        InputError: A file that was given is not what it should be.
    """
    box = Toolbox()
    box.likenesses["psnr"] = lambda a, b: np.array([psnr(*pair) for pair in _scaled(a, b)])
    box.likenesses["ssim"] = lambda a, b: np.array([ssim(*pair) for pair in _scaled(a, b)])
    _add_inception(box, files.inception, resize)
    _add_efficientnet(box)
    if windows:
        _add_i3d(box, files.i3d)
        _add_transnet(box, files.transnet)
    else:
        box.missing["fvd, kvd, frechet_transnetv2"] = "figures of video are left out (--window 0)"
    _add_lpips(box, files.lpips_trunk, files.lpips_heads)
    for kind in ("alex", "vgg") if stlpips_kind == "both" else (stlpips_kind,):
        _add_stlpips(box, kind)
    for kind in {"alex", "vgg"} - {stlpips_kind} if stlpips_kind != "both" else ():
        box.missing[f"stlpips_{kind}"] = "left out unless asked for: --stlpips both"
    return box


def _add_inception(box: Toolbox, path: Path | None, resize: Resize) -> None:
    if path is None:
        box.missing["fid, kid"] = f"no weights: --inception FILE, {inception.FILE}"
        return
    network = inception.load_inception(path)
    _note(box, "fid", path)
    box.extractors.append(
        Extractor("fid", "kid", False, lambda f: inception.inception_features(network, f, resize).numpy())
    )


def _add_i3d(box: Toolbox, path: Path | None) -> None:
    if path is None:
        box.missing["fvd, kvd"] = f"no weights: --i3d FILE, {i3d.FILE}"
        return
    network = i3d.load_i3d(path)
    _note(box, "fvd", path)
    box.extractors.append(Extractor("fvd", "kvd", True, lambda f: i3d.i3d_features(network, f).numpy()[None]))


def _add_efficientnet(box: Toolbox) -> None:
    name = "efficientnet_lite0"
    try:
        network = efficientnet_lite.load_efficientnet_lite0()
    except MissingWeightsError as error:
        box.missing[f"frechet_{name}"] = str(error)
        return
    _note(box, f"frechet_{name}", efficientnet_lite.FILE.locate())
    box.extractors.append(
        Extractor(
            f"frechet_{name}",
            f"kernel_{name}",
            False,
            lambda f: efficientnet_lite.efficientnet_lite0_features(network, f).numpy(),
        )
    )


def _add_transnet(box: Toolbox, path: Path | None) -> None:
    try:
        network = transnet.load_transnet(path)
    except MissingWeightsError as error:
        box.missing["frechet_transnetv2"] = f"{error}; or --transnet FILE"
        return
    _note(box, "frechet_transnetv2", path or transnet.FILE.locate())
    box.extractors.append(
        Extractor(
            "frechet_transnetv2",
            "kernel_transnetv2",
            True,
            lambda f: transnet.transnet_features(network, f).numpy()[None],
        )
    )


def _add_lpips(box: Toolbox, trunk: Path | None, heads: Path | None) -> None:
    if trunk is None or heads is None:
        if trunk or heads:
            raise InputError("LPIPS needs both files: give --lpips-trunk and --lpips-heads")
        box.missing["lpips"] = "no weights: --lpips-trunk FILE --lpips-heads FILE"
        return
    distance = lpips.load_lpips(trunk, heads)
    name = f"lpips_{distance.kind}"
    _note(box, name, trunk)
    _note(box, f"{name}_heads", heads)
    box.likenesses[name] = lambda a, b: distance(_planes(a) * 2 - 1, _planes(b) * 2 - 1).numpy()
    # 3DGS and its relatives hand in [0, 1]; their tables can only be compared with this one.
    box.likenesses[f"{name}_3dgs"] = lambda a, b: distance(_planes(a), _planes(b)).numpy()


def _add_stlpips(box: Toolbox, kind: str) -> None:
    try:
        distance = stlpips.load_stlpips(kind)
    except MissingWeightsError as error:
        box.missing[f"stlpips_{kind}"] = str(error)
        return
    _note(box, f"stlpips_{kind}", stlpips.FILES[kind].locate())
    box.likenesses[f"stlpips_{kind}"] = lambda a, b: distance(_planes(a) * 2 - 1, _planes(b) * 2 - 1).numpy()


def _note(box: Toolbox, figure: str, path: Path) -> None:
    box.weights[figure] = {"file": path.name, "sha256": sha256(path)}


def _scaled(a: Frames, b: Frames) -> list[tuple[Tensor, Tensor]]:
    return [(x.float() / 255, y.float() / 255) for x, y in zip(a, b, strict=True)]


def _planes(frames: Frames) -> Float[Tensor, "t 3 h w"]:
    return frames.permute(0, 3, 1, 2).to(torch.float32) / 255
