"""Pictures of the own car's cameras, as fast as a CPU draws them."""

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float, Int, UInt8
from torch import Tensor

from dreamdrive.compute.device import device_of
from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.errors import InputError
from dreamdrive.names import DeviceName
from dreamdrive.scene.actor import Track
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import seen_by, set_threads, why_unusable
from dreamdrive.tasks.environment.rig import Mount

_LEAST_ALPHA = 1 / 255
"""Nothing fainter is drawn."""
_BYTES = 44
"""Of the geometry of a Gaussian in the cache."""


@dataclass(frozen=True)
class PictureOptions:
    """How pictures are drawn; what that costs them: docs/results/ablation.md.

    Attributes:
        least_weight: Gaussians that never have so much of a pixel, seen near the recorded path, are left out.
        cache_mb: Memory for what moves at times that come again in the next episode.
        threads: Of the compiled core, in the whole process; several environments want one each.
        device: Where they are drawn: "cpu", "cuda" or "cuda:1".
    """

    least_weight: float = 0.02
    cache_mb: float = 128.0
    threads: int | None = None
    device: DeviceName = "cpu"

    def __post_init__(self) -> None:
        if not 0 <= self.least_weight <= 0.5 or not 0 <= self.cache_mb < 1e6:
            raise InputError(f"{self}; expected a least_weight from 0 to 0.5 and a cache of 0 MB or more")
        if self.threads is not None and not 1 <= self.threads <= 1024:
            raise InputError(f"threads {self.threads}; expected 1 to 1024, or None")


@dataclass(frozen=True)
class Shifted:
    """An actor that is not where it was recorded at the time of a picture.

    Attributes:
        actor: Its id.
        clock_s: The time of the recording that it is at, or after its end.
        there: Whether it is anywhere.
    """

    actor: int
    clock_s: float
    there: bool


@dataclass(frozen=True)
class _Moved:
    """What moves at a time: activated, and which rows of the canonical Gaussians it is."""

    rows: Int[Tensor, " m"]
    means: Float[Tensor, "m 3"]
    quaternions: Float[Tensor, "m 4"]
    scales: Float[Tensor, "m 3"]
    opacities: Float[Tensor, " m"]


