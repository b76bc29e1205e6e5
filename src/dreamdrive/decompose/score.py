"""F_score: a dynamic score for every Gaussian, trained through the splat (eq. 7-9)."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor, nn

from dreamdrive.compute.device import CPU
from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.decompose.errors import smoothed
from dreamdrive.motion import encode
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.splat import render

TargetName = Literal["error", "error_and_evidence"]


@dataclass(frozen=True)
class ScoreOptions:
    """Constants of the scoring; what they are worth: docs/results/ablation.md.

    Attributes:
        target: The paper's error map (eq. 8), ``"error"``, or the recorded clip's moving evidence with it.
        error_scale: Error that counts as 1: absolute, so that where nothing moves nothing scores.
        error_sigma_px: Blur of the error maps.
        steps: Training steps, one frame each.
        rate: Adam's step.
        width: Units of the two hidden layers.
        position_frequencies: Octaves of the encoding of the position.
        shrink: The splat of the scores is compared at this fraction of the size.
        window: Training frames around its source in which a score counts: elsewhere the road is empty.
        balance: Least share of the weight for what moves: a walker is a thousandth of a frame.
        most_weight: Most weight of a pixel that moves, by balance.
    """

    target: TargetName = "error_and_evidence"
    error_scale: float = 0.2
    error_sigma_px: float = 2.0
    steps: int = 75
    rate: float = 1e-2
    width: int = 64
    position_frequencies: int = 4
    shrink: int = 2
    window: int | None = 1
    balance: float | None = 0.4
    most_weight: float = 10.0


class ScoreNetwork(nn.Module):
    """S = F_score(G_init, Z_ref): an MLP on position and pixel-aligned features (eq. 7)."""

    def __init__(self, features: int, options: ScoreOptions, seed: int) -> None:
        super().__init__()
        inputs = 3 * (1 + 2 * options.position_frequencies) + features
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            self.layers = nn.Sequential(
                nn.Linear(inputs, options.width),
                nn.ReLU(),
                nn.Linear(options.width, options.width),
                nn.ReLU(),
                nn.Linear(options.width, 1),
            )

    def forward(self, inputs: Float[Tensor, "n d"]) -> Float[Tensor, " n"]:
        """Scores in (0, 1)."""
        return torch.sigmoid(self.layers(inputs).squeeze(1))


@one_torch_thread()
def score(
    clip: Clip,
    geometry: Geometry,
    gaussians: Gaussians,
    errors: Float[np.ndarray, "f h w"],
    options: ScoreOptions,
    seed: int,
    progress: Callable[[int, int], None],
    device: torch.device = CPU,
) -> Float[Tensor, " n"]:
    """Train F_score by binary cross-entropy between its splatted scores and the targets (eq. 8).

    The Gaussians are the seeds G_init, with features, the errors those of the static fit (eq. 6). Scores are
    in (0, 1); eq. 9 compares them with an absolute threshold, ``GroupOptions.threshold``. ``progress`` is
    called with steps done and steps in all. It is computed on ``device``; the scores are on the CPU.
    """
    if gaussians.features is None:
        raise ValueError("score: the Gaussians carry no features")
    inputs = _inputs(gaussians, options.position_frequencies).to(device)
    targets = {
        frame: (target.to(device), weight.to(device))
        for frame, (target, weight) in _targets(clip, geometry, errors, options).items()
    }
    bare = gaussians.without_features().to(device)
    shown = dict.fromkeys(targets, (bare, inputs))
    if options.window is not None:
        windows = {frame: _in_window(gaussians, clip, frame, options.window) for frame in targets}
        shown = {
            frame: (bare.select(rows), inputs[rows])
            for frame, rows in ((frame, rows.to(device)) for frame, rows in windows.items())
        }
    network = ScoreNetwork(gaussians.features.shape[1], options, seed).to(device)
    optimiser = torch.optim.Adam(network.parameters(), lr=options.rate)
    generator = torch.Generator().manual_seed(seed)
    order: list[int] = []
    for step in range(options.steps):
        if not order:
            choice = torch.randperm(len(targets), generator=generator)
            order = [sorted(targets)[int(i)] for i in choice]
        frame = order.pop()
        camera = geometry.cameras[frame]
        small = camera.resized(camera.width_px // options.shrink, camera.height_px // options.shrink)
        near, of_near = shown[frame]
        splatted, alpha = _splat(near, network(of_near), small)
        target, weight = targets[frame]
        loss = nn.functional.binary_cross_entropy(splatted, target, weight=weight * alpha)
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        optimiser.step()
        progress(step + 1, options.steps)
    with torch.no_grad():
        return network(inputs).cpu()


def _splat(
    gaussians: Gaussians, scores: Float[Tensor, " n"], camera: Camera
) -> tuple[Float[Tensor, "h w"], Float[Tensor, "h w"]]:
    """Mean score of what covers each pixel, and how much of the pixel is covered."""
    rendered = render(gaussians, camera, channels=scores[:, None], sh_degree=0)
    alpha = rendered.alpha.detach()
    mean = rendered.channels[..., 0] / alpha.clamp(min=1e-3)
    return mean.clamp(1e-4, 1 - 1e-4), alpha


def _in_window(gaussians: Gaussians, clip: Clip, frame: int, window: int) -> Int[Tensor, " m"]:
    """Gaussians whose source is within ``window`` training frames of ``frame``, each in its own camera."""
    rank = np.zeros(len(clip), dtype=np.int64)
    for camera in np.unique(clip.camera).tolist():
        seen = clip.seen_of(camera)
        rank[seen] = np.arange(len(seen))
    source = torch.from_numpy(rank)[gaussians.source_frame]
    return torch.nonzero((source - int(rank[frame])).abs() <= window).squeeze(1)


def _inputs(gaussians: Gaussians, frequencies: int) -> Float[Tensor, "n d"]:
    """Encoded positions, in units of their spread, and features of zero mean and unit variance."""
    assert gaussians.features is not None
    # Distance matters by ratio on a street, so positions are compressed before they are encoded.
    middle = gaussians.means.median(dim=0).values
    squeezed = torch.asinh((gaussians.means - middle) / 10.0)
    features = gaussians.features
    features = (features - features.mean(0)) / features.std(0).clamp(min=1e-3)
    return torch.cat([encode(squeezed, frequencies), features.clamp(-4, 4)], dim=1)


def _targets(
    clip: Clip, geometry: Geometry, errors: Float[np.ndarray, "f h w"], options: ScoreOptions
) -> dict[int, tuple[Float[Tensor, "a b"], Float[Tensor, "a b"]]]:
    """What each frame's splatted scores should be, and the weight of each pixel."""
    blurred = smoothed(errors, options.error_sigma_px)
    targets: dict[int, tuple[Tensor, Tensor]] = {}
    for i in np.flatnonzero(~clip.held_out).tolist():
        target = np.clip(blurred[i] / options.error_scale, 0, 1)
        if options.target == "error_and_evidence":
            target = np.maximum(target, geometry.moving[i])
        weight = (clip.valid[i] & (geometry.fixed_regions[clip.camera[i]] == 0)).astype(np.float32)
        targets[i] = (_shrunk(target, options.shrink), _shrunk(weight, options.shrink))
    if options.balance is None:
        return targets
    more = _weight_of_moving(targets.values(), options.balance, options.most_weight)
    return {i: (target, weight * (1 + (more - 1) * target)) for i, (target, weight) in targets.items()}


def _weight_of_moving(
    targets: Iterable[tuple[Float[Tensor, "a b"], Float[Tensor, "a b"]]], balance: float, most: float
) -> float:
    """How many times a moving pixel counts, at least once."""
    pairs = list(targets)
    moving = sum(float((target * weight).sum()) for target, weight in pairs)
    share = moving / max(sum(float(weight.sum()) for _, weight in pairs), 1e-9)
    return min(max(balance / max(share, 1e-9), 1.0), most)


def _shrunk(values: Float[np.ndarray, "h w"], factor: int) -> Float[Tensor, "a b"]:
    h, w = values.shape[0] // factor, values.shape[1] // factor
    blocks = values[: h * factor, : w * factor].reshape(h, factor, w, factor).mean(axis=(1, 3))
    return torch.tensor(blocks, dtype=torch.float32).clamp(0, 1)
