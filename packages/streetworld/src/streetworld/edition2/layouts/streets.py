"""Layouts of the second edition, drawn at random: kinds of streets, traffic, weather, hills, lenses."""

from dataclasses import replace

import numpy as np
import shapely
from msgspec.structs import replace as changed

from dreamdrive.scene.street.layout import (
    Area,
    Barrier,
    Box,
    Building,
    Ego,
    Layout,
    Lens,
    Line,
    Point,
    Prop,
    TrackPoint,
)
from streetworld.edition1.traffic import to_track
from streetworld.edition2.layouts.held_back import FIRST_TRAINING_SEED, Looks
from streetworld.edition2.layouts.kinds import KINDS, StreetRecipe, chosen
from streetworld.edition2.layouts.traffic import STEP_S, Edition2Traffic, Pace
from streetworld.edition2.layouts.weather import draw_light, draw_relief
from streetworld.edition2.roads.roads import (
    Junction,
    Middle,
    Net,
    Parking,
    RoadSide,
    Section,
    Way,
    branch,
    junction,
    winding,
)
from streetworld.edition2.roadside.roadside import Sides
from streetworld.options import StreetKind, StreetOptions

_AFTER_S = 1.2  # for which traffic goes on behind the end
_EGO_STEP_S = 0.1
_BEHIND_M, _SIGHT_M, _FAR_SIGHT_M = 60.0, 190.0, 320.0
_CROSSING_M = 95.0
_ON_THE_LEFT = 0.2
"""Share of streets on which traffic keeps to the left: they are drawn as mirror images."""
_QUEUE_KINDS: dict[StreetKind, float] = {"city": 0.5, "avenue": 0.5}
_QUEUE_M_S = (3.5, 5.5)
_HFOV, _QUEUE_HFOV = (50.0, 95.0), (56.0, 72.0)


def draw_street(seed: int, options: StreetOptions) -> Layout:
    """A street of the second edition; equal seeds give equal streets."""
    rng = np.random.default_rng([seed, 22])
    looks = Looks(rng, kept_out=seed < FIRST_TRAINING_SEED)
    queue = options.traffic == "queue"
    name = options.kind or chosen(rng, _QUEUE_KINDS if queue else {k: v.share for k, v in KINDS.items()})
    kind = _queued(KINDS[name]) if queue else KINDS[name]
    most_m_s = max(options.speed_m_s or 0.0, kind.speed_m_s[1] * 1.2)
    net = _draw_net(rng, name, kind, most_m_s * (options.seconds + _AFTER_S))
    pace = _ego_pace(rng, kind, options, queue=queue)
    lanes = net.main.side(-1).lanes
    lane = 0 if queue else int(rng.integers(lanes))
    ego = _ego(rng, net.main, lane, pace, options)
    times = np.arange(-STEP_S, options.seconds + 1.01, STEP_S)
    traffic = Edition2Traffic(rng, looks, kind, net, times, queue, lane, pace)
    traffic.keep_ego(ego)
    traffic.add_movers(options.movers)
    traffic.add_parked(options.parked)
    sides = Sides(rng, looks, kind, net)
    sides.build_houses()
    sides.build_barriers()
    sides.place_props(shapely.union_all(traffic.room.covered()).buffer(0.1))
    layout = Layout(
        ego=ego,
        areas=net.areas(net.zebras),
        lines=net.lines(),
        boxes=traffic.boxes,
        buildings=sides.houses,
        props=sides.props,
        light=draw_light(rng, fair=queue),
        barriers=sides.barriers,
        relief=draw_relief(rng),
        lens=draw_lens(rng, looks, _QUEUE_HFOV if queue else _HFOV),
        seed=looks.grain(seed),
        edition=options.edition,
    )
    return _mirrored(layout) if rng.random() < _ON_THE_LEFT else layout


