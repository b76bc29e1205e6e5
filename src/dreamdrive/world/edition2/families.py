"""Families of cars and vans by their side profiles: what of a body is where."""

from dataclasses import dataclass, replace

from dreamdrive.world.edition2.draw import Draw
from dreamdrive.world.edition2.shape import Shape

Range = tuple[float, float]


@dataclass(frozen=True)
class Family:
    """Bodies alike. Places are shares of the length from the front, heights shares of the height.

    Attributes:
        name: What people call it.
        length_m, width_m, height_m: Ranges of its size.
        cowl, screen, roof, deck: Lower and upper end of the windscreen, upper and lower of the rear window.
        axles: Front and rear.
        nose_z, cowl_z, deck_z, tail_z: Of the bonnet's front edge, the feet of both windows, the rear edge.
        panes: Side windows as shares of the band of windows.
        doors: Hinged from and to, as ``panes``, and whether it slides.
        wheel_m, clearance_m: Radius of the wheels, height of the sills.
        tumble, round_plan, round_roof_m, roof_drop_m, bulge: See ``Shape``.
        clad: How often the lower edge is of dark plastic.
        tails: Which tail lamps fit.
    """

    name: str
    length_m: Range
    width_m: Range
    height_m: Range
    cowl: float
    screen: float
    roof: float
    deck: float
    axles: tuple[float, ...]
    nose_z: float
    cowl_z: float
    deck_z: float
    tail_z: float
    panes: tuple[Range, ...]
    doors: tuple[tuple[float, float, bool], ...]
    wheel_m: Range = (0.30, 0.34)
    clearance_m: Range = (0.16, 0.21)
    tumble: float = 0.76
    round_plan: float = 5.5
    round_roof_m: float = 0.07
    roof_drop_m: float = 0.05
    bulge: float = 0.07
    clad: float = 0.1
    tails: tuple[int, ...] = (0, 1, 3, 4, 6)

    def size(self, draw: Draw) -> tuple[float, float, float]:
        """Length, width and height of one."""
        share = draw.between(0, 1)
        low, high = self.length_m
        length = low + share * (high - low)
        width = self.width_m[0] + (0.6 * share + 0.4 * draw.rng.random()) * (
            self.width_m[1] - self.width_m[0]
        )
        return length, width, float(draw.rng.uniform(*self.height_m))

    def shape(self, draw: Draw, size_m: tuple[float, float, float]) -> Shape:
        """One of the family, as large as a box."""
        length, width, height = size_m
        rng = draw.rng
        wheel = min(float(rng.uniform(*self.wheel_m)), 0.27 * height)

        def along(share: float, spread: float = 0.012) -> float:
            return (0.5 - share + float(rng.normal(0, spread))) * length

        def up(share: float) -> float:
            return (share + float(rng.normal(0, 0.012))) * height

        cowl, screen, roof = along(self.cowl), along(self.screen), along(self.roof)
        deck = max(along(self.deck, 0.006), -0.492 * length)
        lift = float(rng.normal(0, 0.01)) * height
        return Shape(
            length=length,
            width=width,
            height=height,
            cowl=cowl,
            screen=min(screen, cowl - 0.02 * length),
            roof=max(roof, deck + 0.01 * length),
            deck=deck,
            nose_z=up(self.nose_z),
            cowl_z=self.cowl_z * height + lift,
            deck_z=self.deck_z * height + lift,
            tail_z=min(up(self.tail_z), self.deck_z * height + lift),
            roof_drop=self.roof_drop_m * float(rng.uniform(0.5, 1.4)),
            clearance=float(rng.uniform(*self.clearance_m)),
            wheel=wheel,
            axles=tuple(along(a, 0.004) for a in self.axles),
            tumble=min(0.985, self.tumble + float(rng.normal(0, 0.012))),
            round_plan=self.round_plan * float(rng.uniform(0.85, 1.2)),
            round_roof=self.round_roof_m * float(rng.uniform(0.8, 1.25)),
            bulge=self.bulge * float(rng.uniform(0.6, 1.4)),
        )


