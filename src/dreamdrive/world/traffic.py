"""Who uses a drawn street: traffic that never collides, and parked vehicles."""

import numpy as np
import shapely

from dreamdrive.scene.layout import Box, BoxKind, Ego, TrackPoint, track_function
from dreamdrive.world.road import (
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


class Traffic:
    """Boxes, each kept clear of all before it.

    Attributes:
        boxes: Those that found a place.
    """

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
        tries = 0
        while len(self.boxes) < wanted and tries < _MOST_TRIES:
            turns[tries % len(turns)]()
            tries += 1

    def add_parked(self, count: int | None, *, alike: bool) -> None:
        """Vehicles at both kerbs, nearest first; if ``alike``, every second one looks like a moving one."""
        rng, main = self._rng, self._net.roads[0]
        wanted = int(rng.integers(4, 11)) if count is None else count
        models = [box for box in self.boxes if box.kind in ("car", "van")]
        before = len(self.boxes)
        for number in range(_MOST_TRIES):
            if len(self.boxes) - before >= wanted:
                break
            station = float(rng.uniform(2, 18 + 3.0 * wanted + 0.2 * number))
            side = int(rng.choice([-1, 1]))
            left = side * (main.half_m - 0.5 * PARKING_M + float(rng.uniform(-0.08, 0.08)))
            x, y, yaw = main.at(np.array([station]), left)[0]
            place = [TrackPoint(0.0, _round(x), _round(y), _round(yaw + (np.pi if side > 0 else 0.0), 4))]
            if alike and models and number % 2 == 0:
                model = models[int(rng.integers(len(models)))]
                kind, size, look = model.kind, model.size_m, model.look
            else:
                kind = "van" if rng.random() < 0.2 else "car"
                size, look = self._size(kind), int(rng.integers(10_000))
            # Not in the junction, nor in front of a zebra crossing.
            if self._net.junction.buffer(3.0).contains(shapely.Point(x, y)):
                continue
            self._add(kind, size, place, look)
        looks = {(box.kind, box.look) for box in self.boxes[:before]}
        if alike and wanted and not any((box.kind, box.look) in looks for box in self.boxes[before:]):
            self._park_one_alike(models or [box for box in self.boxes[:before] if box.kind == "truck"])

    def _park_one_alike(self, models: list[Box]) -> None:
        """At the first kerb with room for what looks like a moving one."""
        main = self._net.roads[0]
        for station in np.arange(4.0, 80.0) if models else ():
            for side, model in ((side, model) for side in (-1, 1) for model in models):
                x, y, yaw = main.at(np.array([station]), side * (main.half_m - 0.5 * PARKING_M))[0]
                turned = _round(yaw + (np.pi if side > 0 else 0.0), 4)
                clear = not self._net.junction.buffer(3.0).contains(shapely.Point(x, y))
                place = [TrackPoint(0.0, _round(x), _round(y), turned)]
                if clear and self._add(model.kind, model.size_m, place, model.look):
                    return

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
        rng, road = self._rng, self._net.roads[0]
        speed = max(self._speed, 4.0) * float(rng.uniform(0.9, 1.25))
        lane = -(road.lanes - 0.5) * LANE_M
        self._drive(
            self._vehicle(), road, float(rng.uniform(10, 16)), lane, speed, float(rng.uniform(-0.8, 0.8))
        )

    def _oncoming(self) -> None:
        rng, road = self._rng, self._net.roads[0]
        lane = (int(rng.integers(road.lanes)) + 0.5) * LANE_M
        self._drive(self._vehicle(), road, float(rng.uniform(16, 55)), lane, -float(rng.uniform(5, 10)))

    def _overtaking(self) -> None:
        """On the next lane, faster than the recording car; without one, a bicycle that is overtaken."""
        rng, road = self._rng, self._net.roads[0]
        if road.lanes == 1:
            return self._drive(
                "bicycle", road, float(rng.uniform(7, 16)), 0.6 - LANE_M, float(rng.uniform(3.5, 5))
            )
        return self._drive(
            self._vehicle(),
            road,
            float(rng.uniform(-4, 4)),
            -(road.lanes - 1.5) * LANE_M,
            self._speed + float(rng.uniform(2, 5)),
        )

    def _crossing(self) -> None:
        """Across the main road, where there is a crossing."""
        if len(self._net.roads) < 2:
            return
        rng, road = self._rng, self._net.roads[1]
        side = int(rng.choice([-1, 1]))
        lane = -side * (int(rng.integers(road.lanes)) + 0.5) * LANE_M
        self._drive(
            self._vehicle(), road, -side * float(rng.uniform(6, 22)), lane, side * float(rng.uniform(4, 9))
        )

    def _on_zebra(self) -> None:
        rng = self._rng
        frame = rectangle_around(self._zebra)[:4]
        a, b = (frame[0] + frame[1]) / 2, (frame[2] + frame[3]) / 2
        if np.linalg.norm(b - a) < np.linalg.norm(frame[1] - frame[0]):
            a, b = (frame[1] + frame[2]) / 2, (frame[3] + frame[0]) / 2
        if rng.random() < 0.5:
            a, b = b, a
        along = (b - a) / np.linalg.norm(b - a)
        start = float(rng.uniform(0.0, 0.6)) * float(np.linalg.norm(b - a))
        self._walk(a + start * along, along, float(rng.uniform(1.1, 1.7)))

    def _walking(self) -> None:
        rng, road = self._rng, self._net.roads[0]
        side, way = (int(rng.choice([-1, 1])) for _ in range(2))
        left = side * (road.half_m + float(rng.uniform(0.9, SIDEWALK_M - 0.6)))
        x, y, heading = road.at(np.array([float(rng.uniform(5, 28))]), left)[0]
        self._walk(
            np.array([x, y]), way * np.array([np.cos(heading), np.sin(heading)]), float(rng.uniform(0.9, 1.7))
        )

    def _walk(self, start: np.ndarray, direction: np.ndarray, speed_m_s: float) -> None:
        place = start + speed_m_s * self._times[:, None] * direction
        yaw = np.full((len(place), 1), np.arctan2(direction[1], direction[0]))
        track = to_track(self._times, np.hstack([place, yaw]))
        self._add("pedestrian", self._size("pedestrian"), track, int(self._rng.integers(10_000)))

    def _cycling(self) -> None:
        rng, road = self._rng, self._net.roads[0]
        against = bool(rng.random() < 0.5)
        left = (1 if against else -1) * (road.lanes * LANE_M - 0.5)
        speed = float(rng.uniform(3.5, 5.5))
        self._drive("bicycle", road, float(rng.uniform(8, 30)), left, -speed if against else speed)


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