def _queued(kind: StreetRecipe) -> StreetRecipe:
    """A kind of street as narrow as it takes to be full of vehicles, without junctions that part them."""
    middles: dict[Middle, float] = {"dashed": 0.3, "solid": 0.7}
    return replace(
        kind, lanes=(2, 3), one_way=0.0, lane_m=(2.9, 3.1), middles=middles, block_m=None, walkers=(0, 8)
    )


def draw_lens(rng: np.random.Generator, looks: Looks, hfov_deg: tuple[float, float]) -> Lens:
    """A dashcam behind the glass: without distortion, as a street is driven through with a known camera."""
    return Lens(
        hfov_rad=round(float(np.deg2rad(rng.uniform(*hfov_deg))), 4),
        pitch_rad=round(float(rng.normal(0, np.deg2rad(2))), 4),
        roll_rad=round(float(rng.normal(0, np.deg2rad(0.5))), 4),
        bonnet=looks.draw() if rng.random() < 1 / 3 else None,
    )


def _draw_net(rng: np.random.Generator, name: StreetKind, kind: StreetRecipe, way_m: float) -> Net:
    section = _draw_section(rng, kind)
    sight = _FAR_SIGHT_M if name == "motorway" else _SIGHT_M
    line = winding(rng, kind.radius_m, kind.winding, max(_BEHIND_M, 0.8 * way_m), way_m + sight)
    main = Way(*line, section)
    corner = float(rng.uniform(2.0, 7.0))
    if name == "parking":
        return Net(main, (), _rows(rng, main), corner, "parking")
    junctions: list[Junction] = []
    station = float(rng.uniform(18, kind.block_m[1])) if kind.block_m else np.inf
    while kind.block_m is not None and station < min(way_m + 60, main.end_m - 40):
        junctions.append(_draw_junction(rng, kind, main, station))
        gap = float(rng.uniform(*kind.block_m))
        station += max(gap, 3.0 * (main.kerb_m(-1) + main.kerb_m(1)))
    return Net(main, tuple(junctions), (), corner)


def _draw_section(rng: np.random.Generator, kind: StreetRecipe, most_lanes: int = 9) -> Section:
    """What lies across a road of a kind."""
    low, high = kind.lanes
    lanes = [min(most_lanes, int(rng.integers(low, high + 1))) for _ in range(2)]
    if rng.random() < 0.75:
        lanes[1] = lanes[0]
    one_way = rng.random() < kind.one_way
    middle = "none" if one_way else chosen(rng, kind.middles)
    raised = middle in ("grass", "paved", "rail")
    middle_m = float(np.exp(rng.uniform(np.log(0.8), np.log(7.0)))) if raised else 0.0
    walks = rng.random() < kind.walk
    verge = float(rng.uniform(0.8, 3.0)) if rng.random() < kind.verge else 0.0
    shoulder = float(rng.uniform(*kind.shoulder_m))
    parkings: list[Parking] = [chosen(rng, kind.parkings) for _ in range(2)]
    sides = [
        RoadSide(
            count,
            shoulder,
            parking,
            verge if walks else 0.0,
            float(rng.uniform(*kind.walk_m)) if walks and rng.random() < 0.93 else 0.0,
        )
        for count, parking in zip([lanes[0], 0 if one_way else lanes[1]], parkings, strict=True)
    ]
    lane_m = float(rng.uniform(*kind.lane_m))
    marked, edges = rng.random() < kind.marked, rng.random() < kind.edges
    return Section(sides[0], sides[1], lane_m, middle, middle_m, marked, edges)


def _draw_junction(rng: np.random.Generator, kind: StreetRecipe, main: Way, station_m: float) -> Junction:
    """A crossing or a road that leads away to one side."""
    section = _draw_section(rng, kind, most_lanes=3 if kind.lanes[1] > 2 else 2)
    section = replace(section, middle_m=0.0, middle="none" if section.middle_m else section.middle)
    angle = np.pi / 2 + float(rng.normal(0, 0.15))
    reach = [_CROSSING_M, _CROSSING_M]
    if rng.random() < 0.4:
        reach[int(rng.integers(2))] = 0.0
    other = branch(main, station_m, angle, section, (reach[0], reach[1]))
    walks = main.side(-1).walk_m + main.side(1).walk_m > 0
    zebra = walks and rng.random() < 0.6
    return junction(rng, main, station_m, other, zebra=zebra, stop=rng.random() < 0.7)


