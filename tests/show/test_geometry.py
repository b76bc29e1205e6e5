"""The report picture."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.geometry.dense import densify
from dreamdrive.scene.actor import Track
from dreamdrive.scene.geometry import Geometry
from dreamdrive.show.geometry import _PATH_PX, draw_geometry
from tests.geometry import toy
from tests.show.test_ids import scene as there


@pytest.fixture(scope="module")
def made() -> tuple[toy.Toy, Geometry]:
    street = toy.drive([], count=3, held_out=(1,), fixed_rows=20)
    dense = densify(street.clip, street.posed)
    moving = dense.moving.copy()
    moving[0, 60:80, 100:140] = 1
    posed = street.posed
    geometry = Geometry(
        posed.cameras,
        dense.depth_m,
        dense.confidence,
        dense.sky,
        moving,
        posed.fixed_regions[None],
        posed.region_names,
        posed.ground,
        posed.scale,
        posed.focal,
    )
    return street, geometry


def test_rows_of_three_panels_and_a_path(made):
    street, geometry = made
    picture = draw_geometry(street.clip, geometry)
    assert picture.shape[1] == 3 * toy.WIDTH
    assert picture.shape[0] > 2 * toy.HEIGHT + 50
    np.testing.assert_array_equal(picture, draw_geometry(street.clip, geometry))


def test_fixed_regions_are_tinted_and_moving_evidence_is_outlined(made):
    street, geometry = made
    picture = draw_geometry(street.clip, geometry)
    first = picture[: toy.HEIGHT, : toy.WIDTH].astype(int)
    plain = street.clip.frames[0].astype(int)
    tinted = first[-8:, -40:] - plain[-8:, -40:]
    assert (tinted[..., 0] > tinted[..., 1]).mean() > 0.9
    assert (first[60, 110] == (255, 40, 40)).all()
    assert (first[70, 120] == plain[70, 120]).all()


def test_ids_of_what_moves_stand_on_the_frames(made):
    street, geometry = made
    scene = replace(there(0.0, 10.0), cameras=geometry.cameras, times_s=street.clip.times_s)
    track = Track(np.array([0.0, 9.0]), np.tile([[0.0, 1.5, 10.0]], (2, 1)), np.zeros(2))
    scene = replace(scene, actors=(replace(scene.actors[0], track=track),))
    plain, marked = draw_geometry(street.clip, geometry), draw_geometry(street.clip, geometry, scene)
    changed = (plain != marked).any(axis=2)
    assert changed[: toy.HEIGHT, : toy.WIDTH].any()
    assert not changed[:, toy.WIDTH :].any()


def test_words_that_do_not_fit_a_line_go_on_in_the_next(made):
    street, geometry = made
    told = replace(geometry, scale=replace(geometry.scale, source="seen " * 40))
    rows = len(draw_geometry(street.clip, told)) - _PATH_PX
    words = draw_geometry(street.clip, told)[rows : rows + 60, :40]
    dark = (words == 0).all(axis=2).any(axis=1)
    assert dark[5:40].all()  # three lines, where one has 17 rows


def test_a_standing_path_is_drawn_too():
    street = toy.drive([], count=2, step_m=0)
    dense = densify(street.clip, street.posed)
    posed = street.posed
    geometry = Geometry(
        posed.cameras,
        dense.depth_m,
        dense.confidence,
        dense.sky,
        dense.moving,
        posed.fixed_regions[None],
        posed.region_names,
        posed.ground,
        posed.scale,
        posed.focal,
        fallback="stands",
    )
    assert draw_geometry(street.clip, geometry).std() > 10
