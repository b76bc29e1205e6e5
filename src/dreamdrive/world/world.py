"""A street made from a layout: to be looked at from any camera at any time, with everything known exactly."""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from embreex.rtcore import EmbreeDevice
from jaxtyping import Float
from msgspec.structs import replace

from dreamdrive.scene.layout import Box, Ego, Layout, Lens, Light, TrackPoint, is_moving, track_function
from dreamdrive.world import bodies, edition2
from dreamdrive.world.bodies import Part
from dreamdrive.world.edition2 import Hills, Lamps, TextureLibrary, hills_of
from dreamdrive.world.ground import GroundMap, paint_ground
from dreamdrive.world.materials import Materials, Semantic
from dreamdrive.world.mesh import Mesh, upright
from dreamdrive.world.scenery import scenery
from dreamdrive.world.sky import Sky, make_sky
from dreamdrive.world.solid import Solid

_AHEAD_M, _BESIDE_M = 80.0, 32.0
_WAY_STEP_S = 0.05


@dataclass(frozen=True)
class Mover:
    """A box of the layout with its body.

    ``places`` leads from times (T,) to x, y and yaw (T, 3), ``way_m`` to the way travelled since time 0.
    """

    box: Box
    instance: int
    moving: bool
    parts: list[Part]
    places: Callable[[np.ndarray], np.ndarray]
    way_m: Callable[[np.ndarray], np.ndarray]
    hills: Hills

    def pose(self, t_s: float) -> Float[np.ndarray, "4 4"]:
        """``map_from_body`` (4, 4); only who goes on foot stays plumb on a slope."""
        level = upright(self.places(np.array([t_s]))[0])
        return self.hills.laid(level, plumb=self.box.kind == "pedestrian")

    def part_poses(self, t_s: float) -> list[Float[np.ndarray, "4 4"]]:
        """``map_from_part`` of each part."""
        pose, way = self.pose(t_s), float(self.way_m(np.array([t_s]))[0])
        return [pose if part.turn is None else pose @ part.turn(way) for part in self.parts]


@dataclass(frozen=True)
class Moment:
    """A world at a time: its movers' triangles, whose owner is a part, and ``map_from_part`` of each part."""

    time_s: float
    moving: Solid
    poses: Float[np.ndarray, "p 4 4"]


