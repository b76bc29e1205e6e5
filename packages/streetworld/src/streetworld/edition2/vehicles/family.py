"""Families of cars or vans by their side profile: what of a body is where."""

from dataclasses import dataclass

from streetworld.edition2.layouts.variants import Draw
from streetworld.edition2.vehicles.shape import BodyShape

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
        tumble, round_plan, round_roof_m, roof_drop_m, bulge: See ``BodyShape``.
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

    def shape(self, draw: Draw, size_m: tuple[float, float, float]) -> BodyShape:
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
        return BodyShape(
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


Families = tuple[tuple[float, Family], ...]
"""Families with their shares."""
