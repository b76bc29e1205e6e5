"""Wheels of cars, vans, trucks and buses."""

import cv2
import numpy as np

from dreamdrive.scene.level import pitched
from streetworld.edition2.layouts.variants import Draw
from streetworld.edition2.vehicles.parts.body_materials import Coats
from streetworld.edition2.vehicles.parts.loft import smooth
from streetworld.edition2.vehicles.shape import BodyShape
from streetworld.engine.bodies import Part, Turn
from streetworld.engine.mesh import Mesh, cylinder
from streetworld.engine.paint import Image

_RIMS = 10


def rolling(at_m: tuple[float, float, float], radius_m: float) -> Turn:
    """How a wheel turns about its axle."""
    return lambda way_m: pitched(at_m, way_m / radius_m)


def rim(draw: Draw, radius_share: float) -> Image:
    """Tyre, rim and spokes seen from the side; the rim's radius as a share of the tyre's."""
    rng, size, middle = draw.rng, 64, 31.5
    image = np.full((size, size, 3), 30, dtype=np.uint8)
    design = draw.option(range(_RIMS))
    tone = float(draw.any_of((196, 178, 150, 120, 60, 40)))
    metal = (tone, tone, 1.02 * tone)
    radius = radius_share * 32

    def disc(r: float, colour: tuple[float, float, float]) -> None:
        cv2.circle(image, (round(16 * middle), round(16 * middle)), round(16 * r), colour, -1, cv2.LINE_AA, 4)

    disc(31.5, (26, 26, 28))
    disc(0.93 * 31.5, (36, 36, 38))
    disc(radius, metal)
    disc(0.92 * radius, (34, 34, 37) if design not in (2, 5) else (0.8 * tone, 0.8 * tone, 0.8 * tone))
    count = (5, 10, 0, 7, 6, 0, 5, 12, 4, 9)[design]
    thick = (6, 2, 0, 3, 4, 0, 3, 2, 8, 3)[design]
    for turn in np.arange(count) * 2 * np.pi / max(count, 1) + rng.uniform(0, 1):
        for shift in (-0.14, 0.14) if design in (3, 6, 9) else (0.0,):
            tip = [round(16 * (middle + 0.93 * radius * f(turn + shift))) for f in (np.cos, np.sin)]
            cv2.line(image, (round(16 * middle),) * 2, tuple(tip), metal, thick, cv2.LINE_AA, 4)
    if design in (2, 5):
        for turn in np.arange(8) * np.pi / 4:
            spot = [round(16 * (middle + 0.62 * radius * f(turn))) for f in (np.cos, np.sin)]
            cv2.circle(image, tuple(spot), 16 * (2 if design == 2 else 1), (40, 40, 42), -1, cv2.LINE_AA, 4)
    disc(0.24 * radius, metal)
    disc(0.15 * radius, (70, 70, 74))
    return image


def wheels(draw: Draw, shape: BodyShape, coats: Coats, width_m: float = 0.21) -> list[Part]:
    """A pair on each axle of a body."""
    face = coats.picture(rim(draw, float(draw.rng.uniform(0.62, 0.76))), 0.03)
    return wheel_pairs(shape.axles, shape.wheel, shape.width, (coats.even(27), face), width_m)


def wheel_pairs(
    axles: tuple[float, ...], radius_m: float, track_m: float, materials: tuple[int, int], width_m: float
) -> list[Part]:
    """Pairs of wheels with a tyre and a face, ``track_m`` wide over all."""
    half = 0.5 * width_m
    outer = 0.5 * track_m - 0.025
    pair = Mesh.joined(
        [
            cylinder((0, y - half, 0), (0, y + half, 0), (radius_m, radius_m), *materials, 12)
            for y in (outer - half, half - outer)
        ]
    )
    rounded = smooth(pair)
    return [Part(rounded, rolling((x, 0.0, radius_m), radius_m)) for x in axles]
