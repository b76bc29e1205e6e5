"""What ``scene.json`` holds, with the bounds within which it is believed."""

from typing import Annotated

import msgspec
import numpy as np
from jaxtyping import Float
from msgspec import Meta

from dreamdrive.data.formats.rigid import JsonPose
from dreamdrive.scene.actor import Actor
from dreamdrive.scene.camera import FARTHEST_M, Camera
from dreamdrive.scene.scene import Provenance

MAX_PIXELS = 64_000_000
"""Most pixels of a view."""

_Metres = Annotated[float, Meta(ge=-FARTHEST_M, le=FARTHEST_M)]
_Digest = Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]
_Point = tuple[_Metres, _Metres, _Metres]


class StoredCamera(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A view, as ``Camera``."""

    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    width_px: int
    height_px: int
    world_from_camera: JsonPose

    def camera(self) -> Camera:
        """The noun; ``ValueError`` where its pose, size or focal length is none of a camera."""
        pose = np.array(self.world_from_camera, dtype=np.float64)
        return Camera(self.fx_px, self.fy_px, self.cx_px, self.cy_px, self.width_px, self.height_px, pose)


class StoredActor(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What moves, as ``Actor``."""

    id: Annotated[int, Meta(ge=0, le=10**6)]
    name: Annotated[str, Meta(max_length=200)]
    kind: Annotated[str, Meta(max_length=200)]
    count: Annotated[int, Meta(ge=0, le=10**9)]
    times_s: list[float]
    positions_m: list[_Point]

    def actor(self) -> Actor:
        """The noun; ``ValueError`` where times and places do not belong together."""
        times_s = increasing(self.times_s, f"times of {self.name}")
        if len(self.positions_m) != len(times_s):
            raise ValueError(f"{self.name} has {len(times_s)} times and {len(self.positions_m)} places")
        positions_m = np.array(self.positions_m, dtype=np.float64).reshape(-1, 3)
        return Actor(self.id, self.name, self.kind, self.count, times_s, positions_m)


class StoredSky(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The range of the panorama, as ``Sky``."""

    azimuth_rad: tuple[float, float]
    elevation_rad: tuple[float, float]


class StoredIndex(msgspec.Struct, frozen=True):
    """All of ``scene.json`` that a scene is made of."""

    parts: dict[str, _Digest]
    actors: list[StoredActor]
    cameras: Annotated[list[StoredCamera], Meta(min_length=1)]
    times_s: list[float]
    held_out: list[bool]
    provenance: Provenance
    camera: list[Annotated[int, Meta(ge=0, le=10**4)]] | None = None
    deformation: dict[str, int | float | str] | None = None
    sky: StoredSky | None = None


def increasing(values: list[float], name: str) -> Float[np.ndarray, " t"]:
    """Times as an array; ``ValueError`` where they do not increase."""
    times_s = np.array(values, dtype=np.float64)
    if (np.diff(times_s) <= 0).any():
        raise ValueError(f"{name} do not increase")
    return times_s
