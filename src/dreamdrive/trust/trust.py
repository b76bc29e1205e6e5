"""How far any view of a scene can be believed, from what its recorded views tell alone."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import SceneView
from dreamdrive.trust.evidence import GaussianEvidence, evidence_of, seen_with
from dreamdrive.trust.free_space import FreeSpace
from dreamdrive.trust.network import error_network, features_of

HALF_RMS = 0.08
"""Error at which trust is one half: 22 dB."""
_MOST_CHECKS = 8
_LEAST = 1e-6


@dataclass(frozen=True)
class TrustedView:
    """A view, and the error to expect of it.

    Attributes:
        view: What the scene shows.
        squared_error: To expect of each block of 8x8 pixels (H // 8, W // 8), of colours in [0, 1].
    """

    view: SceneView
    squared_error: Float[np.ndarray, "bh bw"]

    @property
    def psnr_db(self) -> float:
        """PSNR to expect of the whole view."""
        return -10 * math.log10(max(float(self.squared_error.mean()), _LEAST))

    @property
    def trust(self) -> Float[np.ndarray, "bh bw"]:
        """Trust in each block: 1 where no error is expected, one half where its root is ``HALF_RMS``."""
        return 1 / (1 + self.squared_error / HALF_RMS**2)


@dataclass(frozen=True)
class SceneTrust:
    """What is known of a scene's recorded views, ready for any other view.

    Attributes:
        scene: Whose it is.
        evidence: Of its Gaussians.
        free_space: Where views looked into.
        off: Of views that no fit has seen, the logarithm of how many times the expected squared error they
            are off, by their indices.
    """

    scene: Scene
    evidence: GaussianEvidence
    free_space: FreeSpace
    off: dict[int, float]

    @classmethod
    def of(cls, scene: Scene) -> "SceneTrust":
        """Look at the recorded views again, on the CPU, which takes as long as to render them thrice.

        Raises:
            InputError: The scene was not compared with its frames.
        """
        if scene.residual is None:
            raise InputError(
                "trust needs a scene that knows how far it is off its frames, which this one was never told; "
                "generate it again"
            )
        scene, squared = scene.on("cpu"), np.square(scene.residual.astype(np.float32))
        known = cls(scene, evidence_of(scene, squared), FreeSpace.of(scene), {})
        held_out = np.flatnonzero(scene.held_out)
        every = max(1, math.ceil(len(held_out) / _MOST_CHECKS))
        off = {int(view): known._off(int(view), squared[view]) for view in held_out[::every]}
        return cls(scene, known.evidence, known.free_space, off)

    def view(self, camera: Camera, t_s: float, besides: int | None = None) -> TrustedView:
        """A view with the error to expect of it.

        Args:
            camera: Pinhole with its pose in the scene's world, of the size of the recording or another one.
            t_s: Time in seconds.
            besides: A recorded view whose own error is not to be used, to see how well it is guessed.
        """
        view, told = seen_with(self.evidence, self.scene, camera, t_s)
        hidden = self.free_space.hidden(camera, view.depth_m)
        expected = error_network().squared_error(features_of(view, told.numpy(), hidden.numpy()))
        others = [off for index, off in self.off.items() if index != besides]
        return TrustedView(view, expected * math.exp(float(np.mean(others)) if others else 0.0))

    def _off(self, view: int, squared_error: Float[np.ndarray, "bh bw"]) -> float:
        expected = self.view(self.scene.cameras[view], float(self.scene.times_s[view])).squared_error
        return math.log(max(float(squared_error.mean()), _LEAST) / max(float(expected.mean()), _LEAST))
