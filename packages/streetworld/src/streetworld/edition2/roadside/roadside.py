"""Things beside a road of edition 2: houses, bounds of estates, trees, posts."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from dreamdrive.scene.street.layout import Barrier, BarrierKind, Building, Prop, PropKind
from streetworld.edition2.layouts.held_back import Looks
from streetworld.edition2.layouts.kinds import StreetRecipe, chosen
from streetworld.edition2.roads.roads import Net, Way
from streetworld.engine.road import map_points

_HEIGHT_M: dict[PropKind, tuple[float, float]] = {
    "tree": (3.5, 14.0),
    "bush": (0.5, 2.2),
    "lamp": (4.5, 11.0),
    "mast": (7.0, 10.0),
    "sign": (2.2, 3.4),
    "traffic_light": (2.8, 5.5),
    "bin": (0.8, 1.3),
    "cone": (0.5, 0.9),
}
_BARRIER_M: dict[BarrierKind, tuple[float, float]] = {
    "fence": (0.8, 2.2),
    "hedge": (0.7, 2.2),
    "wall": (0.6, 3.0),
    "rail": (0.65, 0.9),
}
_WOOD_M = 45.0  # from the road, how far trees and bushes stand
_MOST_TREES = 130
_SIGHT_M = (-50.0, 180.0)  # stations between which small things are placed


@dataclass
class Sides:
    """Fills the ground beside the roads, each thing clear of those before."""

    rng: np.random.Generator
    looks: Looks
    kind: StreetRecipe
    net: Net

    def __post_init__(self) -> None:
        self.open_ground: BaseGeometry = self.net.paved.union(self.net.walks)
        self.houses: list[Building] = []
        self.outlines: list[shapely.Polygon] = []
        self.barriers: list[Barrier] = []
        self.props: list[Prop] = []
        self._bound_m = self._bounds()

    def _bounds(self) -> float:
        """How far behind the sidewalk the estates begin."""
        return float(self.rng.uniform(0.1, 0.8)) if self.rng.random() < 0.8 else float(self.rng.uniform(1, 4))

    def build_houses(self) -> None:
        """Rows of houses along all roads, with gaps in some streets."""
        rng, kind = self.rng, self.kind
        free = shapely.union_all([self.open_ground.buffer(0.25), self.net.crossed])
        dense, looks = float(rng.uniform(0.5, 1.0)) * kind.houses, int(rng.integers(3, 12))
        tall_m = rng.uniform(*kind.height_m)
        row = [self.looks.draw() for _ in range(looks)]
        for way in self.net.ways:
            for side in (-1, 1):
                setback = float(rng.uniform(*kind.setback_m))
                station = way.start_m
                while dense > 0 and station < way.end_m - kind.wide_m[0]:
                    wide, deep = float(rng.uniform(*kind.wide_m)), float(rng.uniform(8, 14))
                    near = side * (way.walk_m(side)[1] + setback * rng.uniform(0.8, 1.2))
                    outline = way.block(station, wide, near, near + side * deep)
                    attached = rng.random() < dense
                    station += wide + (0.0 if attached else float(rng.uniform(2, 25)))
                    low, high = kind.height_m
                    height = float(np.clip(tall_m * np.exp(rng.normal(0, 0.35)), low, high))
                    look = row[int(rng.integers(looks))]
                    if rng.random() < 1 - kind.houses or outline.intersects(free):
                        continue
                    if self.outlines and shapely.intersects(np.array(self.outlines), outline).any():
                        continue
                    self.outlines.append(outline.buffer(-0.05))
                    ring = [(round(float(x), 2), round(float(y), 2)) for x, y in outline.exterior.coords[:-1]]
                    self.houses.append(Building(polygon=ring, height_m=round(height, 1), look=look))

    def build_barriers(self) -> None:
        """Guard rails at the road's edge and along its middle; walls, hedges and fences round estates."""
        rng, kind, net = self.rng, self.kind, self.net
        if net.main.section.middle == "rail":
            self._run("rail", net.main.line(0.0), net.crossed.buffer(1.0))
        for way in net.ways:
            for side in (-1, 1):
                if rng.random() < kind.rail:
                    away = side * (way.walk_m(side)[0] + rng.uniform(0.3, 0.8))
                    self._run("rail", way.line(away), net.paved.union(net.crossed.buffer(6)))
                bound = chosen(rng, kind.estate)
                if bound is not None:
                    away = side * (way.walk_m(side)[1] + self._bound_m + (1.5 if kind.rail else 0.0))
                    self._run(bound, way.line(away), self.open_ground.buffer(0.1), gaps=True)

    def _run(
        self, kind: BarrierKind, line: shapely.LineString, free: BaseGeometry, *, gaps: bool = False
    ) -> None:
        """A barrier along a line, except where ground is to stay free, in front of some houses in pieces."""
        rng = self.rng
        height, look = round(float(rng.uniform(*_BARRIER_M[kind])), 2), self.looks.draw()
        houses = shapely.union_all(self.outlines).buffer(0.2) if self.outlines else shapely.Polygon()
        pieces = shapely.get_parts(line.difference(free).difference(houses))
        for piece in pieces:
            starts = [0.0]
            while gaps and starts[-1] < piece.length:
                starts.append(starts[-1] + float(rng.uniform(6, 40)))
            starts = starts if gaps else [0.0, piece.length]
            for start, end in pairwise(starts):
                last = min(end - 3.0 * gaps, piece.length)
                part = substring(piece, start, last)
                if part.geom_type == "LineString" and part.length > 1.5:
                    points = map_points(np.array(part.simplify(0.03).coords))
                    self.barriers.append(Barrier(kind, points, height, look))

    def place_props(self, occupied: BaseGeometry) -> None:
        """Trees, posts and the like where nothing else stands; ``occupied`` is what road users ever cover."""
        net = self.net
        standing = [net.paved.difference(net.middles), occupied, *self.outlines]
        standing += [shapely.LineString(b.points).buffer(0.25) for b in self.barriers]
        standing += net.zebras
        self._road_users = occupied
        self._blocked = shapely.union_all(standing).buffer(0.2)
        shapely.prepare(self._blocked)
        for way in net.ways:
            for side in (-1, 1):
                self._kerb_props(way, side)
        if net.main.section.middle in ("grass", "paved"):
            self._median_props(net.main)
        self._wood()
        self._lights()
        if self.rng.random() < 0.12:
            self._cones()

    def _kerb_props(self, way: Way, side: int) -> None:
        """A row of lamps, of masts, of trees and of small things along one kerb."""
        rng, kind, which = self.rng, self.kind, way.side(side)
        inside = which.verge_m / 2 if which.verge_m > 0.8 else 0.45
        away = way.kerb_m(side) + (inside if which.walk_m or which.verge_m else rng.uniform(0.6, 1.8))
        species = [self.looks.draw() for _ in range(int(rng.integers(1, 4)))]
        height = rng.uniform(*_HEIGHT_M["tree"])
        trees = kind.trees * rng.uniform(0, 1.6)
        rows: list[tuple[PropKind, float, float]] = [
            ("lamp", float(rng.uniform(18, 40)), kind.lamps * (rng.random() < 0.75)),
            ("mast", float(rng.uniform(25, 45)), kind.masts * (rng.random() < 0.6)),
            ("tree", float(rng.uniform(5, 14)), trees),
            ("sign", float(rng.uniform(12, 40)), 0.45),
            ("bush", float(rng.uniform(3, 12)), kind.bushes * rng.random()),
            ("bin", float(rng.uniform(8, 30)), 0.3 * rng.random() * bool(kind.walkers[1])),
        ]
        for prop, step, share in rows:
            look, tall = self.looks.draw(), rng.uniform(*_HEIGHT_M[prop])
            behind = 0.0 if prop in ("lamp", "tree", "mast") else float(rng.uniform(0, 0.5))
            for station in np.arange(
                max(way.start_m, _SIGHT_M[0]) + 3, min(way.end_m, _SIGHT_M[1]) - 3, step
            ):
                if rng.random() >= share:
                    continue
                jitter = 0.0 if prop in ("lamp", "mast") else rng.uniform(-0.3, 0.3) * step
                x, y, heading = way.at(np.array([station + jitter]), side * (away + behind))[0]
                yaw = heading - side * np.pi / 2
                if prop == "tree":
                    look, tall = species[int(rng.integers(len(species)))], height * rng.uniform(0.75, 1.2)
                elif prop != "lamp" and prop != "mast":
                    look, tall = self.looks.draw(), rng.uniform(*_HEIGHT_M[prop])
                if prop == "sign":
                    yaw = heading + (np.pi if side < 0 else 0.0)
                self._add(prop, (x, y), tall, yaw, look)

    def _median_props(self, way: Way) -> None:
        rng, middle = self.rng, way.section.middle_m
        if middle < 1.2:
            return
        prop: PropKind = str(rng.choice(["tree", "lamp", "bush"]))  # pyright: ignore[reportAssignmentType]
        step, look, tall = rng.uniform(6, 25), self.looks.draw(), rng.uniform(*_HEIGHT_M[prop])
        for station in np.arange(way.start_m, way.end_m, step):
            x, y, heading = way.at(np.array([station]))[0]
            self._add(prop, (x, y), tall * rng.uniform(0.85, 1.1), heading + np.pi / 2, look)

    def _wood(self) -> None:
        """Trees and bushes on open ground away from the road: gardens, groves, woods."""
        rng, kind = self.rng, self.kind
        share = kind.wood * rng.uniform(0, 1)
        species = [self.looks.draw() for _ in range(int(rng.integers(1, 6)))]
        way, before = self.net.main, len(self.props)
        near = rng.uniform(1.0, 12.0)
        for _ in range(int(share * 220)):
            if len(self.props) - before >= _MOST_TREES:
                return
            side = int(rng.choice([-1, 1]))
            away = way.walk_m(side)[1] + near + (_WOOD_M - near) * rng.random() ** 1.5
            x, y, yaw = way.at(np.array([rng.uniform(-30, 170)]), side * away)[0]
            prop: PropKind = "bush" if rng.random() < 0.3 else "tree"
            tall = rng.uniform(*_HEIGHT_M[prop]) * (1.2 if prop == "tree" else 1.0)
            self._add(prop, (x, y), tall, yaw, species[int(rng.integers(len(species)))], spread=1.0)

    def _lights(self) -> None:
        """Traffic lights and signs at junctions, to the right of who comes and sometimes beyond."""
        rng = self.rng
        look, tall = self.looks.draw(), rng.uniform(*_HEIGHT_M["traffic_light"])
        lit = self.kind.lanes[1] > 1 and rng.random() < 0.6
        for junction in self.net.junctions:
            for stop in junction.stops:
                along = (stop[1] - stop[0]) / max(float(np.linalg.norm(stop[1] - stop[0])), 1e-6)
                facing = np.arctan2(along[1], along[0]) - np.pi / 2
                for out in (0.8, 1.2, 1.8, 3.0, 4.5, 6.5):
                    at = stop[1] + out * along
                    prop: PropKind = "traffic_light" if lit else "sign"
                    if self._add(prop, (at[0], at[1]), tall if lit else 2.6, facing, look):
                        break

    def _cones(self) -> None:
        """Cones along the edge of the lanes ahead: works on the road."""
        rng, way = self.rng, self.net.main
        start, side = float(rng.uniform(8, 30)), int(rng.choice([-1, 1]))
        look, tall = self.looks.draw(), rng.uniform(*_HEIGHT_M["cone"])
        for station in np.arange(start, start + rng.uniform(8, 30), rng.uniform(1.5, 4)):
            away = way.edge_m(side) + 0.15
            x, y, heading = way.at(np.array([station]), side * away)[0]
            point = (round(float(x), 2), round(float(y), 2))
            if not shapely.intersects(self._road_users, shapely.Point(point).buffer(0.4)):
                self.props.append(Prop("cone", point, round(float(tall), 2), round(float(heading), 3), look))

    def _add(
        self,
        kind: PropKind,
        at_m: tuple[float, float],
        height_m: float,
        yaw_rad: float,
        look: int,
        spread: float = 0.0,
    ) -> bool:
        """Place something unless the ground is taken."""
        point = shapely.Point(at_m)
        if shapely.intersects(self._blocked, point.buffer(spread) if spread else point):
            return False
        at = (round(float(at_m[0]), 2), round(float(at_m[1]), 2))
        yaw = float(np.arctan2(np.sin(yaw_rad), np.cos(yaw_rad)))
        self.props.append(Prop(kind, at, round(float(height_m), 2), round(yaw, 3), look))
        return True
