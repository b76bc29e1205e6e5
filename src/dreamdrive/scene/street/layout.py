"""M_ctrl of the paper: what a map-conditioned prior is told. A map, boxes on tracks and the path of the car.

Map frame: x east, y north, z up with the road at 0, in metres; angles in radians, counted from x towards y.
"""

from collections.abc import Callable
from typing import Annotated, Literal

import msgspec
import numpy as np
from jaxtyping import Float
from msgspec import Meta
from scipy.interpolate import CubicSpline

from dreamdrive.errors import InputError

Metres = Annotated[float, Meta(ge=-100_000, le=100_000)]
Size = Annotated[float, Meta(gt=0, le=1000)]
Seconds = Annotated[float, Meta(ge=-1_000_000, le=1_000_000)]
Angle = Annotated[float, Meta(ge=-1000, le=1000)]
Share = Annotated[float, Meta(ge=0, le=1)]
Appearance = Annotated[
    int, Meta(ge=0, le=1_000_000, description="Appearance: equal numbers of one kind look the same.")
]
Point = Annotated[tuple[Metres, Metres], Meta(description="x and y in metres.")]
Ring = Annotated[
    list[Point], Meta(min_length=3, max_length=10_000, description="Corners of a polygon, not repeated.")
]

AreaKind = Literal["road", "sidewalk", "crossing", "parking", "grass"]
LineKind = Literal["lane_divider", "road_divider", "road_edge", "stop_line"]
BoxKind = Literal["car", "van", "truck", "bicycle", "pedestrian", "bus", "motorcycle"]
PropKind = Literal["tree", "lamp", "sign", "bush", "mast", "traffic_light", "bin", "cone"]
BarrierKind = Literal["fence", "hedge", "wall", "rail"]

FORMAT = 1
EDITIONS = (1, 2)
"""What draws streets. An edition draws the same for ever: whoever changes a picture adds one, as figures of
different editions cannot be compared. The first is that of the benchmarks; the second is far more various:
what the street network is trained on."""
BENCHMARK_EDITION = 1


