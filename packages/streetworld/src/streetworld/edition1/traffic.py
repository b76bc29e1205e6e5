"""Traffic of edition 1: moving vehicles that never collide, and parked ones."""

from itertools import cycle, islice, product

import numpy as np
import shapely

from dreamdrive.scene.street.layout import Box, BoxKind, Ego, TrackPoint, track_function
from streetworld.engine.road import (
    LANE_M,
    PARKING_M,
    SIDEWALK_M,
    Road,
    RoadNet,
    rectangle_around,
    travelled_m,
)

_STEP_S = 0.2
_EGO_SIZE_M = (4.6, 1.9)
_CAMERA_AHEAD_M = 0.6  # of the middle of the recording car
_CLEAR_M = 0.35
_MOST_TRIES = 400


class Edition1Traffic:
    """Boxes that found a place, each kept clear of all before it."""

    def __init__(
        self, rng: np.random.Generator, net: RoadNet, ego: Ego, speed_m_s: float, seconds: float
    ) -> None:
        self.boxes: list[Box] = []
        self._rng, self._net, self._speed = rng, net, speed_m_s
        self._times = np.arange(-_STEP_S, seconds + 1.01, _STEP_S)
        self._taken: list[list[shapely.Polygon]] = [
            _outlines(ego.track, _EGO_SIZE_M, self._times, -_CAMERA_AHEAD_M)
        ]

    def footprints(self) -> list[shapely.Polygon]:
        """Every place on which a box ever stands."""
        return [outline for outlines in self._taken[1:] for outline in outlines]

    def add_movers(self, count: int | None, zebras: list[shapely.Polygon]) -> None:
        """A vehicle ahead first; then oncoming, overtaking, crossing and walking ones in turn."""
        wanted = int(self._rng.integers(5, 9)) if count is None else count
        turns = [self._ahead, self._oncoming, self._crossing, self._walking, self._overtaking, self._cycling]
        if zebras:
            self._zebra = zebras[0]
            turns.insert(2, self._on_zebra)
        for turn in islice(cycle(turns), _MOST_TRIES):
            if len(self.boxes) < wanted:
                turn()

    def add_parked(self, count: int | None, *, alike: bool) -> None:
        """Vehicles at both kerbs, nearest first; if ``alike``, every second one looks like a moving one."""
        rng = self._rng
        wanted = int(rng.integers(4, 11)) if count is None else count
        models = [box for box in self.boxes if box.kind in ("car", "van")]
        before = len(self.boxes)
        for number in range(_MOST_TRIES):
            if len(self.boxes) - before >= wanted:
                break
            station = self._uniform(2, 18 + 3.0 * wanted + 0.2 * number)
            side = int(rng.choice([-1, 1]))
            place, clear = self._at_kerb(station, side, self._uniform(-0.08, 0.08))
            if alike and models and number % 2 == 0:
                model = models[int(rng.integers(len(models)))]
                kind, size, look = model.kind, model.size_m, model.look
            else:
                kind = "van" if rng.random() < 0.2 else "car"
                size, look = self._size(kind), int(rng.integers(10_000))
            if clear:
                self._add(kind, size, place, look)
        looks = {(box.kind, box.look) for box in self.boxes[:before]}
        if alike and wanted and not any((box.kind, box.look) in looks for box in self.boxes[before:]):
            self._park_one_alike(models or [box for box in self.boxes[:before] if box.kind == "truck"])

    def _park_one_alike(self, models: list[Box]) -> None:
        """At the first kerb with room for what looks like a moving one."""
        for station, side, model in product(np.arange(4.0, 80.0).tolist(), (-1, 1), models):
            place, clear = self._at_kerb(station, side, 0.0)
            if clear and self._add(model.kind, model.size_m, place, model.look):
                return

    def _at_kerb(self, station_m: float, side: int, aside_m: float) -> tuple[list[TrackPoint], bool]:
        """A parking place, and whether it is neither in the junction nor in front of a zebra crossing."""
        main = self._net.roads[0]
        x, y, yaw = main.at(np.array([station_m]), side * (main.half_m - 0.5 * PARKING_M + aside_m))[0]
        place = TrackPoint(0.0, _round(x), _round(y), _round(yaw + (np.pi if side > 0 else 0.0), 4))
        return [place], not self._net.junction.buffer(3.0).contains(shapely.Point(x, y))

    def _uniform(self, low: float, high: float) -> float:
        return float(self._rng.uniform(low, high))

    def _add(
        self, kind: BoxKind, size_m: tuple[float, float, float], track: list[TrackPoint], look: int
    ) -> bool:
        """Keep a box if it is clear of all others at all times."""
        outlines = _outlines(track, (size_m[0] + _CLEAR_M, size_m[1] + _CLEAR_M), self._times)
        for other in self._taken:
            if any(a.intersects(b) for a, b in zip(outlines, other, strict=True)):
                return False
        self._taken.append(outlines)
        name = f"{kind}-{len(self.boxes) + 1}"
        self.boxes.append(Box(id=name, kind=kind, size_m=size_m, track=track, look=look))
        return True

    def _size(self, kind: BoxKind) -> tuple[float, float, float]:
        low, high = {
            "car": ((3.9, 1.74, 1.42), (4.8, 1.9, 1.64)),
            "van": ((4.9, 1.94, 1.9), (5.8, 2.06, 2.5)),
            "truck": ((6.8, 2.3, 2.9), (8.6, 2.4, 3.3)),
            "bicycle": ((1.8, 0.62, 1.78), (1.9, 0.66, 1.9)),
            "pedestrian": ((1.05, 0.76, 1.6), (1.15, 0.8, 1.9)),
        }[kind]
        length, width, height = self._rng.uniform(low, high)
        return _round(length), _round(width), _round(height)

    def _vehicle(self) -> BoxKind:
        return str(self._rng.choice(["car", "car", "car", "van", "truck"]))  # pyright: ignore[reportReturnType]

    def _drive(
        self,
        kind: BoxKind,
        road: Road,
        start_m: float,
        left_m: float,
        speed_m_s: float,
        change_m_s2: float = 0.0,
    ) -> None:
        """Along a road; against its direction if the speed is negative."""
        t = self._times
        stations = start_m + travelled_m(t, speed_m_s, change_m_s2)
        way = road.at(stations, left_m)
        if speed_m_s < 0:
            way[:, 2] += np.pi
        self._add(kind, self._size(kind), to_track(t, way), int(self._rng.integers(10_000)))

    def _ahead(self) -> None:
        road = self._net.roads[0]
        speed = max(self._speed, 4.0) * self._uniform(0.9, 1.25)
        lane = -(road.lanes - 0.5) * LANE_M
        self._drive(self._vehicle(), road, self._uniform(10, 16), lane, speed, self._uniform(-0.8, 0.8))

    def _oncoming(self) -> None:
        road = self._net.roads[0]
        lane = (int(self._rng.integers(road.lanes)) + 0.5) * LANE_M
        self._drive(self._vehicle(), road, self._uniform(16, 55), lane, -self._uniform(5, 10))

    def _overtaking(self) -> None:
        """On the next lane, faster than the recording car; without one, a bicycle that is overtaken."""
        road = self._net.roads[0]
        if road.lanes == 1:
            return self._drive("bicycle", road, self._uniform(7, 16), 0.6 - LANE_M, self._uniform(3.5, 5))
        kind, start_m = self._vehicle(), self._uniform(-4, 4)
        return self._drive(
            kind, road, start_m, -(road.lanes - 1.5) * LANE_M, self._speed + self._uniform(2, 5)
        )

    def _crossing(self) -> None:
        """Across the main road, where there is a crossing."""
        if len(self._net.roads) < 2:
            return
        rng, road = self._rng, self._net.roads[1]
        side = int(rng.choice([-1, 1]))
        lane = -side * (int(rng.integers(road.lanes)) + 0.5) * LANE_M
        self._drive(self._vehicle(), road, -side * self._uniform(6, 22), lane, side * self._uniform(4, 9))

    def _on_zebra(self) -> None:
        frame = rectangle_around(self._zebra)[:4]
        a, b = (frame[0] + frame[1]) / 2, (frame[2] + frame[3]) / 2
        if np.linalg.norm(b - a) < np.linalg.norm(frame[1] - frame[0]):
            a, b = (frame[1] + frame[2]) / 2, (frame[3] + frame[0]) / 2
        if self._rng.random() < 0.5:
            a, b = b, a
        along = (b - a) / np.linalg.norm(b - a)
        start = self._uniform(0.0, 0.6) * float(np.linalg.norm(b - a))
        self._walk(a + start * along, along, self._uniform(1.1, 1.7))

    def _walking(self) -> None:
        rng, road = self._rng, self._net.roads[0]
        side, way = (int(rng.choice([-1, 1])) for _ in range(2))
        left = side * (road.half_m + self._uniform(0.9, SIDEWALK_M - 0.6))
        x, y, heading = road.at(np.array([self._uniform(5, 28)]), left)[0]
        along = way * np.array([np.cos(heading), np.sin(heading)])
        self._walk(np.array([x, y]), along, self._uniform(0.9, 1.7))

    def _walk(self, start: np.ndarray, direction: np.ndarray, speed_m_s: float) -> None:
        place = start + speed_m_s * self._times[:, None] * direction
        yaw = np.full((len(place), 1), np.arctan2(direction[1], direction[0]))
        track = to_track(self._times, np.hstack([place, yaw]))
        self._add("pedestrian", self._size("pedestrian"), track, int(self._rng.integers(10_000)))

    def _cycling(self) -> None:
        road = self._net.roads[0]
        way = -1 if self._rng.random() < 0.5 else 1
        left, speed = -way * (road.lanes * LANE_M - 0.5), way * self._uniform(3.5, 5.5)
        self._drive("bicycle", road, self._uniform(8, 30), left, speed)


def to_track(times_s: np.ndarray, way: np.ndarray) -> list[TrackPoint]:
    """A track from x, y and yaw (T, 3) at times (T,), to the millimetre."""
    return [
        TrackPoint(_round(t), _round(x), _round(y), _round(yaw, 4))
        for t, (x, y, yaw) in zip(times_s, way, strict=True)
    ]


def _round(value: float, digits: int = 3) -> float:
    return round(float(value), digits)


def _outlines(
    track: list[TrackPoint], size_m: tuple[float, float], times_s: np.ndarray, ahead_m: float = 0.0
) -> list[shapely.Polygon]:
    """The rectangle of a box on the ground at some times, its middle ``ahead_m`` of the track."""
    length, width = size_m
    corner = 0.5 * np.array([[length, width], [-length, width], [-length, -width], [length, -width]])
    corner[:, 0] += ahead_m
    outlines: list[shapely.Polygon] = []
    for x, y, yaw in track_function(track)(times_s):
        cos, sin = np.cos(yaw), np.sin(yaw)
        outlines.append(shapely.Polygon(corner @ np.array([[cos, sin], [-sin, cos]]) + [x, y]))
    return outlines
