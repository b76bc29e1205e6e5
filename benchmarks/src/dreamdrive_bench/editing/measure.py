"""How far an edited scene is from the street that is drawn with the same edit."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive.splat import render_scene

DIFFERENT = 3
"""Grey levels between two drawn frames from which on a pixel counts as changed."""
COVERED = 1e-6
"""Share of a pixel from which on an actor is in it."""
RIM_PX = 5
"""Around what changed, within which the splat's filter reaches."""


@dataclass(frozen=True)
class Shown:
    """A scene along its recorded path: its pictures, and the share of each pixel that moves."""

    colour: Float[np.ndarray, "f h w 3"]
    moves: Float[np.ndarray, "f h w"]


def shown(scene: Scene) -> Shown:
    """All recorded views of a scene."""
    views = [
        render_scene(scene, camera, float(t_s))
        for camera, t_s in zip(scene.cameras, scene.times_s, strict=True)
    ]
    colour = np.stack([view.colour.clamp(0, 1).numpy() for view in views])
    return Shown(colour, np.stack([view.dynamic_share.numpy() for view in views]))


@dataclass(frozen=True)
class Truths:
    """What is drawn before and after an edit, and the pixels of the road user in each."""

    before: UInt8[np.ndarray, "f h w 3"]
    after: UInt8[np.ndarray, "f h w 3"]
    was: Bool[np.ndarray, "f h w"]
    comes: Bool[np.ndarray, "f h w"]

    @classmethod
    def of(cls, before: DriveTruth, after: DriveTruth, was: str | None, comes: str | None) -> "Truths":
        """Of two drives, by the name of the road user in each; None for none."""
        return cls(before.frames, after.frames, _pixels(before, was), _pixels(after, comes))

    @property
    def changed(self) -> Bool[np.ndarray, "f h w"]:
        """Pixels that the edit changes."""
        return np.abs(self.after.astype(int) - self.before).max(axis=-1) >= DIFFERENT


def _pixels(made: DriveTruth, id: str | None) -> Bool[np.ndarray, "f h w"]:
    labels = [box.instance for box in made.boxes if box.id == id]
    return np.isin(made.instance, labels)


def figures(truths: Truths, before: Shown, after: Shown) -> dict[str, Any]:
    """PSNR where the edit changes the drawing, of its parts, and what changed elsewhere.

    ``before`` is what the scene as it was has in the same pixels, against the drawing as it was. ``hole`` are
    the pixels that the road user leaves, ``there`` those that it comes to, ``shadow`` the others that change.
    """
    changed = truths.changed
    parts = {
        "hole": truths.was & changed & ~truths.comes,
        "there": truths.comes & changed,
        "shadow": changed & ~truths.was & ~truths.comes,
    }
    wrong = np.square(after.colour - truths.after / 255).mean(axis=-1)
    had = np.square(before.colour - truths.before / 255).mean(axis=-1)
    return {
        "share": float(changed.mean()),
        "after": psnr(wrong[changed]),
        "before": psnr(had[changed]),
        **{name: psnr(wrong[mask]) for name, mask in parts.items()},
        **{f"{name}_before": psnr(had[mask]) for name, mask in parts.items()},
        **_elsewhere(changed, before, after),
    }


def _elsewhere(changed: Bool[np.ndarray, "f h w"], before: Shown, after: Shown) -> dict[str, float]:
    """Largest change of any channel where nothing of an edit is, of 255, and the share of it over 1."""
    away = (before.moves != after.moves) & (np.maximum(before.moves, after.moves) > COVERED)
    near = [cv2.dilate(mask.astype(np.uint8), np.ones((RIM_PX, RIM_PX))) > 0 for mask in changed | away]
    change = 255 * np.abs(after.colour - before.colour).max(axis=-1)[~np.stack(near)]
    return {"elsewhere": float(change.max()), "elsewhere_share": float((change > 1).mean())}


def psnr(wrong: Float[np.ndarray, " n"]) -> float | None:
    """Of squared errors; None of none."""
    return float(-10 * np.log10(max(float(wrong.mean()), 1e-10))) if wrong.size else None
