"""The gate that accepts or refuses a sparse reconstruction of a drive."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.geometry.cameras.sfm import SparseModel
from dreamdrive.geometry.options import GateOptions

STRETCH = 3
"""Steps over which the direction of a path that wobbles is judged."""


@dataclass(frozen=True)
class GateVerdict:
    """Outcome of the gate."""

    reasons: tuple[str, ...]  # why the model is refused, in words; empty when it is accepted
    figures: dict[str, Any]  # what was measured, as JSON values
    backwards: bool  # the camera consistently drives backwards
    few: str | None = None  # what there is too little of to be sure; no reason to refuse what predicts frames
    aside_deg: float = 0.0  # how far the camera looks away from where it goes
    wobbling: bool = False  # the frames are not quite pictures of one street, as generated ones are not


def judge(
    model: SparseModel,
    moving: Bool[np.ndarray, " s"],
    options: GateOptions = GateOptions(),
    *,
    little: bool = False,
) -> GateVerdict:
    """Test registration, support, fit and the plausibility of the steps.

    Only steps (F - 1,) in which the picture moves are held to one direction, as the camera sees it, and to a
    steady length, a steady gain or loss of speed aside: from a standstill the direction of a step is noise
    and its length is far below the mean. The direction is the usual one of the drive, since a camera may look
    aside. Where the frames wobble, their poses do: the direction is then that of stretches of three steps.

    Few points are no reason to refuse: of recorded drives whose models had 200 to 500 points most were right.
    ``few`` says where they are too few to be sure without a look at more of them. Frames that show little of
    the street need fewer, but each of them some: on a drawn queue 425 points, 10 in the poorest frame, were
    1.2 % off.
    """
    registered = model.registered
    share = float(registered.mean())
    if not registered.any():
        return GateVerdict(("structure from motion placed no frame",), {"registered_share": 0.0}, False)
    seen = model.seen[registered].sum(axis=1)
    wobbling = model.reprojection_px > options.wobbling_px
    ways, length = _steps(model.world_from_camera)
    judged = moving & np.isfinite(length)
    usual = _usual(ways[judged])
    least = _least_along(model.world_from_camera, moving, STRETCH if wobbling else 1, usual)
    aside_deg = float(np.degrees(np.arccos(min(1.0, abs(usual[2])))))
    variation = _variation(length[judged])
    figures = {
        "registered_share": share,
        "points": len(model.points),
        "least_points_seen": int(seen.min()),
        "reprojection_px": model.reprojection_px,
        "least_forward_cosine": least,
        "aside_deg": aside_deg,
        "step_variation": variation,
        "moving_steps": int(judged.sum()),
    }
    reasons: list[str] = []
    if share < options.registered:
        reasons.append(f"only {registered.sum()} of {len(registered)} frames could be placed")
    support = f"only {len(model.points)} points, {seen.min()} in the poorest frame"
    if len(model.points) < options.least_points or seen.min() < options.least_seen:
        reasons.append(support)
    part = options.little if little else 1.0
    enough = part * min(options.points, options.points_a_frame * len(registered))
    poor = len(model.points) < enough, seen.min() < part * options.seen
    few = support if (any(poor) if little else all(poor)) else None
    if model.reprojection_px > options.reprojection_px:
        reasons.append(f"points miss their pixels by {model.reprojection_px:.2f} px on average")
    if least < options.forward:
        reasons.append(
            f"the path jumps: a step deviates {np.degrees(np.arccos(max(least, -1.0))):.0f} degrees"
        )
    if variation > options.variation:
        reasons.append(f"the length of the steps varies by {100 * variation:.0f} %")
    backwards = bool(usual[2] < 0)
    return GateVerdict(tuple(reasons), figures, backwards, few=few, aside_deg=aside_deg, wobbling=wobbling)


def _usual(ways: Float[np.ndarray, "s 3"]) -> Float[np.ndarray, "3"]:
    """The usual one of directions (S, 3) of length 1; along the optical axis where there is none."""
    usual = np.median(ways, axis=0) if len(ways) else np.zeros(3)
    length = np.linalg.norm(usual)
    return usual / length if length > 0 else np.array([0.0, 0.0, 1.0])


def _least_along(
    poses: Float[np.ndarray, "f 4 4"],
    moving: Bool[np.ndarray, " s"],
    stretch: int,
    usual: Float[np.ndarray, "3"],
) -> float:
    """Least cosine of a stretch of so many moving steps with the usual direction."""
    ways, _ = _steps(poses, stretch)
    steps = np.lib.stride_tricks.sliding_window_view(moving, stretch).all(axis=1)
    judged = ways[steps & np.isfinite(ways).all(axis=1)]
    return float((judged @ usual).min()) if len(judged) else 1.0


def _variation(length: Float[np.ndarray, " s"]) -> float:
    """Standard deviation of the step lengths about their linear trend, over their mean."""
    if len(length) < 2 or length.mean() <= 0:
        return 0.0
    time = np.arange(len(length)) - (len(length) - 1) / 2
    trend = (time @ length) / (time @ time)
    return float((length - trend * time).std() / length.mean())


def _steps(poses: Float[np.ndarray, "f 4 4"], apart: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Direction (S, 3) of each way between frames so far apart, as the camera halfway sees it; its length."""
    step = poses[apart:, :3, 3] - poses[:-apart, :3, 3]
    length = np.linalg.norm(step, axis=1)
    axes = poses[:-apart, :3, :3] + poses[apart:, :3, :3]
    way = np.einsum("sji,sj->si", axes, step)
    return way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-12), length
