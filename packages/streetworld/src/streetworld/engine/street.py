"""A street to be looked at from any camera at any time, with everything known exactly."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from embreex.rtcore import EmbreeDevice
from jaxtyping import Float

from dreamdrive.scene.level import upright
from dreamdrive.scene.street.hills import Hills
from dreamdrive.scene.street.layout import Box, BoxKind, Layout, TrackPoint, is_moving, track_function
from streetworld.engine.bodies import Part, Size
from streetworld.engine.ground import GroundMap
from streetworld.engine.materials import Materials
from streetworld.engine.mesh import Mesh
from streetworld.engine.sky import SkyLight
from streetworld.engine.solid import Solid

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


Body = Callable[[BoxKind, Size, int, Materials], list[Part]]
"""From kind, size and look of a road user to its parts; equal looks give equal bodies."""


def movers_of(layout: Layout, hills: Hills, body: Body, materials: Materials) -> list[Mover]:
    """The boxes of a layout with their bodies."""
    found: list[Mover] = []
    for instance, box in enumerate(layout.boxes, start=1):
        parts = body(box.kind, box.size_m, box.look, materials)
        places = track_function(box.track)
        way = _way(box.track, places)
        found.append(Mover(box, instance, is_moving(box.track), parts, places, way, hills))
    return found


@dataclass(frozen=True)
class Standing:
    """What an edition makes of a layout: road users with their bodies, and all that never moves.

    The triangles ``mesh`` lie on the level map.
    """

    mesh: Mesh
    ground: GroundMap
    ground_material: int
    movers: list[Mover]


class Street:
    """The street of a layout, in the map frame; what never moves is ``standing``."""

    layout: Layout
    hills: Hills
    materials: Materials
    made: Standing
    sky: SkyLight
    standing: Solid
    device: EmbreeDevice

    @property
    def movers(self) -> list[Mover]:
        """The road users, in the order of the layout's boxes."""
        return self.made.movers

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
        return Moment(t_s, Solid(mesh, owner, self.device), poses)

    @cached_property
    def part_instance(self) -> np.ndarray:
        """Instance of each moving part, in the order of ``Moment.poses``."""
        return np.array([m.instance for m in self.movers if m.moving for _ in m.parts], dtype=np.int64)

    def exposure(self, t_s: float) -> float:
        """Brightness of the recording camera at a time."""
        phase = np.random.default_rng([self.layout.seed, 10]).uniform(0, 2 * np.pi)
        return 1 + self.layout.light.exposure_drift * float(np.sin(1.1 * t_s + phase))


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
