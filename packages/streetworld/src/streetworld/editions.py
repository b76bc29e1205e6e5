"""Editions of drawn streets: each draws the same for ever."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.hills import Hills
from dreamdrive.scene.street.layout import Layout, check_edition
from streetworld.edition1 import lens as level_lens
from streetworld.edition1.sky import make_sky
from streetworld.edition1.standing import stand
from streetworld.edition1.streets import draw_street as draw
from streetworld.edition2.layouts.streets import draw_street as draw2
from streetworld.edition2.light.eye import Eye2
from streetworld.edition2.light.sky import make_sky as make_sky2
from streetworld.edition2.light.textures import TextureLibrary
from streetworld.edition2.standing import stand as stand2
from streetworld.engine import lens
from streetworld.engine.eye import Eye
from streetworld.engine.materials import Materials
from streetworld.engine.sky import SkyLight
from streetworld.engine.street import Standing
from streetworld.options import StreetOptions

Bounds = tuple[float, float, float, float]
"""A rectangle of the map in metres: x0, y0, x1, y1."""


@dataclass(frozen=True)
class Edition:
    """How the streets of an edition come about and are looked at.

    Attributes:
        draw: From a seed to a layout.
        stand: From a layout to its triangles, inside some bounds, with their materials.
        sky: Its light.
        eye: A camera in the street.
        pinhole: The recording camera, for pictures of a width and height in pixels.
        level_from_camera: Axes (3, 3; right, down, ahead) of the recording camera in the level car.
        kinds: Whether a kind of street and a queue can be asked for.
    """

    draw: Callable[[int, StreetOptions], Layout]
    stand: Callable[[Layout, Bounds, Hills, Materials, TextureLibrary | None], Standing]
    sky: Callable[[Layout, TextureLibrary | None], SkyLight]
    eye: type[Eye]
    pinhole: Callable[[Layout, tuple[int, int]], Camera]
    level_from_camera: Callable[[Layout], Float[np.ndarray, "3 3"]]
    kinds: bool


EDITIONS = {
    1: Edition(
        draw,
        lambda layout, bounds, hills, materials, textures: stand(layout, bounds, hills, materials),
        lambda layout, textures: make_sky(layout.light, layout.seed),
        Eye,
        lambda layout, size: level_lens.pinhole(size),
        lambda layout: level_lens.level_from_camera(),
        kinds=False,
    ),
    2: Edition(
        draw2,
        stand2,
        make_sky2,
        Eye2,
        lambda layout, size: lens.pinhole(layout.lens, size),
        lambda layout: lens.level_from_camera(layout.lens),
        kinds=True,
    ),
}
"""By their numbers in layouts, see ``scene.street.layout``."""


def edition_of(layout: Layout) -> Edition:
    """That of a layout."""
    return EDITIONS[layout.edition]


def draw_street(seed: int, options: StreetOptions = StreetOptions()) -> Layout:
    """A street with houses, trees, parked and moving road users; equal seeds give equal streets.

    Raises:
        InputError: The edition has no such streets.
    """
    options.check()
    check_edition(options.edition)
    edition = EDITIONS[options.edition]
    if (options.kind or options.traffic) and not edition.kinds:
        raise InputError(
            f"edition {options.edition} has neither kinds of streets nor queues; ask for edition 2"
        )
    return edition.draw(seed, options)
