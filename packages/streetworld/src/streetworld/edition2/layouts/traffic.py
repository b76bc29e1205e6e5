"""Traffic of edition 2: from nobody to a queue in all lanes."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import shapely
from jaxtyping import Float

from dreamdrive.scene.street.layout import Box, BoxKind, Ego, TrackPoint, track_function
from streetworld.edition1.traffic import to_track
from streetworld.edition2.layouts.held_back import Looks
from streetworld.edition2.layouts.kinds import StreetRecipe, chosen
from streetworld.edition2.layouts.occupancy import TakenGround
from streetworld.edition2.layouts.road_user import DrawnRoadUser
from streetworld.edition2.layouts.walkers import walkers
from streetworld.edition2.roads.roads import PARKING_DEPTH_M, PARKING_PITCH_M, PARKING_TURN_RAD, Net, Way
from streetworld.edition2.vehicles.bodies import size_of
from streetworld.engine.road import travelled_m

EGO_SIZE_M = (4.6, 1.9)
CAMERA_AHEAD_M = 0.6  # of the middle of the recording car
STEP_S = 0.2
_CLEAR_M = 0.3
_BEHIND_M, _AHEAD_M = -45.0, 150.0
_MOST = 200
_MOST_PARKED = 70

FlowName = Literal["none", "light", "medium", "dense", "queue", "big queue"]


@dataclass(frozen=True)
class Flow:
    """Traffic of a lane: gaps between bumpers, speed as a share of free speed, share of large vehicles."""

    gap_m: tuple[float, float]
    speed: tuple[float, float]
    large: float = 0.25


FLOWS: dict[FlowName, Flow] = {
    "light": Flow((18.0, 110.0), (0.8, 1.15)),
    "medium": Flow((7.0, 40.0), (0.6, 1.0)),
    "dense": Flow((3.0, 14.0), (0.1, 0.5)),
    "queue": Flow((1.8, 7.0), (0.0, 0.3)),
    "big queue": Flow((1.2, 2.2), (0.0, 0.0), 0.9),
}
_USUAL: dict[FlowName, float] = {"none": 0.1, "light": 0.27, "medium": 0.3, "dense": 0.18, "queue": 0.15}
_QUEUE_M_S = (3.0, 6.0)


@dataclass(frozen=True)
class Pace:
    """A speed that changes for a while."""

    speed_m_s: float
    change_m_s2: float

    def way_m(self, times_s: Float[np.ndarray, " t"]) -> Float[np.ndarray, " t"]:
        """Way gone since time 0."""
        return travelled_m(times_s, self.speed_m_s, self.change_m_s2)


@dataclass
class Edition2Traffic:
    """Fills roads, each road user kept clear of all before it. The ego lane is one of the main road's."""

    rng: np.random.Generator
    looks: Looks
    kind: StreetRecipe
    net: Net
    times_s: Float[np.ndarray, " t"]
    queue: bool
    ego_lane: int
    ego_pace: Pace
    boxes: list[Box] = field(default_factory=list)
    room: TakenGround = field(default_factory=TakenGround)

    def keep_ego(self, ego: Ego) -> None:
        """The ground that the recording car needs."""
        places = track_function(ego.track)(self.times_s)
        places[:, :2] -= CAMERA_AHEAD_M * np.stack([np.cos(places[:, 2]), np.sin(places[:, 2])], axis=-1)
        self.room.take(places, EGO_SIZE_M, firm=True)

    def add_movers(self, count: int | None) -> None:
        """Vehicles in all lanes and people; a number is that of those who ever move, nearest first."""
        start = self.net.main.at(np.zeros(1))[0, :2]
        people = walkers(self.rng, self.kind, self.net, self.times_s, self.looks)
        road_users = [user for user in [*people, *self._vehicles(count)] if count is None or user.moving]
        road_users.sort(key=lambda user: float(np.linalg.norm(user.places[0, :2] - start)))
        # Of people a few go first: nobody could cross a street that is taken already.
        road_users.sort(key=lambda user: not user.first)
        for user in road_users:
            if len(self.boxes) >= (_MOST if count is None else count):
                return
            self._add(user)

    def add_parked(self, count: int | None) -> None:
        """Vehicles at the kerbs, nearest first."""
        start = self.net.main.at(np.array([15.0]))[0, :2]
        road_users = [
            user for way in self.net.ways for side in (-1, 1) for user in self._parked(way, side, count)
        ]
        road_users.sort(key=lambda user: float(np.linalg.norm(user.places[0, :2] - start)))
        wanted = len(self.boxes) + (_MOST_PARKED if count is None else count)
        for user in road_users:
            if len(self.boxes) >= wanted:
                return
            if not shapely.intersects(self.net.crossed, shapely.Point(user.places[0, :2]).buffer(2.0)):
                self._add(user)

    def _add(self, user: DrawnRoadUser) -> None:
        if self.room.take(user.places, user.size_m[:2], _CLEAR_M):
            track = to_track(self.times_s, user.places)
            track = (
                track if user.moving else [TrackPoint(0.0, *(track[0].x_m, track[0].y_m, track[0].yaw_rad))]
            )
            name = f"{user.kind}-{len(self.boxes) + 1}"
            self.boxes.append(Box(name, user.kind, user.size_m, track, user.look))

    def _vehicles(self, count: int | None) -> list[DrawnRoadUser]:
        """Those of all lanes."""
        rng, found = self.rng, list[DrawnRoadUser]()
        for number, way in enumerate(self.net.ways):
            for side in (-1, 1):
                flow: FlowName = "big queue" if self.queue else chosen(rng, _USUAL)
                if count is not None and not self.queue:
                    flow = "medium"
                if number and not self.queue and flow in ("dense", "queue"):
                    flow = "light"
                large = float(rng.uniform(0, 0.5))
                for lane in range(way.side(side).lanes):
                    if flow == "none" and not (number == 0 and side < 0):
                        continue
                    found += self._lane(way, side, lane, FLOWS["light" if flow == "none" else flow], large)
        for junction in self.net.junctions:
            if count is None and rng.random() < 0.6:
                found += self._waiting(junction.other)
        return found

    def _pace(self, way: Way, side: int, flow: Flow) -> Pace:
        if self.queue:
            return Pace(float(self.rng.uniform(*_QUEUE_M_S)), float(self.rng.uniform(-0.2, 0.2)))
        free = float(self.rng.uniform(*self.kind.speed_m_s))
        speed = free * float(self.rng.uniform(*flow.speed))
        return Pace(speed if speed > 0.4 else 0.0, float(self.rng.uniform(-0.5, 0.5)) * (speed > 2))

    def _lane(self, way: Way, side: int, lane: int, flow: Flow, large: float) -> list[DrawnRoadUser]:
        """One behind the other, all at the same pace; in the recording car's lane about that car."""
        rng = self.rng
        large = max(large, flow.large) if self.queue else large
        if way is self.net.main and side < 0 and lane == self.ego_lane:
            front = 0.5 * EGO_SIZE_M[0] - CAMERA_AHEAD_M + (1.1 if self.queue else 0.0)
            pace = self.ego_pace
            ahead = self._chain(way, side, lane, flow, large, pace, (front, _AHEAD_M))
            return ahead + self._chain(way, side, lane, flow, large, pace, (-EGO_SIZE_M[0], _BEHIND_M))
        reach = max(way.start_m + 3, _BEHIND_M), min(way.end_m - 3, _AHEAD_M)
        start = reach[0] + float(rng.uniform(0, flow.gap_m[1]))
        return self._chain(way, side, lane, flow, large, self._pace(way, side, flow), (start, reach[1]))

    def _chain(
        self,
        way: Way,
        side: int,
        lane: int,
        flow: Flow,
        large: float,
        pace: Pace,
        reach_m: tuple[float, float],
    ) -> list[DrawnRoadUser]:
        """Vehicles from one station on, ahead or backwards."""
        rng, found = self.rng, list[DrawnRoadUser]()
        station, end = reach_m
        sense = 1 if end > station else -1
        while sense * (end - station) > 0:
            kind = self._vehicle(large, way.section.lane_m)
            look = self.looks.draw()
            size = size_of(kind, look)
            station += sense * (float(rng.uniform(*flow.gap_m)) + 0.5 * size[0])
            aside = float(rng.normal(0, 0.12))
            if kind == "bicycle":
                aside = side * (0.5 * way.section.lane_m - 0.6)
            left = way.lane_m(side, lane) + aside
            user = self._along(way, kind, size, look, station, left, -side, pace)
            station += sense * 0.5 * size[0]
            found += [user] if user is not None else []
        return found

    def _along(
        self,
        way: Way,
        kind: BoxKind,
        size: tuple[float, float, float],
        look: int,
        station_m: float,
        left_m: float,
        sense: int,
        pace: Pace,
    ) -> DrawnRoadUser | None:
        """Along a road, or against it; None if that leads beyond its ends."""
        stations = station_m + sense * pace.way_m(self.times_s)
        if stations.min() < way.start_m or stations.max() > way.end_m:
            return None
        places = way.at(stations, left_m)
        places[:, 2] += 0.0 if sense > 0 else np.pi
        return DrawnRoadUser(kind, size, look, places)

    def _waiting(self, way: Way) -> list[DrawnRoadUser]:
        """Vehicles that wait to cross the main road."""
        end = int(self.rng.choice([-1, 1]))
        near = max(self.net.main.kerb_m(s) for s in (-1, 1)) + 6.0
        stop = end * near
        found: list[DrawnRoadUser] = []
        for lane in range(way.side(end).lanes):
            reach = stop, stop + end * float(self.rng.uniform(6, 30))
            if way.start_m < reach[1] < way.end_m:
                found += self._chain(way, end, lane, FLOWS["queue"], 0.2, Pace(0.0, 0.0), reach)
        return found

    def _vehicle(self, large: float, lane_m: float) -> BoxKind:
        """A kind of vehicle; ``large`` is the share of those that one cannot see past."""
        rng = self.rng
        if rng.random() < large * (lane_m > 2.6):
            return chosen(rng, {"van": 0.4, "truck": 0.35, "bus": 0.25})
        if self.queue:
            return "car"
        fast = self.kind.speed_m_s[0] > 15
        return chosen(rng, {"car": 0.86, "motorcycle": 0.07, "bicycle": 0.0 if fast else 0.07})

    def _parked(self, way: Way, side: int, count: int | None) -> list[DrawnRoadUser]:
        """Vehicles on the places of one kerb."""
        rng, parking = self.rng, way.side(side).parking
        if parking == "none":
            return []
        share = float(rng.uniform(0.15, 1.0)) if count is None else 1.0
        pitch, turn = PARKING_PITCH_M[parking], PARKING_TURN_RAD[parking]
        found: list[DrawnRoadUser] = []
        backwards = rng.random() < 0.4
        for station in np.arange(max(way.start_m + 4, -25.0), min(way.end_m - 4, 90.0), pitch):
            if rng.random() > share:
                continue
            kind: BoxKind = chosen(rng, {"car": 0.86, "van": 0.12, "truck": 0.02 * (parking == "parallel")})
            look = self.looks.draw()
            size = size_of(kind, look)
            away = way.kerb_m(side) - 0.5 * PARKING_DEPTH_M[parking] + float(rng.uniform(-0.12, 0.15))
            if parking != "parallel" and size[0] > PARKING_DEPTH_M[parking] + 0.4:
                continue
            place = way.at(np.array([station + rng.uniform(-0.2, 0.2)]), side * away)
            flip = np.pi * ((side > 0) != (backwards and rng.random() < 0.5))
            place[:, 2] += side * turn + flip * (parking == "parallel") + rng.normal(0, 0.02)
            place[:, 2] += np.pi * (parking != "parallel" and rng.random() < 0.3)
            found.append(DrawnRoadUser(kind, size, look, np.repeat(place, len(self.times_s), axis=0)))
        return found