class Pictures:
    """Draws a scene again and again.

    What stands is activated once and lies in one buffer; what moves is written behind it at each time, and
    kept for the same time of another episode.
    """

    def __init__(self, scene: Scene, mounts: Sequence[Mount], options: PictureOptions) -> None:
        if options.threads is not None:
            set_threads(options.threads)
        self.mounts, self._options = tuple(mounts), options
        self._scene = scene = scene.on(device_of(options.device, why_unusable))
        self._device = scene.static.means.device
        self._last_s = float(scene.times_s.max())
        self._first_s = float(scene.times_s.min())
        self._dynamic = replace(scene.dynamic, features=None)
        self._kept: OrderedDict[float, _Moved] = OrderedDict()
        self._fill(scene.static_at(self._first_s))

    def leave_out(self, poses: Sequence[Float[np.ndarray, "4 4"]]) -> None:
        """Leave out what stands and has less than the least weight in all views of a car at some places.

        What none of them sees stays.

        Args:
            poses: World from ego.
        """
        least = self._options.least_weight
        if least == 0 or not self._standing:
            return
        # Once, so that the CPU does it: its core alone tells of weights.
        standing = [each.cpu() for each in self._buffers(self._standing)]
        seen = torch.zeros(self._standing, dtype=torch.bool)
        most = torch.zeros(self._standing)
        for pose in poses:
            for camera in self._cameras(pose):
                with torch.no_grad(), one_torch_thread():
                    view = seen_by(camera, *standing, inspect=True)
                assert view.weight_most is not None
                seen |= view.visible
                most = torch.maximum(most, view.weight_most)
        keep = torch.nonzero(~seen | (most >= least)).squeeze(1)
        self._fill(self._scene.static_at(self._first_s).select(keep.to(self._device)))

    def draw(
        self, time_s: float, world_from_ego: Float[np.ndarray, "4 4"], shifted: Sequence[Shifted] = ()
    ) -> UInt8[np.ndarray, "n h w 3"]:
        """Pictures of all cameras.

        Args:
            time_s: Of the scene; after its end what is shifted alone goes on.
            world_from_ego: Where the car is.
            shifted: Actors that are elsewhere than at this time of the recording.
        """
        time_s = min(max(time_s, self._first_s), self._last_s)
        with torch.no_grad(), one_torch_thread():
            count = self._place(time_s, shifted)
            views = [
                self._view(camera, mount, count, time_s)
                for camera, mount in zip(self._cameras(world_from_ego), self.mounts, strict=True)
            ]
        return np.stack(views)

    def _cameras(self, world_from_ego: Float[np.ndarray, "4 4"]) -> list[Camera]:
        return [mount.pinhole.at(world_from_ego @ mount.ego_from_camera) for mount in self.mounts]

    def _fill(self, standing: Gaussians) -> None:
        """A buffer for all that may be drawn at once, with what stands in it."""
        count, self._standing = len(standing) + len(self._dynamic), len(standing)
        values = (
            standing.means,
            standing.quaternions,
            standing.log_scales.exp(),
            standing.logit_opacities.sigmoid(),
            standing.sh,
        )
        self._buffer = tuple(value.new_zeros(count, *value.shape[1:]) for value in values)
        self._write(0, values)

    def _write(self, first: int, values: Sequence[Tensor]) -> None:
        for buffer, value in zip(self._buffer, values, strict=True):
            buffer[first : first + len(value)] = value

    def _buffers(self, count: int) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor]:
        means, quaternions, scales, opacities, sh = (each[:count] for each in self._buffer)
        return means, quaternions, scales, opacities, sh

    def _place(self, time_s: float, shifted: Sequence[Shifted]) -> int:
        """Write what moves behind what stands; how many are to be drawn."""
        count = self._standing
        for part in self._moving(time_s, shifted):
            sh = self._dynamic.sh.index_select(0, part.rows)
            self._write(count, (part.means, part.quaternions, part.scales, part.opacities, sh))
            count += len(part.rows)
        return count

    def _moving(self, time_s: float, shifted: Sequence[Shifted]) -> list[_Moved]:
        if not len(self._dynamic):
            return []
        if not shifted:
            return [self._cached(time_s)]
        assert self._dynamic.actor is not None
        elsewhere = torch.isin(
            self._dynamic.actor, torch.tensor([each.actor for each in shifted], device=self._device)
        )
        parts = [self._moved(self._scene, time_s, torch.nonzero(~elsewhere).squeeze(1))]
        for each in shifted:
            if each.there:
                rows = torch.nonzero(self._dynamic.actor == each.actor).squeeze(1)
                parts.append(self._moved(self._steered(each), min(each.clock_s, self._last_s), rows))
        return parts

    def _steered(self, shifted: Shifted) -> Scene:
        """The scene in which an actor is at the end of the recording where it comes to after it."""
        if shifted.clock_s <= self._last_s:
            return self._scene
        track = self._scene.actor(shifted.actor).track.at(np.array([shifted.clock_s]))
        there = Track(np.array([self._last_s]), track.positions_m, track.yaw_rad)
        return self._scene.with_track(shifted.actor, there)

    def _cached(self, time_s: float) -> _Moved:
        """All that moves at a time, as recorded."""
        if time_s in self._kept:
            self._kept.move_to_end(time_s)
            return self._kept[time_s]
        found = self._moved(self._scene, time_s, torch.arange(len(self._dynamic), device=self._device))
        self._kept[time_s] = found
        most = self._options.cache_mb * 1e6
        while sum(len(each.rows) for each in self._kept.values()) * _BYTES > most and self._kept:
            self._kept.popitem(last=False)
        return found

    def _moved(self, scene: Scene, time_s: float, rows: Int[Tensor, " m"]) -> _Moved:
        """Some of what moves, as a scene has it at a time, without what is too faint then."""
        rows = rows[self._alive(time_s)[rows]]
        gaussians = scene.moved_at(self._dynamic.select(rows), time_s)
        return _Moved(
            rows,
            gaussians.means.detach(),
            gaussians.quaternions.detach(),
            gaussians.log_scales.detach().exp(),
            gaussians.logit_opacities.detach().sigmoid(),
        )

    def _alive(self, time_s: float) -> Tensor:
        """Which of what moves a life span leaves more of than the least weight."""
        dynamic = self._dynamic
        if dynamic.lifespan is None:
            return torch.ones(len(dynamic), dtype=torch.bool, device=self._device)
        centre_s, deviation_s = dynamic.lifespan.unbind(-1)
        share = torch.exp(-0.5 * ((time_s - centre_s) / deviation_s.clamp(min=1e-6)) ** 2)
        least = max(self._options.least_weight, _LEAST_ALPHA)
        return dynamic.logit_opacities.sigmoid() * share >= least

    def _view(self, camera: Camera, mount: Mount, count: int, time_s: float) -> UInt8[np.ndarray, "h w 3"]:
        view = seen_by(camera, *self._buffers(count))
        colour = view.colour
        if self._scene.sky is not None:
            colour = colour + (1 - view.alpha)[..., None] * self._scene.sky.colour(camera)
        if self._scene.exposure is not None:
            colour = self._scene.exposure.apply(colour, time_s, mount.of_rig)
        return colour.clamp(0, 1).mul(255).round().to(torch.uint8).cpu().numpy()
