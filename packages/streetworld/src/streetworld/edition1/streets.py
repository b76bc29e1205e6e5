"""Layouts of edition 1 drawn at random: streets, houses and traffic that a seed decides."""

import numpy as np
import shapely

from dreamdrive.scene.street.layout import Building, Ego, Layout, Light, Prop
from streetworld.edition1.traffic import Edition1Traffic, to_track
from streetworld.engine.road import (
    LANE_M,
    MOST_M_S,
    SIDEWALK_M,
    Road,
    RoadNet,
    bent_road,
    crossing_road,
    travelled_m,
)
from streetworld.options import StreetOptions

_EGO_STEP_S = 0.1
_LEAST_EGO_M_S = 1.0
_AFTER_S = 1.2  # for which traffic goes on behind the end


def draw_street(seed: int, options: StreetOptions) -> Layout:
    """A street with houses, trees, parked and moving road users; equal seeds give equal streets.

    One street of three is straight, one bends and one crosses another; in those of an
    even seed some parked vehicles look the same as moving ones.
    """
    rng = np.random.default_rng(seed)
    net = _roads(rng, seed, max(MOST_M_S, options.speed_m_s or 0) * (options.seconds + _AFTER_S))
    speed = float(rng.uniform(6, 10)) if options.speed_m_s is None else options.speed_m_s
    ego = _ego(rng, net.roads[0], speed, options)
    zebras = _zebras(rng, net)
    traffic = Edition1Traffic(rng, net, ego, speed, options.seconds)
    traffic.add_movers(options.movers, zebras)
    traffic.add_parked(options.parked, alike=seed % 2 == 0)
    houses = _houses(rng, net)
    return Layout(
        ego=ego,
        areas=net.areas(zebras),
        lines=net.lines(),
        boxes=traffic.boxes,
        buildings=houses,
        props=_props(rng, net, houses, traffic.footprints()),
        light=_light(rng),
        seed=seed,
        edition=options.edition,
    )


def _roads(rng: np.random.Generator, seed: int, way_m: float) -> RoadNet:
    kind = ("straight", "bend", "crossing")[seed % 3]
    lanes = int(rng.integers(1, 3))
    bend = float(rng.choice([-1, 1]) / rng.uniform(45, 110)) if kind == "bend" else 0.0
    main = bent_road(bend, float(rng.uniform(0, 12)), lanes, way_m)
    if kind != "crossing":
        return RoadNet.of((main,), None)
    station = float(rng.uniform(26, 40))
    angle = np.pi / 2 + float(rng.uniform(-0.2, 0.2))
    other = crossing_road(main, station, angle, int(rng.integers(1, 3)), way_m)
    return RoadNet.of((main, other), station)


def _ego(rng: np.random.Generator, road: Road, speed_m_s: float, options: StreetOptions) -> Ego:
    """In the rightmost lane, with a mild sway, gently slower or faster."""
    times = np.arange(0, options.seconds + 2 * _EGO_STEP_S, _EGO_STEP_S)
    lane = -(road.lanes - 0.5) * LANE_M
    sway, phase, rate = 0.2, float(rng.uniform(0, 2 * np.pi)), 1.1
    change = float(rng.uniform(-0.8, 0.8)) if speed_m_s > 3 else 0.0
    stations = travelled_m(times, speed_m_s, change, _LEAST_EGO_M_S)
    if speed_m_s > 0:
        sway *= np.minimum(1.0, stations / 2)
    left = lane + sway * np.sin(rate * times + phase) * (speed_m_s > 0)
    way = road.at(stations, left)
    if speed_m_s > 0:
        velocity = np.gradient(way[:, :2], times, axis=0)
        way[:, 2] = np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0]))
    return Ego(
        track=to_track(times, way),
        camera_height_m=options.camera_height_m,
        shake_rad=round(float(rng.uniform(0.002, 0.006)), 4),
    )