def _rows(rng: np.random.Generator, main: Way) -> tuple[Way, ...]:
    """Further aisles of a car park beside the first."""
    pitch = main.kerb_m(-1) + main.kerb_m(1)
    found: list[Way] = []
    for number in range(1, int(rng.integers(2, 4))):
        for side in (-1, 1):
            if rng.random() < 0.8:
                stations = main.start_m + np.arange(len(main.points))
                points = main.at(stations, side * number * pitch)[:, :2]
                found.append(Way(points, main.headings, main.start_m, main.section))
    return tuple(found)


def _ego_pace(rng: np.random.Generator, kind: StreetRecipe, options: StreetOptions, *, queue: bool) -> Pace:
    free = float(rng.uniform(*(_QUEUE_M_S if queue else kind.speed_m_s)))
    slow = 1.0 if queue or rng.random() < 0.65 else float(rng.uniform(0.2, 0.9))
    speed = free * slow if options.speed_m_s is None else options.speed_m_s
    return Pace(speed, float(rng.uniform(-0.5, 0.5)) * (speed > 3) * (not queue))


def _ego(rng: np.random.Generator, main: Way, lane: int, pace: Pace, options: StreetOptions) -> Ego:
    """In a lane, with a mild sway."""
    times = np.arange(0, options.seconds + 2 * _EGO_STEP_S, _EGO_STEP_S)
    stations = pace.way_m(times)
    sway, phase = float(rng.uniform(0, 0.2)), float(rng.uniform(0, 2 * np.pi))
    grown = np.minimum(1.0, stations / 2) * (pace.speed_m_s > 0)
    way = main.at(stations, main.lane_m(-1, lane) + sway * grown * np.sin(1.1 * times + phase))
    if pace.speed_m_s > 0:
        velocity = np.gradient(way[:, :2], times, axis=0)
        way[:, 2] = np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0]))
    return Ego(
        track=to_track(times, way),
        camera_height_m=options.camera_height_m,
        shake_rad=round(float(rng.uniform(0.002, 0.006)), 4),
    )


def _mirrored(layout: Layout) -> Layout:
    """The same with left and right exchanged."""

    def flip(points: list[Point]) -> list[Point]:
        return [(x, -y) for x, y in points]

    def track(points: list[TrackPoint]) -> list[TrackPoint]:
        return [TrackPoint(p.t_s, p.x_m, -p.y_m, -p.yaw_rad) for p in points]

    def area(a: Area) -> Area:
        return changed(a, polygon=flip(a.polygon), holes=[flip(h) for h in a.holes])

    def prop(p: Prop) -> Prop:
        return changed(p, at_m=(p.at_m[0], -p.at_m[1]), yaw_rad=-p.yaw_rad)

    def line(p: Line) -> Line:
        return changed(p, points=flip(p.points))

    def barrier(p: Barrier) -> Barrier:
        return changed(p, points=flip(p.points))

    def house(p: Building) -> Building:
        return changed(p, polygon=flip(p.polygon))

    def box(p: Box) -> Box:
        return changed(p, track=track(p.track))

    return changed(
        layout,
        ego=changed(layout.ego, track=track(layout.ego.track)),
        areas=[area(a) for a in layout.areas],
        lines=[line(p) for p in layout.lines],
        boxes=[box(b) for b in layout.boxes],
        buildings=[house(h) for h in layout.buildings],
        props=[prop(p) for p in layout.props],
        barriers=[barrier(b) for b in layout.barriers],
    )