class World:
    """The street of a layout, in the map frame; what never moves is ``standing``.

    From edition 2 on ``textures`` are mixed with the painted surfaces; None leaves those alone.
    """

    def __init__(self, layout: Layout, textures: TextureLibrary | None = None) -> None:
        self.layout, self.textures = layout, textures
        self.hills = hills_of(layout)
        self.materials = Materials()
        still = self.hills.lifted(self._still() if layout.edition == 1 else self._still2())
        parked = [m for m in self.movers if not m.moving]
        meshes = [
            Mesh.joined([p.mesh.moved(pose) for p, pose in zip(m.parts, m.part_poses(0.0), strict=True)])
            for m in parked
        ]
        owners = [np.full(len(mesh), m.instance) for m, mesh in zip(parked, meshes, strict=True)]
        owner = np.concatenate([np.zeros(len(still), dtype=np.int64), *owners])
        self._device = EmbreeDevice()
        self.standing = Solid(Mesh.joined([still, *meshes]), owner, self._device)

    def _still(self) -> Mesh:
        """Sky, ground, bodies and scenery of edition 1."""
        self.ground: GroundMap = paint_ground(self.layout, _bounds(self.layout))
        self.sky: Sky = make_sky(self.layout.light, self.layout.seed)
        self.ground_material = self.materials.add(self.ground.image, Semantic.ROAD)
        self.movers = [self._mover(i + 1, box) for i, box in enumerate(self.layout.boxes)]
        return scenery(self.layout, self.ground, self.ground_material, self.materials)

    def _still2(self) -> Mesh:
        """Those of edition 2, with its lamps."""
        ground = edition2.paint_ground(self.layout, _bounds(self.layout), self.textures)
        self.ground = self.ground2 = ground
        self.sky = edition2.make_sky(self.layout, self.textures)
        self.ground_material = self.materials.add(ground.image, Semantic.ROAD)
        self.far_material = self.materials.add(ground.far.image, Semantic.ROAD)
        self.detail_texture = self.materials.textures.add(edition2.grain(self.layout.seed % 8), repeats=True)
        self.movers = [self._mover(i + 1, box) for i, box in enumerate(self.layout.boxes)]
        both = self.ground_material, self.far_material
        made = edition2.scenery(self.layout, ground, both, self.materials, self.textures)
        self.lamps: Lamps = Lamps(self.hills.raised(made.lamps.at_m), made.lamps.colour, made.lamps.ahead)
        return made.mesh

    def poses(self, t_s: float) -> Float[np.ndarray, "p 4 4"]:
        """``map_from_part`` of all parts of moving boxes at a time."""
        poses = [pose for mover in self.movers if mover.moving for pose in mover.part_poses(t_s)]
        return np.stack(poses) if poses else np.zeros((0, 4, 4))

    def at(self, t_s: float, without: int = 0) -> Moment:
        """The world at a time, perhaps without the moving road user of an instance."""
        parts = [
            (number, part.mesh)
            for number, (mover, part) in enumerate((m, p) for m in self.movers if m.moving for p in m.parts)
            if mover.instance != without
        ]
        poses = self.poses(t_s)
        numbers = np.array([number for number, _ in parts], dtype=np.int64)
        owner = np.repeat(numbers, [len(mesh) for _, mesh in parts])
        mesh = Mesh.joined([mesh.moved(poses[number]) for number, mesh in parts])
        return Moment(t_s, Solid(mesh, owner, self._device), poses)

    def changed(self, light: Light, lens: Lens, ego: Ego) -> "World":
        """The same street in another light, through another lens, from another car, built once for all."""
        other = copy(self)
        other.layout = replace(self.layout, light=light, lens=lens, ego=ego)
        one = self.layout.edition == 1
        other.sky = (
            make_sky(light, self.layout.seed) if one else edition2.make_sky(other.layout, self.textures)
        )
        return other

    @cached_property
    def part_instance(self) -> np.ndarray:
        """Instance of each moving part, in the order of ``Moment.poses``."""
        return np.array([m.instance for m in self.movers if m.moving for _ in m.parts], dtype=np.int64)

    def exposure(self, t_s: float) -> float:
        """Brightness of the recording camera at a time."""
        phase = np.random.default_rng([self.layout.seed, 10]).uniform(0, 2 * np.pi)
        return 1 + self.layout.light.exposure_drift * float(np.sin(1.1 * t_s + phase))

    def _mover(self, instance: int, box: Box) -> Mover:
        body = edition2.body if self.layout.edition == 2 else bodies.body
        parts = body(box.kind, box.size_m, box.look, self.materials)
        places = track_function(box.track)
        way = _way(box.track, places)
        return Mover(box, instance, is_moving(box.track), parts, places, way, self.hills)


def _way(
    track: list[TrackPoint], places: Callable[[np.ndarray], np.ndarray]
) -> Callable[[np.ndarray], np.ndarray]:
    """Way travelled at times (T,) since time 0, on the track and on its straight continuation."""
    start, end = min(0.0, track[0].t_s) - 5.0, track[-1].t_s + 5.0
    times = np.arange(start, end, _WAY_STEP_S)
    steps = np.linalg.norm(np.diff(places(times)[:, :2], axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    way -= np.interp(0.0, times, way)
    return lambda wanted: np.interp(wanted, times, way)


def _bounds(layout: Layout) -> tuple[float, float, float, float]:
    """What of the map is painted: the way of the car and what it sees from there."""
    ego = np.array([[p.x_m, p.y_m, p.yaw_rad] for p in layout.ego.track])
    ahead = np.stack([np.cos(ego[:, 2]), np.sin(ego[:, 2])], axis=-1)
    points = np.concatenate([ego[:, :2] + reach * ahead for reach in (-15.0, 0.0, _AHEAD_M)])
    low, high = points.min(0) - _BESIDE_M, points.max(0) + _BESIDE_M
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])