def _zebras(rng: np.random.Generator, net: RoadNet) -> list[shapely.Polygon]:
    main = net.roads[0]
    if net.crossing_m is not None:
        start = net.crossing_m - net.roads[1].half_m - 2.6
    elif rng.random() < 0.5:
        start = float(rng.uniform(16, 40))
    else:
        return []
    return [main.strip(-main.half_m, main.half_m, start, start + 2.2)]


def _houses(rng: np.random.Generator, net: RoadNet) -> list[Building]:
    """Rows of houses along all roads, with gaps in some streets."""
    open_ground = net.paved.union(net.walks).buffer(0.3)
    dense, looks = float(rng.uniform(0.7, 1.0)), int(rng.integers(4, 9))
    taken: list[shapely.Polygon] = []
    houses: list[Building] = []
    for road in net.roads:
        for side in (-1, 1):
            setback = float(rng.uniform(0.4, 3.5))
            station = road.start_m
            while station < road.end_m - 20:
                wide, deep = float(rng.uniform(9, 17)), float(rng.uniform(8, 13))
                near = side * (road.half_m + SIDEWALK_M + setback)
                outline = road.block(station, wide, near, near + side * deep)
                station += wide + (0.0 if rng.random() < dense else float(rng.uniform(4, 12)))
                height, look = float(rng.uniform(6, 18)), int(rng.integers(looks))
                if outline.intersects(open_ground) or any(outline.overlaps(other) for other in taken):
                    continue
                taken.append(outline.buffer(-0.05))
                ring = [(round(float(x), 2), round(float(y), 2)) for x, y in outline.exterior.coords[:-1]]
                look += 100 * net.roads[0].lanes
                houses.append(Building(polygon=ring, height_m=round(height, 1), look=look))
    return houses


def _props(
    rng: np.random.Generator, net: RoadNet, houses: list[Building], boxes: list[shapely.Polygon]
) -> list[Prop]:
    """Lamps and trees along the kerbs, signs at some places; none on the road, in a house or in a box."""
    standing = [net.paved, *(shapely.Polygon(house.polygon) for house in houses), *boxes]
    blocked = shapely.union_all(standing).buffer(0.25)
    shapely.prepare(blocked)
    props: list[Prop] = []
    trees, kinds = float(rng.uniform(0.0, 0.9)), int(rng.integers(2, 4))
    for road in net.roads:
        for side in (-1, 1):
            for station in np.arange(road.start_m + 3, road.end_m - 3, 8.0):
                station = float(station + rng.uniform(-2, 2))
                away = road.half_m + float(rng.uniform(0.6, 1.1))
                x, y, heading = road.at(np.array([station]), side * away)[0]
                draw = rng.random()
                if blocked.contains(shapely.Point(x, y)):
                    continue
                at, yaw = (round(float(x), 2), round(float(y), 2)), float(heading - side * np.pi / 2)
                if draw < 0.2:
                    props.append(Prop("lamp", at, round(float(rng.uniform(6, 8)), 1), round(yaw, 3)))
                elif draw < 0.28:
                    yaw = float(heading + (np.pi if side < 0 else 0.0))
                    props.append(Prop("sign", at, 2.6, round(yaw, 3), int(rng.integers(20))))
                elif rng.random() < trees:
                    look = int(rng.integers(kinds)) + 10 * int(rng.integers(5))
                    props.append(Prop("tree", at, round(float(rng.uniform(5, 9)), 1), round(yaw, 3), look))
    return props


def _light(rng: np.random.Generator) -> Light:
    return Light(
        sun_azimuth_rad=round(float(rng.uniform(-np.pi, np.pi)), 3),
        sun_elevation_rad=round(float(rng.uniform(0.4, 1.1)), 3),
        sun=round(float(rng.uniform(0.15, 0.85)), 3),
        haze_per_m=round(float(rng.uniform(0.0008, 0.005)), 5),
        clouds=round(float(rng.uniform(0.1, 0.8)), 3),
        exposure_drift=round(float(rng.uniform(0.0, 0.08)), 3),
    )
