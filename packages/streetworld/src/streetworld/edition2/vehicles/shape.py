"""The shape of cars, vans, cabs and buses: rings over one another, from the sills to the roof."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from streetworld.edition2.vehicles.parts.loft import ViewSide, loft
from streetworld.engine.mesh import Mesh

_ARCH = 1.13  # of the wheel's radius
_SILL_M = 0.04  # how far sills lie behind the bumpers
_TUNNEL_M = 0.3


@dataclass(frozen=True)
class BodyShape:
    """A closed body. Lengths are metres; places along x count from the middle, ahead is positive.

    Attributes:
        length, width, height: Its box.
        cowl, screen: Lower and upper end of the windscreen.
        roof, deck: Upper and lower end of the rear window.
        nose_z, cowl_z, deck_z, tail_z: Heights of the edge of the bonnet, of the feet of windscreen and rear
            window, and of the rear edge.
        roof_drop: How much lower the roof ends at the back than its highest point.
        clearance: Height of the sills.
        wheel: Radius of the wheels.
        axles: Where they are; the wheel arches are cut there.
        tumble: Width of the roof's edges, of the body's.
        round_plan: Exponent of the superellipse seen from above: 4 is round, 20 a box.
        round_roof: How far the roof's edges are rounded off.
        bulge: How much wider the body is at its middle height than at sills and windows.
    """

    length: float
    width: float
    height: float
    cowl: float
    screen: float
    roof: float
    deck: float
    nose_z: float
    cowl_z: float
    deck_z: float
    tail_z: float
    roof_drop: float
    clearance: float
    wheel: float
    axles: tuple[float, ...]
    tumble: float
    round_plan: float
    round_roof: float
    bulge: float

    def edge(self, x: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Height of the shoulder below the windows, with bonnet and boot, along x."""
        half = 0.5 * self.length
        middle = 0.5 * (self.cowl + half)
        bonnet = 0.45 * self.nose_z + 0.55 * self.cowl_z + 0.015
        knots = [
            (-half, self.tail_z),
            (self.deck - 1e-3, self.deck_z),
            (self.cowl, self.cowl_z),
            (max(middle, self.cowl + 1e-3), bonnet),
            (half, self.nose_z),
        ]
        places, heights = np.array(knots).T
        return np.interp(x, places, heights)

    def rail(self, x: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Height of the upper edge of the windows along x."""
        top = self.height - self.round_roof
        knots = [
            (self.roof, top - self.roof_drop),
            (0.6 * self.roof + 0.4 * self.screen, top),
            (self.screen, top - 0.35 * self.roof_drop - 0.02),
        ]
        places, heights = np.array(knots).T
        return np.interp(x, places, heights)

    def edge_at(self, x: float) -> float:
        """Height of the shoulder at one place."""
        return float(self.edge(np.array([x]))[0])

    def rail_at(self, x: float) -> float:
        """Height of the upper edge of the windows at one place."""
        return float(self.rail(np.array([x]))[0])

    def roof_half(self) -> float:
        """Half of the width at the upper edge of the windows."""
        return 0.5 * self.width * self.tumble

    def foot_half(self) -> float:
        """Half of the width at the lower edge of the windows."""
        return 0.5 * self.width * (1 - 0.6 * self.bulge) - 0.012

    def arch(self, x: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Height of the lower edge of the sides along x."""
        low = np.full(len(x), self.clearance)
        for axle in self.axles:
            inside = (_ARCH * self.wheel) ** 2 - (x - axle) ** 2
            up = self.wheel + np.sqrt(np.maximum(inside, 0))
            low = np.where(inside > 1e-9, np.maximum(up, low), low)
        return low


def _columns(shape: BodyShape) -> tuple[np.ndarray, np.ndarray]:
    """Places of a ring's points from -1 to 1 along x and y, and the side that each piece after them faces."""
    power, half = shape.round_plan, 0.5 * shape.length - _SILL_M
    corner = 0.5 ** (1 / power)
    stations = [-corner, -0.93 * corner, 0.93 * corner, corner]
    for axle in shape.axles:
        reach = _ARCH * shape.wheel / half
        around = axle / half + reach * np.cos(np.linspace(0, np.pi, 7))
        stations += [*around, axle / half - 1.02 * reach, axle / half + 1.02 * reach]
    if len(shape.axles) > 1:
        stations += list(np.linspace(shape.axles[0], shape.axles[-1], 4)[1:-1] / half)
    s = np.unique(np.clip(stations, -corner, corner))
    t = (1 - np.abs(s) ** power) ** (1 / power)
    across = np.array([-0.8, -0.4, 0, 0.4, 0.8]) * corner
    along = (1 - np.abs(across) ** power) ** (1 / power)
    points = [
        np.stack([s, -t], axis=-1),
        np.stack([along, across], axis=-1),
        np.stack([s, t], axis=-1)[::-1],
        np.stack([-along, across], axis=-1)[::-1],
    ]
    side, end = len(s) - 1, len(across) + 1
    faces = [ViewSide.RIGHT] * side + [ViewSide.FRONT] * end + [ViewSide.LEFT] * side + [ViewSide.BACK] * end
    return np.concatenate(points), np.array(faces)


def body_mesh(shape: BodyShape) -> Mesh:
    """The closed body without wheels; materials are those of ``ViewSide``."""
    unit, faces = _columns(shape)
    half, side = 0.5 * shape.length, 0.5 * shape.width
    narrow = 1 - shape.bulge

    def ring(back: float, front: float, width: float, z: np.ndarray | float | None = None) -> np.ndarray:
        points = np.zeros((len(unit), 3))
        points[:, 0] = 0.5 * (back + front) + 0.5 * (front - back) * unit[:, 0]
        points[:, 1] = width * unit[:, 1]
        points[:, 2] = 0.0 if z is None else z
        return points

    sill = ring(_SILL_M - half, half - _SILL_M, side * (1 - 0.5 * shape.bulge))
    sill[:, 2] = shape.arch(sill[:, 0])
    inner = sill * [1, 1 - _TUNNEL_M / side, 1]
    bottom = inner * [1, 0, 0] + [0, 0, shape.clearance]
    bumper = ring(-half, half, side)
    shoulder = shape.edge(bumper[:, 0])
    bumper[:, 2] = np.maximum(0.42 * shoulder + 0.1, sill[:, 2] + 0.01)
    waist = ring(0.01 - half, half - 0.03, side, 0.0)
    waist[:, 2] = np.maximum(0.2 * bumper[:, 2] + 0.8 * shoulder - 0.03, bumper[:, 2] + 0.01)
    edge = ring(0.03 - half, half - 0.09, side * (1 - 0.6 * shape.bulge))
    edge[:, 2] = shape.edge(edge[:, 0])
    rim = ring(
        min(0.08 - half, shape.deck - 0.01), max(half - 0.2, shape.cowl + 0.01), shape.foot_half() + 0.005
    )
    rim[:, 2] = np.maximum(shape.edge(rim[:, 0]) + 0.015, edge[:, 2])
    foot = ring(shape.deck, shape.cowl, shape.foot_half())
    foot[:, 2] = shape.edge(foot[:, 0]) + 0.02
    top = ring(shape.roof, shape.screen, shape.roof_half())
    top[:, 2] = shape.rail(top[:, 0])
    pane = 0.5 * (foot + top) + [0, 0, 0.01]
    pane[:, 1] *= 1 + 0.25 * (1 - shape.tumble) * narrow
    round_ = shape.round_roof
    crown = ring(shape.roof + 1.5 * round_, shape.screen - 1.5 * round_, shape.roof_half() - round_)
    crown[:, 2] = shape.rail(crown[:, 0]) + 0.75 * round_
    ridge = crown * [1, 0.45, 0]
    ridge[:, 2] = shape.rail(ridge[:, 0]) + round_
    spine = ridge * [1, 0, 1]
    dark, upper = np.full(len(faces), ViewSide.UNDER), np.full(len(faces), ViewSide.TOP)
    rings = [bottom, inner, sill, bumper, waist, edge, rim, foot, pane, top, crown, ridge, spine]
    kinds = [dark, dark, faces, faces, faces, upper, upper, faces, faces, upper, upper, upper]
    points = np.stack(rings)
    points[..., 2] *= shape.height / points[..., 2].max()
    return loft(points, np.stack(kinds))
