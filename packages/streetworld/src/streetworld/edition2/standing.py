"""Meshes of all in a layout that never moves, in edition 2."""

from dataclasses import dataclass

from dreamdrive.scene.street.hills import Hills
from dreamdrive.scene.street.layout import Layout
from dreamdrive.scene.street.truth import Semantic
from streetworld.edition2.light.lamps import Lamps
from streetworld.edition2.light.textures import TextureLibrary
from streetworld.edition2.roads.ground import Ground2, paint_ground
from streetworld.edition2.roads.tiles import grain
from streetworld.edition2.roadside.scenery import scenery
from streetworld.edition2.vehicles.bodies import body
from streetworld.engine.materials import Materials
from streetworld.engine.street import Standing, movers_of


@dataclass(frozen=True)
class Standing2(Standing):
    """Its ground lies far around as well, is grainy near by, and lamps shine on it."""

    ground: Ground2
    far_material: int
    detail_texture: int
    lamps: Lamps


def stand(
    layout: Layout,
    bounds_m: tuple[float, float, float, float],
    hills: Hills,
    materials: Materials,
    textures: TextureLibrary | None,
) -> Standing2:
    """The street of a layout; what is painted lies inside the bounds (x0, y0, x1, y1)."""
    ground = paint_ground(layout, bounds_m, textures)
    near, far = (materials.add(each.image, Semantic.ROAD) for each in (ground, ground.far))
    detail = materials.textures.add(grain(layout.seed % 8), repeats=True)
    movers = movers_of(layout, hills, body, materials)
    made = scenery(layout, ground, (near, far), materials, textures)
    lamps = Lamps(hills.raised(made.lamps.at_m), made.lamps.colour, made.lamps.ahead)
    return Standing2(made.mesh, ground, near, movers, far, detail, lamps)
