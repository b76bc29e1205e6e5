"""The street of a layout, as its edition draws it."""

from copy import copy

import numpy as np
from embreex.rtcore import EmbreeDevice
from msgspec.structs import replace

from dreamdrive.scene.street.hills import hills_of
from dreamdrive.scene.street.layout import Ego, Layout, Lens, Light
from streetworld.edition2.light.textures import TextureLibrary
from streetworld.editions import edition_of
from streetworld.engine.hills import lifted
from streetworld.engine.materials import Materials
from streetworld.engine.mesh import Mesh
from streetworld.engine.solid import Solid
from streetworld.engine.street import Street

_AHEAD_M, _BESIDE_M = 80.0, 32.0


class World(Street):
    """The street of a layout, in the map frame; what never moves is ``standing``.

    From edition 2 on ``textures`` are mixed with the painted surfaces; None leaves those alone.
    """

    def __init__(self, layout: Layout, textures: TextureLibrary | None = None) -> None:
        edition = edition_of(layout)
        self.layout, self.textures = layout, textures
        self.hills = hills_of(layout)
        self.materials = Materials()
        self.made = edition.stand(layout, _bounds(layout), self.hills, self.materials, textures)
        self.sky = edition.sky(layout, textures)
        still = lifted(self.hills, self.made.mesh)
        parked = [m for m in self.movers if not m.moving]
        meshes = [
            Mesh.joined([p.mesh.moved(pose) for p, pose in zip(m.parts, m.part_poses(0.0), strict=True)])
            for m in parked
        ]
        owners = [np.full(len(mesh), m.instance) for m, mesh in zip(parked, meshes, strict=True)]
        owner = np.concatenate([np.zeros(len(still), dtype=np.int64), *owners])
        self.device = EmbreeDevice()
        self.standing = Solid(Mesh.joined([still, *meshes]), owner, self.device)

    def changed(self, light: Light, lens: Lens, ego: Ego) -> "World":
        """The same street in another light, through another lens, from another car, built once for all."""
        other = copy(self)
        other.layout = replace(self.layout, light=light, lens=lens, ego=ego)
        other.sky = edition_of(other.layout).sky(other.layout, self.textures)
        return other


def _bounds(layout: Layout) -> tuple[float, float, float, float]:
    """What of the map is painted: the way of the car and what it sees from there."""
    ego = np.array([[p.x_m, p.y_m, p.yaw_rad] for p in layout.ego.track])
    ahead = np.stack([np.cos(ego[:, 2]), np.sin(ego[:, 2])], axis=-1)
    points = np.concatenate([ego[:, :2] + reach * ahead for reach in (-15.0, 0.0, _AHEAD_M)])
    low, high = points.min(0) - _BESIDE_M, points.max(0) + _BESIDE_M
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])
