"""Streets of edition 2 are drawn in every weather, with truth that fits the picture."""

from functools import cache

import msgspec
import numpy as np
import pytest

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.layout import Barrier, Layout, Lens, Light, Prop
from dreamdrive.scene.street.truth import Semantic
from streetworld import World, WorldView, draw_street
from streetworld.drive import ego_poses
from streetworld.picture import picture_of

SIZE = 96, 54
DAY, LEVEL = Light(), Lens()
WEATHERS = {
    "day": Light(),
    "overcast": Light(sun=0.0, clouds=1.0),
    "dusk": Light(sun_elevation_rad=0.08, glare=0.5),
    "night": Light(sun=0.0, night=1.0),
    "rain": Light(sun=0.0, rain=0.8, wet=1.0),
    "fog": Light(sun=0.1, haze_per_m=0.03),
    "snow": Light(sun=0.2, snow=0.9),
}


def street(light: Light = DAY, lens: Lens = LEVEL, seed: int = 0) -> Layout:
    """A street of the first edition with the second one's light, props and barriers."""
    given = draw_street(seed)
    kinds = ("tree", "lamp", "sign", "bush", "mast", "traffic_light", "bin", "cone")
    props = [Prop(kinds[i % 8], p.at_m, p.height_m, p.yaw_rad, i) for i, p in enumerate(given.props)]
    sides = (("fence", 9.0), ("hedge", -9.0), ("wall", 11.0), ("rail", -11.0))
    barriers = [Barrier(kind, [(5.0, y), (30.0, y)], 1.2, i) for i, (kind, y) in enumerate(sides)]
    return msgspec.structs.replace(given, edition=2, light=light, lens=lens, props=props, barriers=barriers)


def seen(layout: Layout) -> WorldView:
    """What the recording camera sees at the start."""
    world = World(layout)
    camera = Camera(60, 60, 48, 27, *SIZE, ego_poses(layout, np.zeros(1))[0])
    return picture_of(world, world.at(0.0), camera, (0.1, camera))


@cache
def drawn(weather: str) -> WorldView:
    return seen(street(WEATHERS[weather]))


@pytest.mark.parametrize("weather", WEATHERS)
def test_a_street_is_drawn_in_every_weather(weather: str) -> None:
    view = drawn(weather)
    assert view.frame.std() > 4
    assert {Semantic.SKY, Semantic.ROAD, Semantic.BUILDING} <= set(np.unique(view.semantic))


def test_a_night_is_darker_than_a_day() -> None:
    day, night = (drawn(name).frame.mean() for name in ("day", "night"))
    assert night < 0.6 * day


def test_equal_layouts_give_equal_pictures() -> None:
    a, b = drawn("rain"), seen(street(WEATHERS["rain"]))
    np.testing.assert_array_equal(a.frame, b.frame)


def test_light_changes_no_truth() -> None:
    day, night = drawn("day"), drawn("night")
    np.testing.assert_array_equal(day.semantic, night.semantic)
    np.testing.assert_array_equal(day.depth_m, night.depth_m)


def test_the_own_bonnet_is_known_and_has_no_depth() -> None:
    bare, view = drawn("day"), seen(street(lens=Lens(bonnet=3)))
    own = view.semantic == Semantic.OWN_CAR
    assert own[-1].any()
    assert not own[: SIZE[1] // 2].any()
    for field in (view.depth_m, view.instance, view.flow_px, view.sky):
        assert (field[own] == 0).all()
    np.testing.assert_array_equal(view.depth_m[~own], bare.depth_m[~own])
