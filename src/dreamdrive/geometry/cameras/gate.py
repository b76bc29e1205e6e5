"""Whether a sparse reconstruction of a drive can be believed."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.geometry.cameras.sfm import Model
from dreamdrive.geometry.options import GateOptions

STRETCH = 3
"""Steps over which the direction of a path that wobbles is judged."""


@dataclass(frozen=True)
class Verdict:
    """Outcome of the gate."""

    reasons: tuple[str, ...]  # why the model is refused, in words; empty when it is accepted
    figures: dict[str, Any]  # what was measured, as JSON values
    backwards: bool  # the camera consistently drives backwards
    wobbling: bool = False  # the frames are not quite pictures of one street, as generated ones are not


def judge(
    model: Model,
    moving: Bool[np.ndarray, " s"],
    options: GateOptions = GateOptions(),
    *,
    little: bool = False,
) -> Verdict:
    """Test registration, support, fit and the plausibility of the steps.

    Only steps (F - 1,) in which the picture moves are held to one direction along the optical axis and to a
    steady length, a steady gain or loss of speed aside: from a standstill the direction of a step is noise
    and its length is far below the mean. Where the frames wobble, their poses do: the direction is then that
    of stretches of three steps. Frames that show little of the street need fewer
    points, but each of them some: on a drawn queue 425 points, 10 in the poorest frame, were 1.2 % off.
    """
    registered = model.registered
    share = float(registered.mean())
    if not registered.any():
        return Verdict(("structure from motion placed no frame",), {"registered_share": 0.0}, False)
    seen = model.seen[registered].sum(axis=1)
    wobbling = model.reprojection_px > options.wobbling_px
    forward, length = _steps(model.world_from_camera)
    judged = moving & np.isfinite(forward)
    backwards = bool(judged.any() and np.median(forward[judged]) < 0)
    least = _least_ahead(model.world_from_camera, moving, STRETCH if wobbling else 1, backwards)
    variation = _variation(length[judged])
    figures = {
        "registered_share": share,
        "points": len(model.points),
        "least_points_seen": int(seen.min()),
        "reprojection_px": model.reprojection_px,
        "least_forward_cosine": least,
        "step_variation": variation,
        "moving_steps": int(judged.sum()),
    }
    reasons: list[str] = []
    if share < options.registered:
        reasons.append(f"only {registered.sum()} of {len(registered)} frames could be placed")
    part = options.little if little else 1.0
    enough = part * min(options.points, options.points_a_frame * len(registered))
    poor = len(model.points) < enough, seen.min() < part * options.seen
    if any(poor) if little else all(poor):
        reasons.append(f"only {len(model.points)} points, {seen.min()} in the poorest frame")
    if model.reprojection_px > options.reprojection_px:
        reasons.append(f"points miss their pixels by {model.reprojection_px:.2f} px on average")
    if least < options.forward:
        reasons.append(
            f"the path jumps: a step deviates {np.degrees(np.arccos(max(least, -1.0))):.0f} degrees"
        )
    if variation > options.variation:
        reasons.append(f"the length of the steps varies by {100 * variation:.0f} %")
    return Verdict(tuple(reasons), figures, backwards, wobbling)


def _least_ahead(
    poses: Float[np.ndarray, "f 4 4"], moving: Bool[np.ndarray, " s"], stretch: int, backwards: bool
) -> float:
    """Least cosine of a stretch of so many moving steps with the optical axis."""
    forward, _ = _steps(poses, stretch)
    steps = np.lib.stride_tricks.sliding_window_view(moving, stretch).all(axis=1)
    judged = forward[steps & np.isfinite(forward)]
    if not len(judged):
        return 1.0
    return float((-judged if backwards else judged).min())


def _variation(length: Float[np.ndarray, " s"]) -> float:
    """Standard deviation of the step lengths about their linear trend, over their mean."""
    if len(length) < 2 or length.mean() <= 0:
        return 0.0
    time = np.arange(len(length)) - (len(length) - 1) / 2
    trend = (time @ length) / (time @ time)
    return float((length - trend * time).std() / length.mean())


def _steps(poses: Float[np.ndarray, "f 4 4"], apart: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Cosine of each way between frames so far apart with the optical axis, and its length."""
    step = poses[apart:, :3, 3] - poses[:-apart, :3, 3]
    length = np.linalg.norm(step, axis=1)
    axis = poses[:-apart, :3, 2] + poses[apart:, :3, 2]
    axis = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    return (step * axis).sum(axis=1) / np.maximum(length, 1e-12), length
