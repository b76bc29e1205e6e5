"""Meshes of all in a layout that never moves, in edition 1."""

from dreamdrive.scene.street.hills import Hills
from dreamdrive.scene.street.layout import Layout
from dreamdrive.scene.street.truth import Semantic
from streetworld.edition1.bodies import body
from streetworld.edition1.ground import paint_ground
from streetworld.edition1.scenery import scenery
from streetworld.engine.materials import Materials
from streetworld.engine.street import Standing, movers_of


def stand(
    layout: Layout, bounds_m: tuple[float, float, float, float], hills: Hills, materials: Materials
) -> Standing:
    """The street of a layout; what is painted lies inside the bounds (x0, y0, x1, y1)."""
    ground = paint_ground(layout, bounds_m)
    material = materials.add(ground.image, Semantic.ROAD)
    movers = movers_of(layout, hills, body, materials)
    return Standing(scenery(layout, ground, material, materials), ground, material, movers)
