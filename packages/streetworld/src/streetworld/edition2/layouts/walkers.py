"""People on foot: along sidewalks, alone and in groups, at kerbs and across the road."""

import numpy as np
import shapely
from jaxtyping import Float

from streetworld.edition2.layouts.held_back import Looks
from streetworld.edition2.layouts.kinds import StreetRecipe
from streetworld.edition2.layouts.road_user import DrawnRoadUser
from streetworld.edition2.roads.roads import Net, Way
from streetworld.edition2.vehicles.bodies import size_of
from streetworld.engine.road import rectangle_around

_ABREAST_M = 0.95
_STATIONS_M = (-12.0, 60.0)


def walkers(
    rng: np.random.Generator, kind: StreetRecipe, net: Net, times_s: Float[np.ndarray, " t"], looks: Looks
) -> list[DrawnRoadUser]:
    """All who go on foot, in groups of one to four."""
    left = int(rng.integers(kind.walkers[0], kind.walkers[1] + 1))
    found: list[DrawnRoadUser] = []
    while left > 0:
        together = min(left, int(rng.choice([1, 1, 1, 2, 2, 3, 4])))
        left -= together
        draw = rng.random()
        zebra = net.zebras[int(rng.integers(len(net.zebras)))] if net.zebras else None
        if zebra is not None and draw < 0.3:
            start, along, speed = _across(rng, zebra, waiting=draw < 0.1)
        elif draw > 0.94 and kind.speed_m_s[0] < 15:
            start, along, speed = _over_the_road(rng, net.main)
        else:
            start, along, speed = _beside(rng, net)
        first = 0.1 <= draw < 0.3 or draw > 0.94
        for number in range(together):
            look = looks.draw()
            size = size_of("pedestrian", look)
            aside = np.array([-along[1], along[0]]) * (_ABREAST_M * (number - 0.5 * (together - 1)))
            at = start + aside + along * rng.uniform(-0.4, 0.4)
            place = at + speed * times_s[:, None] * along
            turn = float(np.arctan2(along[1], along[0])) + (rng.uniform(-2, 2) if speed == 0 else 0.0)
            yaw = np.full((len(times_s), 1), turn)
            found.append(DrawnRoadUser("pedestrian", size, look, np.hstack([place, yaw]), first))
    return found


Walk = tuple[np.ndarray, np.ndarray, float]
"""Where somebody starts, in which direction, and how fast."""


def _across(rng: np.random.Generator, zebra: shapely.Polygon, *, waiting: bool) -> Walk:
    frame = rectangle_around(zebra)[:4]
    a, b = (frame[0] + frame[1]) / 2, (frame[2] + frame[3]) / 2
    if np.linalg.norm(b - a) < np.linalg.norm(frame[1] - frame[0]):
        a, b = (frame[1] + frame[2]) / 2, (frame[3] + frame[0]) / 2
    if rng.random() < 0.5:
        a, b = b, a
    long = float(np.linalg.norm(b - a))
    along = (b - a) / long
    if waiting:
        return a - rng.uniform(0.6, 1.2) * along, along, 0.0
    return a + rng.uniform(-0.1, 0.8) * long * along, along, float(rng.uniform(0.9, 1.8))


def _over_the_road(rng: np.random.Generator, way: Way) -> Walk:
    side = int(rng.choice([-1, 1]))
    x, y, heading = way.at(np.array([rng.uniform(12, 50)]), side * rng.uniform(0, way.kerb_m(side)))[0]
    along = -side * np.array([-np.sin(heading), np.cos(heading)])
    return np.array([x, y]), along, float(rng.uniform(1.0, 2.0))


def _beside(rng: np.random.Generator, net: Net) -> Walk:
    """On a sidewalk, or on the road's edge where there is none; a quarter stand."""
    way = net.main if rng.random() < 0.8 else net.ways[int(rng.integers(len(net.ways)))]
    side, sense = (int(rng.choice([-1, 1])) for _ in range(2))
    near, far = way.walk_m(side)
    margin = min(0.5, 0.5 * (far - near))
    away = rng.uniform(near + margin, far - margin) if far - near > 0.7 else near + rng.uniform(0.2, 1.5)
    station = rng.uniform(max(way.start_m, _STATIONS_M[0]), min(way.end_m, _STATIONS_M[1]))
    x, y, heading = way.at(np.array([station]), side * away)[0]
    along = sense * np.array([np.cos(heading), np.sin(heading)])
    return np.array([x, y]), along, 0.0 if rng.random() < 0.25 else float(rng.uniform(0.7, 1.8))
