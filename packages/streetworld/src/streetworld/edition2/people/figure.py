"""Human figures: trunk, head, clothes, limbs between joints."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from streetworld.edition2.layouts.variants import Colour, Draw
from streetworld.edition2.vehicles.parts.body_materials import Coats
from streetworld.edition2.vehicles.parts.loft import capsule, egg, strip, tube
from streetworld.engine.bodies import Part
from streetworld.engine.mesh import Mesh

Joint = Callable[[float], Float[np.ndarray, "3"]]
"""From the way travelled in metres to the place of a joint in its body."""

_SKIN: tuple[Colour, ...] = (
    (232, 190, 164),
    (222, 176, 146),
    (196, 148, 116),
    (164, 116, 84),
    (122, 82, 58),
    (84, 58, 44),
)
_HAIR: tuple[Colour, ...] = (
    (30, 24, 22),
    (52, 38, 30),
    (84, 60, 40),
    (140, 106, 66),
    (186, 152, 100),
    (150, 148, 146),
)
_PLAIN: tuple[Colour, ...] = (
    (24, 25, 28),
    (34, 38, 52),
    (58, 60, 64),
    (40, 50, 78),
    (72, 84, 110),
    (96, 88, 76),
    (128, 116, 98),
    (150, 152, 154),
    (196, 190, 178),
)
OUTFITS = ("trousers", "trousers", "jacket", "jacket", "coat", "skirt", "shorts", "hooded", "robe", "vest")
"""By their shares; the last two are those of looks kept out."""
_VEST: tuple[Colour, ...] = ((206, 226, 40), (240, 120, 30))


@dataclass(frozen=True)
class Clothes:
    """Materials of a figure, and what it wears."""

    outfit: str
    top: int
    legs: int
    skin: int
    hair: int
    shoes: int
    girth: float
    child: bool


def dress(draw: Draw, coats: Coats, child: bool) -> Clothes:
    """The clothes of a look."""
    outfit = draw.option(OUTFITS)
    colour = draw.any_of(_PLAIN) if draw.chance(0.5) else draw.muted()
    if outfit == "vest":
        colour = draw.any_of(_VEST)
    woven = draw.chance(0.2) and outfit != "vest"
    skin = coats.plain(draw.near(draw.any_of(_SKIN), 6))
    bare = outfit in ("skirt", "shorts") and draw.chance(0.6)
    return Clothes(
        outfit=outfit,
        top=coats.cloth(colour) if woven else coats.plain(draw.near(colour, 6)),
        legs=skin if bare else coats.plain(draw.near(draw.any_of(_PLAIN), 6)),
        skin=skin,
        hair=coats.plain(draw.near(draw.any_of(_HAIR), 6)),
        shoes=coats.plain(draw.any_of(((24, 24, 26), (60, 46, 36), (210, 210, 208)))),
        girth=draw.between(0.85, 1.3),
        child=child,
    )


def trunk(height_m: float, clothes: Clothes) -> Mesh:
    """From the hips to the neck of somebody who stands upright."""
    hip, wide = 0.5, clothes.girth
    rows = [
        (hip - 0.035, 0.0, 0.0),
        (hip - 0.03, 0.055, 0.07),
        (hip + 0.02, 0.07, 0.098),
        (0.6, 0.062, 0.085),
        (0.71, 0.072, 0.1),
        (0.785, 0.066, 0.118),
        (0.82, 0.05, 0.1),
        (0.845, 0.032, 0.045),
        (0.85, 0.0, 0.0),
    ]
    if clothes.outfit in ("jacket", "hooded", "coat", "vest"):
        rows = [(z, 1.12 * x, 1.1 * y) for z, x, y in rows]
    low = {"coat": 0.27, "skirt": 0.3, "robe": 0.06}.get(clothes.outfit)
    if low is not None:
        flare = 0.105 if clothes.outfit == "coat" else 0.125
        rows = [(low, 0.0, 0.0), (low, 0.8 * flare, flare), *rows[2:]]
    table = np.array(rows) * height_m
    centres = np.zeros((len(table), 3))
    centres[:, 2] = table[:, 0]
    return tube(centres, table[:, 1:] * wide, clothes.top, 12, 2.4)


def head(draw: Draw, height_m: float, clothes: Clothes, helmet: int | None = None) -> Mesh:
    """Neck, head, and hair, hat or helmet, above an upright trunk."""
    size = height_m * (1.3 if clothes.child else 1.0)
    tall = 0.066 * size
    z = height_m - 1.06 * tall
    made = [egg((0.012 * size, 0, z), (0.052 * size, 0.043 * size, tall), clothes.skin)]
    neck = np.array([[0, 0, 0.82 * height_m], [0.004 * size, 0, z - 0.3 * tall]])
    made.append(tube(neck, np.full((2, 2), 0.031 * size), clothes.skin, 8))
    cover = helmet
    if cover is None and clothes.outfit == "hooded":
        cover = clothes.top
    if helmet is not None:
        made.append(egg((0.0, 0, z + 0.25 * tall), (0.066 * size, 0.057 * size, 0.86 * tall), helmet))
    elif cover is not None:
        made.append(
            egg((-0.012 * size, 0, z + 0.05 * tall), (0.055 * size, 0.054 * size, 1.05 * tall), cover)
        )
    else:
        hat = draw.chance(0.2)
        colour = clothes.top if hat and draw.chance(0.4) else clothes.hair
        made.append(
            egg((-0.006 * size, 0, z + 0.22 * tall), (0.054 * size, 0.048 * size, 0.86 * tall), colour)
        )
        if hat:
            made.append(
                egg((0.02 * size, 0, z + 0.3 * tall), (0.09 * size, 0.07 * size, 0.12 * tall), colour)
            )
        elif draw.chance(0.35):
            long = (
                np.array([[-0.05, 0, -0.17], [-0.045, 0, -0.16], [-0.035, 0, 0.0], [-0.02, 0, 0.02]]) * size
            )
            radii = np.array([[0, 0], [0.02, 0.04], [0.03, 0.044], [0, 0]]) * size
            made.append(tube(long + np.array([0, 0, z]), radii, clothes.hair, 8))
    return Mesh.joined(made)


def limb(
    start: Joint, end: Joint, radii_m: tuple[float, float], material: int, foot: int | None = None
) -> Part:
    """A limb between two joints; with a foot or a hand at its end."""
    length = float(np.linalg.norm(end(0.0) - start(0.0)))
    meshes = [capsule(length, radii_m, material)]
    if foot is not None:
        sole = np.array([[0, 0, -0.055], [0.0, 0, -0.05], [0, 0, 0.02], [0, 0, 0.03]])
        grow = radii_m[1] / 0.045
        radii = np.array([[0, 0], [0.125, 0.048], [0.06, 0.045], [0, 0]]) * grow
        sole = sole * grow + np.array([0.05 * grow, 0, -length])
        meshes.append(tube(sole, radii, foot, 8, 3.0))
    return Part(Mesh.joined(meshes), lambda way_m: strip(start(way_m), end(way_m)))


def bent(start: np.ndarray, end: np.ndarray, lengths_m: tuple[float, float], ahead: np.ndarray) -> np.ndarray:
    """Where the joint between two limbs of given lengths lies; it points towards ``ahead``."""
    line = end - start
    distance = float(np.linalg.norm(line))
    axis = line / max(distance, 1e-9)
    upper, lower = lengths_m
    reach = min(distance, 0.999 * (upper + lower))
    along = (upper**2 - lower**2 + reach**2) / (2 * max(reach, 1e-9))
    out = ahead - axis * (ahead @ axis)
    out /= max(float(np.linalg.norm(out)), 1e-9)
    return start + axis * along + out * np.sqrt(max(upper**2 - along**2, 0.0))
