"""Who comes into conflict with the ego, in each kind of scenario."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.street.layout import Box, BoxKind
from dreamdrive.tasks.plan import CAR
from dreamdrive_bench.planning.ego import EgoWay, Swerve, smooth
from dreamdrive_bench.planning.footprints import FRONT_M, REAR_M
from dreamdrive_bench.planning.protocol import Kind, Protocol
from dreamdrive_bench.planning.streets import Street
from streetworld import LANE_M, PARKING_M, Road, to_track

_TRACK_STEP_S = 0.1
_SIZES: dict[BoxKind, tuple[tuple[float, float, float], tuple[float, float, float]]] = {
    "car": ((3.9, 1.74, 1.42), (4.8, 1.9, 1.64)),
    "van": ((4.9, 1.94, 1.9), (5.8, 2.06, 2.5)),
    "truck": ((6.8, 2.3, 2.9), (8.6, 2.4, 3.3)),
    "bicycle": ((1.8, 0.62, 1.78), (1.9, 0.66, 1.9)),
    "pedestrian": ((1.05, 0.76, 1.6), (1.15, 0.8, 1.9)),
}
_LOOKS = 10_000
_LEAST_CHANGE_M = 15.0  # of the way over which a lane is changed: nobody turns by more than 23 degrees


@dataclass(frozen=True)
class Conflict:
    """Road users of a conflict, the foremost first, and how the ego swerves around them, if it does."""

    boxes: tuple[Box, ...]
    swerve: Swerve | None = None


@dataclass(frozen=True)
class Stage:
    """What a conflict is drawn from."""

    rng: np.random.Generator
    street: Street
    ego: EgoWay
    protocol: Protocol

    @property
    def times_s(self) -> Float[np.ndarray, " t"]:
        """Of the points of tracks: a little longer than anybody looks."""
        return np.arange(-2, round((self.protocol.end_s + 0.2) / _TRACK_STEP_S) + 1) * _TRACK_STEP_S

    @property
    def front_m(self) -> float:
        """Station of the front of the ego at the instant."""
        return self.ego.now_m + FRONT_M

    def uniform(self, low: float, high: float) -> float:
        """A number between two."""
        return float(self.rng.uniform(low, high))

    def vehicle(self) -> BoxKind:
        """Mostly a car."""
        return ("car", "car", "car", "van", "truck")[int(self.rng.integers(5))]

    def size(self, kind: BoxKind) -> tuple[float, float, float]:
        """Length, width and height, as drawn streets have them."""
        length, width, height = self.rng.uniform(*_SIZES[kind])
        return round(float(length), 3), round(float(width), 3), round(float(height), 3)

    def box(
        self,
        kind: BoxKind,
        size_m: tuple[float, float, float],
        way: Float[np.ndarray, "t 3"],
        times_s: Float[np.ndarray, " t"],
        number: int = 1,
    ) -> Box:
        """A road user on its way."""
        look = int(self.rng.integers(_LOOKS))
        return Box(id=f"actor-{number}", kind=kind, size_m=size_m, track=to_track(times_s, way), look=look)

    def standing(
        self, kind: BoxKind, size_m: tuple[float, float, float], place: Float[np.ndarray, "3"], number: int
    ) -> Box:
        """A road user that stays where it is."""
        return self.box(kind, size_m, place[None], np.zeros(1), number)


def along(
    road: Road, stations: Float[np.ndarray, " t"], left_m: float | Float[np.ndarray, " t"]
) -> Float[np.ndarray, "t 3"]:
    """Poses (T, 3) of who drives along a road, pointing as it moves, or as the road where it stands."""
    lefts = np.broadcast_to(np.asarray(left_m, float), stations.shape)
    poses = road.at(stations, lefts)
    ahead, aside = np.gradient(stations), np.gradient(lefts)
    moves = np.abs(ahead) > 1e-3
    # Where it stands it points as it did last, or as it will first.
    turn = np.arctan2(aside[moves], ahead[moves])
    if len(turn):
        poses[:, 2] += np.interp(np.arange(len(stations)), np.flatnonzero(moves), turn)
    return poses


def stopped(stage: Stage) -> Conflict | None:
    """The end of a queue, or somebody who is double-parked."""
    speed, lane = stage.ego.now_m_s, stage.street.lane_left_m
    rear = stage.front_m + stage.uniform(speed**2 / 8 + 0.4 * speed + 1.0, 2.7 * speed)
    queue = stage.rng.random() < 0.6
    boxes: list[Box] = []
    for number in range(1, 1 + (int(stage.rng.integers(1, 4)) if queue else 1)):
        kind = stage.vehicle() if queue else ("van", "car", "truck")[int(stage.rng.integers(3))]
        size = stage.size(kind)
        left = lane + (stage.uniform(-0.25, 0.25) if queue else stage.uniform(-0.8, -0.3))
        if stage.street.in_junction(rear, rear + size[0]):
            return None
        place = stage.street.main.at(np.array([rear + size[0] / 2]), left)[0]
        place[2] += stage.uniform(-0.03, 0.03)
        boxes.append(stage.standing(kind, size, place, number))
        rear += size[0] + stage.uniform(1.2, 3.0)
    return Conflict(tuple(boxes))


def slowing(stage: Stage) -> Conflict:
    """A lead that brakes, and goes on braking until it stands."""
    kind, speed = stage.vehicle(), stage.ego.now_m_s
    size, braking, then = stage.size(kind), stage.uniform(1.5, 3.8), speed * stage.uniform(0.85, 1.1)
    began = min(stage.uniform(0.4, 1.3), (then - 1.5) / braking)  # it still moves at the instant

    def way(since_s: Float[np.ndarray, " t"]) -> Float[np.ndarray, " t"]:
        brakes = np.clip(since_s + began, 0, then / braking)
        return then * np.minimum(since_s + began, 0) + then * brakes - braking * brakes**2 / 2

    rear = stage.front_m + stage.uniform(0.5, 2.0) * speed
    middle = rear + size[0] / 2 + way(stage.times_s - stage.protocol.instant_s) - way(np.zeros(1))
    left = stage.street.lane_left_m + stage.uniform(-0.25, 0.25)
    return Conflict((stage.box(kind, size, along(stage.street.main, middle, left), stage.times_s),))


def crossing(stage: Stage) -> Conflict | None:
    """Somebody who crosses at the junction, at constant speed."""
    road = stage.street.other
    if road is None:
        return None
    way = 1 if stage.rng.random() < 0.5 else -1
    kind: BoxKind = "bicycle" if stage.rng.random() < 0.2 else stage.vehicle()
    size, speed = stage.size(kind), stage.uniform(2.2, 6.5)
    left = -way * (int(stage.rng.integers(road.lanes)) + 0.5) * LANE_M
    # Where the ego's lane is, and when it comes there.
    meets = (stage.street.lane_left_m - left * np.cos(road.headings[0])) / np.sin(road.headings[0])
    lane_m = float(road.at(np.array([meets]), left)[0, 0])
    arrives = stage.protocol.instant_s + (lane_m - stage.front_m) / stage.ego.now_m_s
    late = stage.uniform(-0.9, 0.9)
    stations = meets + way * speed * (stage.times_s - arrives - late)
    poses = road.at(stations, left)
    poses[:, 2] += 0.0 if way > 0 else np.pi
    return Conflict((stage.box(kind, size, poses, stage.times_s),))


def walking(stage: Stage) -> Conflict:
    """Somebody on foot who crosses the road at constant speed."""
    ego, size = stage.ego, stage.size("pedestrian")
    arrives = stage.uniform(1.3, 2.8)
    x, y, heading = stage.street.main.at(
        np.array([stage.front_m + ego.now_m_s * arrives]), stage.street.lane_left_m
    )[0]
    side = 1 if stage.rng.random() < 0.5 else -1
    yaw = heading + side * (np.pi / 2 + stage.uniform(-0.25, 0.25))
    since = stage.times_s - stage.protocol.instant_s - arrives - stage.uniform(-0.7, 0.7)
    way = stage.uniform(0.9, 1.9) * since
    poses = np.column_stack([x + way * np.cos(yaw), y + way * np.sin(yaw), np.full(len(way), yaw)])
    return Conflict((stage.box("pedestrian", size, poses, stage.times_s),))


def cut_in(stage: Stage) -> Conflict | None:
    """Somebody who has begun to come into the lane, from the next one or from the kerb, and is slower."""
    from_kerb = stage.street.main.lanes == 1 or stage.rng.random() < 0.4
    return _from_kerb(stage) if from_kerb else _from_next_lane(stage)


def _from_next_lane(stage: Stage) -> Conflict:
    kind = stage.vehicle()
    size, speed = stage.size(kind), stage.ego.now_m_s * stage.uniform(0.4, 0.75)
    since = stage.times_s - stage.protocol.instant_s
    lasts = max(stage.uniform(2.2, 3.4), _LEAST_CHANGE_M / speed)
    began = stage.uniform(0.2, 0.4) * lasts
    middle = stage.front_m + stage.uniform(0.2, 1.5) * stage.ego.now_m_s + size[0] / 2 + speed * since
    left = stage.street.lane_left_m + LANE_M * (1 - smooth(np.clip((since + began) / lasts, 0, 1)))
    return Conflict((stage.box(kind, size, along(stage.street.main, middle, left), stage.times_s),))


def _from_kerb(stage: Stage) -> Conflict | None:
    kind: BoxKind = "van" if stage.rng.random() < 0.25 else "car"
    size, faster = stage.size(kind), stage.uniform(0.8, 2.0)
    began, most = stage.uniform(0.7, 1.6), stage.uniform(3.0, 5.5)
    rolls = np.clip(stage.times_s - stage.protocol.instant_s + began, 0, None)
    gains = np.minimum(rolls, most / faster)
    way = faster * gains**2 / 2 + most * (rolls - gains)
    then = stage.front_m + stage.uniform(0.5, 2.4) * stage.ego.now_m_s + size[0] / 2
    left = stage.street.lane_left_m - (LANE_M + PARKING_M) / 2
    left = left + (LANE_M + PARKING_M) / 2 * smooth(np.clip(way / stage.uniform(9.5, 13.5), 0, 1))
    if stage.street.in_junction(then - size[0] / 2, then + size[0] / 2):
        return None
    return Conflict((stage.box(kind, size, along(stage.street.main, then + way, left), stage.times_s),))


def parked(stage: Stage) -> Conflict | None:
    """One or two who stick out into the lane; there is room to drive by."""
    street, speed = stage.street, stage.ego.now_m_s
    first = rear = stage.front_m + stage.uniform(1.3, 2.6) * speed
    out = 0.0
    boxes: list[Box] = []
    for number in range(1, int(stage.rng.integers(2, 4))):
        kind: BoxKind = "van" if stage.rng.random() < 0.3 else "car"
        size, sticks, turn = stage.size(kind), stage.uniform(0.6, 1.5), stage.uniform(-0.06, 0.06)
        if street.in_junction(rear, rear + size[0]):
            return None
        left = street.lane_left_m - LANE_M / 2 + sticks - size[1] / 2 - abs(turn) * size[0] / 2
        place = street.main.at(np.array([rear + size[0] / 2]), left)[0]
        place[2] += turn
        boxes.append(stage.standing(kind, size, place, number))
        rear += size[0] + stage.uniform(1.0, 2.5)
        out = max(out, sticks)
    shift = CAR.width_m / 2 - LANE_M / 2 + out + stage.uniform(0.55, 0.9)
    there = first - FRONT_M - 0.3
    swerve = Swerve(
        shift, stage.ego.now_m, there, rear - REAR_M, rear - REAR_M + stage.uniform(1.6, 2.4) * speed
    )
    return Conflict(tuple(boxes), swerve)


def nobody(stage: Stage) -> Conflict:
    """Only who is in the street anyway."""
    return Conflict(())


CONFLICTS: dict[Kind, Callable[[Stage], Conflict | None]] = {
    "stopped": stopped,
    "slowing": slowing,
    "crossing": crossing,
    "walking": walking,
    "cut_in": cut_in,
    "parked": parked,
    "clear": nobody,
}