class _Part(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """What all parts of a layout have in common."""


class Area(_Part, frozen=True):
    """A polygon of the map.

    Attributes:
        kind: What covers it; later areas lie on earlier ones.
        polygon: Its outline.
        holes: Outlines of what is left out.
    """

    kind: AreaKind
    polygon: Ring
    holes: Annotated[list[Ring], Meta(max_length=100)] = []


class Line(_Part, frozen=True):
    """A painted line of the map."""

    kind: LineKind
    points: Annotated[list[Point], Meta(min_length=2, max_length=10_000)]


class TrackPoint(_Part, frozen=True):
    """Where something is at a time: the middle of its footprint and its heading."""

    t_s: Seconds
    x_m: Metres
    y_m: Metres
    yaw_rad: Angle


Track = Annotated[
    list[TrackPoint], Meta(min_length=1, max_length=10_000, description="In the order of time.")
]


class Box(_Part, frozen=True):
    """A road user, standing on the ground.

    Attributes:
        id: Its name, unique in the layout.
        kind: What it is.
        size_m: Length, width and height.
        track: Its path; a single point stands still.
        look: Its appearance.
    """

    id: Annotated[str, Meta(max_length=100)]
    kind: BoxKind
    size_m: tuple[Size, Size, Size]
    track: Track
    look: Appearance = 0


class Building(_Part, frozen=True):
    """A house with upright walls."""

    polygon: Ring
    height_m: Size
    look: Appearance = 0


class Prop(_Part, frozen=True):
    """Something upright beside the road; ``yaw_rad`` is where a lamp's arm or a sign points."""

    kind: PropKind
    at_m: Point
    height_m: Size
    yaw_rad: Angle = 0.0
    look: Appearance = 0


class Barrier(_Part, frozen=True):
    """Something upright that runs along a line. Drawn from edition 2 on."""

    kind: BarrierKind
    points: Annotated[list[Point], Meta(min_length=2, max_length=10_000)]
    height_m: Size
    look: Appearance = 0


class Relief(_Part, frozen=True):
    """Hills and dales: everything of the map is lifted by waves of these heights and lengths.

    The lift is 0 with a level slope at the origin of the map. Drawn from edition 2 on.
    """

    height_m: Annotated[float, Meta(ge=0, le=50)] = 0.0
    length_m: Annotated[float, Meta(ge=20, le=10_000)] = 200.0


class Lens(_Part, frozen=True):
    """How the recording camera looks. Used from edition 2 on; the first edition looks level, 64 degrees wide.

    Attributes:
        hfov_rad: Horizontal field of view.
        pitch_rad: Positive looks down.
        roll_rad: Positive turns the camera clockwise, seen from behind it.
        distortion: k1 of the radial model x (1 + k1 r^2) on the image plane; negative bends like a barrel.
        bonnet: Appearance of the own bonnet at the bottom of the picture; None shows none.
    """

    hfov_rad: Annotated[float, Meta(gt=0.2, lt=2.8)] = 1.117
    pitch_rad: Angle = 0.0
    roll_rad: Angle = 0.0
    distortion: Annotated[float, Meta(ge=-0.5, le=0.5)] = 0.0
    bonnet: Appearance | None = None


class Light(_Part, frozen=True):
    """Weather and camera.

    Attributes:
        sun_azimuth_rad: Where the sun stands.
        sun_elevation_rad: How high.
        sun: Share of the light that comes straight from it; the rest comes from the sky.
        haze_per_m: Light lost along each metre of sight.
        clouds: Share of the sky.
        exposure_drift: Largest relative change of brightness over the drive.
        night: 0 by day, 1 when only lamps and headlights shine. From edition 2 on, as all below.
        wet: Wetness of the road, which then mirrors.
        rain: Streaks in the air and drops on the glass.
        snow: Share of the ground that is white.
        glare: Veil of a low sun or of headlights over the picture.
    """

    sun_azimuth_rad: Angle = 0.9
    sun_elevation_rad: Annotated[float, Meta(gt=0, le=1.5708)] = 0.8
    sun: Share = 0.6
    haze_per_m: Annotated[float, Meta(ge=0, le=1)] = 0.002
    clouds: Share = 0.4
    exposure_drift: Annotated[float, Meta(ge=0, lt=1)] = 0.0
    night: Share = 0.0
    wet: Share = 0.0
    rain: Share = 0.0
    snow: Share = 0.0
    glare: Share = 0.0


class Ego(_Part, frozen=True):
    """The recording car.

    Attributes:
        track: Path of the front camera over the ground.
        camera_height_m: Its height.
        shake_rad: Amplitude of its nod and roll.
    """

    track: Track
    camera_height_m: Size = 1.5
    shake_rad: Annotated[float, Meta(ge=0, lt=0.2)] = 0.0


class Layout(_Part, frozen=True):
    """A street to be drawn.

    Attributes:
        ego: The recording car.
        areas: What covers the ground; grass elsewhere.
        lines: Paint on it.
        boxes: Road users.
        buildings: Houses.
        props: Trees, lamps, signs.
        light: Weather.
        barriers: Fences, hedges, walls, guard rails.
        relief: Hills.
        lens: How the camera looks.
        seed: Decides what nothing above decides, such as the grain of the asphalt.
        edition: Which of ``EDITIONS`` draws it.
        format: Version of this description.
    """

    ego: Ego
    areas: Annotated[list[Area], Meta(max_length=10_000)] = []
    lines: Annotated[list[Line], Meta(max_length=10_000)] = []
    boxes: list[Box] = []
    buildings: Annotated[list[Building], Meta(max_length=10_000)] = []
    props: Annotated[list[Prop], Meta(max_length=10_000)] = []
    light: Light = Light()
    barriers: Annotated[list[Barrier], Meta(max_length=10_000)] = []
    relief: Relief = Relief()
    lens: Lens = Lens()
    seed: Annotated[int, Meta(ge=0, le=2**63 - 1)] = 0
    edition: int = msgspec.field(default_factory=lambda: 1)  # not a default, which is not written
    format: Literal[1] = FORMAT

    def __post_init__(self) -> None:
        check_edition(self.edition)


def check_edition(edition: int) -> None:
    """Raise unless streets are drawn in that edition."""
    if edition not in EDITIONS:
        known = ", ".join(map(str, EDITIONS))
        raise InputError(f"edition {edition} of drawn streets is unknown; there is: {known}")


def track_function(track: list[TrackPoint]) -> Callable[[Float[np.ndarray, " t"]], Float[np.ndarray, "t 3"]]:
    """From times (T,) to x, y in metres and yaw in radians (T, 3): a cubic spline through the points.

    Before the first and after the last point the velocity there continues.
    """
    values = np.array([[p.x_m, p.y_m, p.yaw_rad] for p in track], dtype=np.float64)
    if len(track) == 1:
        return lambda times_s: np.repeat(values, len(times_s), axis=0)
    values[:, 2] = np.unwrap(values[:, 2])
    knots = np.array([p.t_s for p in track])
    spline = CubicSpline(knots, values, bc_type="natural")
    velocity = spline.derivative()

    def poses(times_s: Float[np.ndarray, " t"]) -> Float[np.ndarray, "t 3"]:
        inside = np.clip(times_s, knots[0], knots[-1])
        return spline(inside) + velocity(inside) * (times_s - inside)[:, None]

    return poses


def is_moving(track: list[TrackPoint]) -> bool:
    """Whether a track leads anywhere: by more than 5 cm or 3 degrees."""
    values = np.array([[p.x_m, p.y_m, p.yaw_rad] for p in track])
    spread = np.ptp(values, axis=0)
    return bool(np.hypot(*spread[:2]) > 0.05 or spread[2] > 0.05)
