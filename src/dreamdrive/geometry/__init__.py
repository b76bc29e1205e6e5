"""F_MVS (eq. 4): from a clip to cameras, depth, confidence, sky and evidence of motion."""

from pathlib import Path

from dreamdrive.errors import InputError
from dreamdrive.geometry import classical, dust3r
from dreamdrive.geometry.protocol import Reconstruct
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry

METHODS: dict[str, Reconstruct] = {"classical": classical.reconstruct, "dust3r": dust3r.reconstruct}


def reconstruct(
    clip: Clip,
    *,
    camera_height_m: float | None = None,
    seed: int = 0,
    method: str = "classical",
    weights: Path | None = None,
) -> Geometry:
    """Reconstruct a clip by a method of ``METHODS``; geometry given as files comes in by ``files.attach``.

    Args:
        clip: The frames and what is known of them.
        camera_height_m: Height of the camera above the road; None assumes 1.5 m.
        seed: Seed of everything random.
        method: Name of the method.
        weights: The network's file or folder, for methods that have one.

    Raises:
        InputError: The method is unknown, or lacks weights, or takes none.
    """
    if method not in METHODS:
        raise InputError(f"Unknown geometry method {method!r}; choose from: {', '.join(METHODS)}.")
    return METHODS[method](clip, camera_height_m=camera_height_m, seed=seed, weights=weights)
