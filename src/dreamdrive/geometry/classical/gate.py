"""Whether a sparse reconstruction of a drive can be believed."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.geometry.classical.sfm import Model

MIN_REGISTERED = 0.9
MIN_POINTS, MIN_POINTS_A_FRAME = 600, 25
MIN_SEEN = 60
MAX_REPROJECTION_PX = 0.5
MIN_FORWARD = 0.9
MAX_VARIATION = 0.6


@dataclass(frozen=True)
class Verdict:
    """Outcome of the gate.

    Attributes:
        reasons: Why the model is refused, in words; empty when it is accepted.
        figures: What was measured, as JSON values.
        backwards: Whether the camera consistently drives backwards.
    """

    reasons: tuple[str, ...]
    figures: dict[str, Any]
    backwards: bool


def judge(model: Model, moving: Bool[np.ndarray, " s"]) -> Verdict:
    """Test registration, support, fit and the plausibility of the steps.

    Only steps (F - 1,) in which the picture moves are held to one direction along the optical axis and to a
    steady
    length, a steady gain or loss of speed aside: from a standstill the direction of a step is noise and its
    length is far below the mean.
    """
    registered = model.registered
    share = float(registered.mean())
    if not registered.any():
        return Verdict(("structure from motion placed no frame",), {"registered_share": 0.0}, False)
    seen = model.seen[registered].sum(axis=1)
    forward, length = _steps(model.world_from_camera)
    judged = moving & np.isfinite(forward)
    backwards = bool(judged.any() and np.median(forward[judged]) < 0)
    ahead = -forward if backwards else forward
    least = float(ahead[judged].min()) if judged.any() else 1.0
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
    if share < MIN_REGISTERED:
        reasons.append(f"only {registered.sum()} of {len(registered)} frames could be placed")
    enough = min(MIN_POINTS, MIN_POINTS_A_FRAME * len(registered))
    if len(model.points) < enough and seen.min() < MIN_SEEN:
        reasons.append(f"only {len(model.points)} points, {seen.min()} in the poorest frame")
    if model.reprojection_px > MAX_REPROJECTION_PX:
        reasons.append(f"points miss their pixels by {model.reprojection_px:.2f} px on average")
    if least < MIN_FORWARD:
        reasons.append(
            f"the path jumps: a step deviates {np.degrees(np.arccos(max(least, -1.0))):.0f} degrees"
        )
    if variation > MAX_VARIATION:
        reasons.append(f"the length of the steps varies by {100 * variation:.0f} %")
    return Verdict(tuple(reasons), figures, backwards)


def _variation(length: Float[np.ndarray, " s"]) -> float:
    """Standard deviation of the step lengths about their linear trend, over their mean."""
    if len(length) < 2 or length.mean() <= 0:
        return 0.0
    time = np.arange(len(length)) - (len(length) - 1) / 2
    trend = (time @ length) / (time @ time)
    return float((length - trend * time).std() / length.mean())


def _steps(poses: Float[np.ndarray, "f 4 4"]) -> tuple[np.ndarray, np.ndarray]:
    """Cosine of each step with the optical axis, and its length."""
    step = np.diff(poses[:, :3, 3], axis=0)
    length = np.linalg.norm(step, axis=1)
    axis = poses[:-1, :3, 2] + poses[1:, :3, 2]
    axis = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    return (step * axis).sum(axis=1) / np.maximum(length, 1e-12), length