_FOUR = ((0.0, 0.46, False), (0.5, 0.86, False))
_TWO = ((0.0, 0.6, False),)
_SALOON = Family(
    "saloon",
    (4.35, 4.95),
    (1.75, 1.88),
    (1.41, 1.49),
    cowl=0.285,
    screen=0.435,
    roof=0.715,
    deck=0.865,
    axles=(0.185, 0.775),
    nose_z=0.49,
    cowl_z=0.655,
    deck_z=0.70,
    tail_z=0.68,
    panes=((0.06, 0.47), (0.5, 0.83), (0.845, 0.92)),
    doors=_FOUR,
)
_HATCH = replace(
    _SALOON,
    name="hatchback",
    length_m=(3.85, 4.4),
    width_m=(1.68, 1.82),
    height_m=(1.44, 1.54),
    cowl=0.26,
    screen=0.41,
    roof=0.88,
    deck=0.965,
    axles=(0.2, 0.81),
    cowl_z=0.64,
    deck_z=0.65,
    tail_z=0.64,
    panes=((0.06, 0.47), (0.5, 0.82)),
    tails=(0, 1, 2, 4, 6),
)
_ESTATE = replace(
    _HATCH,
    name="estate",
    length_m=(4.45, 4.98),
    width_m=(1.76, 1.88),
    height_m=(1.44, 1.54),
    cowl=0.265,
    screen=0.4,
    roof=0.9,
    deck=0.975,
    axles=(0.19, 0.77),
    panes=((0.05, 0.37), (0.4, 0.67), (0.7, 0.92)),
    doors=((0.0, 0.37, False), (0.4, 0.7, False)),
)
_SUV = replace(
    _HATCH,
    name="sport utility",
    length_m=(4.25, 4.95),
    width_m=(1.8, 1.98),
    height_m=(1.6, 1.78),
    cowl=0.265,
    screen=0.385,
    roof=0.89,
    deck=0.965,
    axles=(0.19, 0.785),
    nose_z=0.56,
    cowl_z=0.655,
    deck_z=0.66,
    tail_z=0.64,
    panes=((0.05, 0.42), (0.45, 0.76), (0.79, 0.93)),
    doors=((0.0, 0.42, False), (0.45, 0.8, False)),
    wheel_m=(0.34, 0.38),
    clearance_m=(0.2, 0.26),
    tumble=0.79,
    clad=0.6,
)
_CARS = (
    (0.16, _SALOON),
    (0.19, _HATCH),
    (0.1, _ESTATE),
    (0.19, _SUV),
    (
        0.04,
        replace(
            _SUV,
            name="off-roader",
            length_m=(4.0, 4.9),
            height_m=(1.78, 1.96),
            cowl=0.3,
            screen=0.36,
            roof=0.955,
            deck=0.985,
            nose_z=0.55,
            cowl_z=0.6,
            deck_z=0.6,
            tail_z=0.58,
            tumble=0.86,
            round_plan=10.0,
            roof_drop_m=0.01,
            bulge=0.04,
            wheel_m=(0.37, 0.41),
            tails=(1, 5),
        ),
    ),
    (
        0.05,
        replace(
            _SUV,
            name="pickup",
            length_m=(4.95, 5.6),
            width_m=(1.82, 2.02),
            height_m=(1.74, 1.9),
            cowl=0.24,
            screen=0.345,
            roof=0.555,
            deck=0.60,
            axles=(0.165, 0.775),
            nose_z=0.56,
            cowl_z=0.625,
            deck_z=0.63,
            tail_z=0.62,
            panes=((0.08, 0.5), (0.54, 0.92)),
            doors=((0.0, 0.5, False), (0.54, 0.98, False)),
            tumble=0.8,
            round_plan=8.0,
            roof_drop_m=0.03,
            tails=(1, 5),
        ),
    ),
    (
        0.04,
        replace(
            _SALOON,
            name="coupe",
            length_m=(4.2, 4.75),
            height_m=(1.27, 1.39),
            cowl=0.33,
            screen=0.475,
            roof=0.67,
            deck=0.905,
            axles=(0.19, 0.78),
            nose_z=0.48,
            deck_z=0.71,
            tail_z=0.68,
            panes=((0.07, 0.55), (0.58, 0.82)),
            doors=_TWO,
            tumble=0.72,
            clearance_m=(0.12, 0.16),
            tails=(0, 3, 4),
        ),
    ),
    (
        0.07,
        replace(
            _HATCH,
            name="minivan",
            length_m=(4.3, 4.95),
            width_m=(1.78, 1.95),
            height_m=(1.62, 1.82),
            cowl=0.185,
            screen=0.36,
            roof=0.91,
            deck=0.975,
            axles=(0.185, 0.8),
            nose_z=0.48,
            cowl_z=0.6,
            deck_z=0.61,
            tail_z=0.59,
            panes=((0.02, 0.1), (0.12, 0.42), (0.45, 0.7), (0.73, 0.94)),
            doors=((0.1, 0.43, False), (0.46, 0.72, True)),
            tumble=0.8,
            tails=(0, 1, 2),
        ),
    ),
    (
        0.03,
        replace(
            _SALOON,
            name="old saloon",
            length_m=(4.05, 4.75),
            width_m=(1.62, 1.76),
            height_m=(1.37, 1.45),
            cowl=0.32,
            screen=0.405,
            roof=0.69,
            deck=0.77,
            nose_z=0.54,
            cowl_z=0.61,
            deck_z=0.61,
            tail_z=0.59,
            tumble=0.83,
            round_plan=12.0,
            round_roof_m=0.05,
            roof_drop_m=0.01,
            bulge=0.03,
            wheel_m=(0.28, 0.31),
            tails=(0, 1, 3),
        ),
    ),
    (
        0.07,
        replace(
            _HATCH,
            name="city car",
            length_m=(3.0, 3.7),
            width_m=(1.55, 1.68),
            height_m=(1.44, 1.58),
            cowl=0.19,
            screen=0.37,
            roof=0.9,
            deck=0.975,
            axles=(0.175, 0.835),
            nose_z=0.5,
            cowl_z=0.61,
            deck_z=0.62,
            tail_z=0.6,
            panes=((0.05, 0.58), (0.61, 0.88)),
            doors=((0.0, 0.58, False),),
            wheel_m=(0.27, 0.3),
            tails=(0, 1, 2),
        ),
    ),
    (
        0.06,
        replace(
            _SALOON,
            name="limousine",
            length_m=(4.9, 5.3),
            width_m=(1.86, 1.95),
            height_m=(1.45, 1.53),
            cowl=0.29,
            screen=0.42,
            roof=0.73,
            deck=0.865,
            axles=(0.175, 0.785),
            wheel_m=(0.34, 0.37),
        ),
    ),
)
_CARS_KEPT_OUT = (
    (
        0.4,
        replace(
            _SALOON,
            name="fastback",
            length_m=(4.3, 4.95),
            height_m=(1.38, 1.46),
            roof=0.62,
            deck=0.93,
            deck_z=0.67,
            tail_z=0.66,
            panes=((0.06, 0.46), (0.49, 0.78)),
            tumble=0.74,
            tails=(0, 4, 6),
        ),
    ),
    (
        0.35,
        replace(
            _SUV,
            name="utility coupe",
            height_m=(1.54, 1.66),
            roof=0.70,
            deck=0.935,
            deck_z=0.7,
            tail_z=0.67,
            panes=((0.05, 0.46), (0.49, 0.8)),
            doors=((0.0, 0.46, False), (0.49, 0.85, False)),
        ),
    ),
    (
        0.25,
        replace(
            _HATCH,
            name="box car",
            length_m=(3.2, 3.7),
            width_m=(1.47, 1.62),
            height_m=(1.62, 1.84),
            cowl=0.135,
            screen=0.25,
            roof=0.955,
            deck=0.985,
            axles=(0.17, 0.86),
            nose_z=0.47,
            cowl_z=0.56,
            deck_z=0.55,
            tail_z=0.53,
            panes=((0.03, 0.42), (0.45, 0.72), (0.75, 0.95)),
            doors=((0.0, 0.42, False), (0.45, 0.74, True)),
            tumble=0.88,
            round_plan=9.0,
            roof_drop_m=0.01,
            wheel_m=(0.27, 0.3),
            tails=(1, 2, 5),
        ),
    ),
)
_PANEL = Family(
    "panel van",
    (5.0, 6.9),
    (1.93, 2.08),
    (2.2, 2.75),
    cowl=0.12,
    screen=0.25,
    roof=0.985,
    deck=0.993,
    axles=(0.165, 0.79),
    nose_z=0.42,
    cowl_z=0.48,
    deck_z=0.48,
    tail_z=0.47,
    panes=((0.015, 0.23),),
    doors=((0.01, 0.23, False), (0.27, 0.5, True)),
    wheel_m=(0.33, 0.37),
    clearance_m=(0.2, 0.28),
    tumble=0.9,
    round_plan=11.0,
    round_roof_m=0.12,
    roof_drop_m=0.02,
    bulge=0.03,
    clad=0.5,
    tails=(1, 5),
)
_SMALL_VAN = replace(
    _PANEL,
    name="small van",
    length_m=(4.15, 4.75),
    width_m=(1.75, 1.9),
    height_m=(1.78, 1.95),
    cowl=0.22,
    screen=0.37,
    axles=(0.195, 0.8),
    nose_z=0.48,
    cowl_z=0.57,
    deck_z=0.57,
    tail_z=0.55,
    panes=((0.03, 0.36),),
    doors=((0.0, 0.36, False), (0.4, 0.7, True)),
    wheel_m=(0.3, 0.33),
    tumble=0.87,
    tails=(1, 2, 5),
)
_WINDOWED = ((0.015, 0.23), (0.26, 0.48), (0.51, 0.73), (0.76, 0.96))
_VANS = (
    (0.3, _PANEL),
    (0.25, _SMALL_VAN),
    (0.15, replace(_SMALL_VAN, name="family van", panes=((0.03, 0.36), (0.39, 0.67), (0.7, 0.94)))),
    (0.12, replace(_PANEL, name="minibus", panes=_WINDOWED)),
    (
        0.18,
        replace(
            _PANEL,
            name="people carrier",
            length_m=(4.85, 5.35),
            width_m=(1.88, 2.0),
            height_m=(1.88, 2.02),
            cowl=0.185,
            screen=0.3,
            roof=0.965,
            deck=0.985,
            axles=(0.185, 0.79),
            nose_z=0.48,
            cowl_z=0.56,
            deck_z=0.56,
            tail_z=0.54,
            panes=((0.02, 0.3), (0.33, 0.62), (0.65, 0.94)),
            doors=((0.0, 0.3, False), (0.34, 0.62, True)),
            tumble=0.86,
            tails=(1, 2),
        ),
    ),
)
_VANS_KEPT_OUT = (
    (
        1.0,
        replace(
            _PANEL,
            name="step van",
            length_m=(5.6, 7.2),
            width_m=(2.05, 2.2),
            height_m=(2.6, 3.0),
            cowl=0.07,
            screen=0.12,
            nose_z=0.36,
            cowl_z=0.42,
            deck_z=0.42,
            tail_z=0.41,
            panes=((0.02, 0.14),),
            doors=((0.02, 0.15, True),),
            tumble=0.97,
            round_plan=18.0,
            round_roof_m=0.07,
            tails=(3, 5),
        ),
    ),
)


def family_of(draw: Draw) -> Family:
    """The family of a car's or van's look; those of looks kept out are others than those of the rest."""
    table = (_CARS_KEPT_OUT if draw.kept_out else _CARS) if draw.kind == "car" else None
    if table is None:
        table = _VANS_KEPT_OUT if draw.kept_out else _VANS
    total = sum(share for share, _ in table)
    at = draw.rng.random() * total
    for share, family in table:
        at -= share
        if at <= 0:
            return family
    return table[-1][1]
