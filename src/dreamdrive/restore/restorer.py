"""Views as the restorer mends them."""

from dataclasses import dataclass, replace
from pathlib import Path

import torch
from torch import Tensor

from dreamdrive.compute.device import CPU
from dreamdrive.restore.carried import Recordings
from dreamdrive.restore.network import RestorerNetwork, load_restorer
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import SceneView
from dreamdrive.trust import GaussianEvidence


@dataclass(frozen=True)
class Restorer:
    """Mends any view of a scene with what its recorded frames show there.

    Attributes:
        recordings: The recorded frames of the scene.
        network: What mends, on the device ``device``.
        device: Where it does.
    """

    recordings: Recordings
    network: RestorerNetwork
    device: torch.device = CPU

    @classmethod
    def of(
        cls, scene: Scene, evidence: GaussianEvidence, weights: Path, device: torch.device = CPU
    ) -> "Restorer":
        """That of a scene, with weights of ``dreamdrive train restorer``.

        Raises:
            InputError: The scene was changed or holds no recorded frames, or there are no such weights.
        """
        network = load_restorer(weights).to(device)
        network.to(memory_format=torch.channels_last)  # pyright: ignore[reportCallIssue]
        # Its answer is read plane by plane.
        network.answer.to(memory_format=torch.contiguous_format)  # pyright: ignore[reportCallIssue]
        return cls(Recordings.of(scene, evidence), network, device)

    def view(self, camera: Camera, t_s: float, besides: int | None = None) -> SceneView:
        """A view with mended colours.

        Args:
            camera: Pinhole with its pose in the scene's world.
            t_s: Time in seconds.
            besides: A recorded view whose frame is not to be used, to see how well it is guessed.
        """
        seen, told = self.recordings.told(camera, t_s, besides)
        return replace(seen, colour=self._mended(torch.from_numpy(told)))

    @torch.inference_mode()
    def _mended(self, told: Tensor) -> Tensor:
        height, width = told.shape[1:]
        even = torch.nn.functional.pad(told[None], (0, width % 2, 0, height % 2), mode="replicate")
        said = self.network(even.to(device=self.device, memory_format=torch.channels_last))
        return said[0, :, :height, :width].clamp(0, 1).permute(1, 2, 0).cpu().contiguous()
