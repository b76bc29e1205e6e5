"""Bodies of road users of the second edition."""

from typing import get_args

import numpy as np
import pytest

from dreamdrive.scene.street.layout import BoxKind
from dreamdrive.scene.street.truth import Semantic
from streetworld.edition2.layouts.variants import Draw, is_kept_out
from streetworld.edition2.people.rider import has_rider
from streetworld.edition2.vehicles.bodies import body, size_of
from streetworld.edition2.vehicles.shape import body_mesh
from streetworld.edition2.vehicles.vehicles import family_of
from streetworld.engine.materials import Materials
from streetworld.engine.mesh import Mesh

KINDS: tuple[BoxKind, ...] = get_args(BoxKind)
LOOKS = range(12)


def whole(kind: BoxKind, look: int, materials: Materials | None = None) -> Mesh:
    parts = body(kind, size_of(kind, look), look, materials or Materials())
    return Mesh.joined([p.mesh if p.turn is None else p.mesh.moved(p.turn(0.0)) for p in parts])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("look", LOOKS)
def test_a_body_fills_its_box(kind: BoxKind, look: int) -> None:
    size = np.array(size_of(kind, look))
    corners = whole(kind, look).corners
    low, high = corners.min((0, 1)), corners.max((0, 1))
    assert -0.06 < low[2] < 0.06
    assert high[2] == pytest.approx(size[2], rel=0.03, abs=0.03)
    if kind != "pedestrian":  # who steps out of a box and back
        assert high[0] == pytest.approx(0.5 * size[0], abs=0.12)
        assert low[0] == pytest.approx(-0.5 * size[0], abs=0.12)
        # Mirrors stick out.
        assert (np.abs([low[1], high[1]]) < 0.5 * size[1] + 0.2).all()
        assert (np.abs([low[1], high[1]]) > 0.4 * size[1]).all()


@pytest.mark.parametrize("kind", KINDS)
def test_equal_looks_give_equal_bodies(kind: BoxKind) -> None:
    first, second = Materials(), Materials()
    one, other = whole(kind, 7, first), whole(kind, 7, second)
    np.testing.assert_array_equal(one.corners, other.corners)
    for (a, _), (b, _) in zip(first.textures.images, second.textures.images, strict=True):
        np.testing.assert_array_equal(a, b)
    assert whole(kind, 8).corners.shape != one.corners.shape or not np.allclose(
        whole(kind, 8).corners, one.corners
    )


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("look", LOOKS)
def test_normals_have_unit_length_and_point_outwards(kind: BoxKind, look: int) -> None:
    mesh = whole(kind, look)
    assert mesh.normals is not None
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=-1), 1, atol=1e-6)
    flat = mesh.flat_normals()
    assert (np.einsum("mci,mci->mc", flat, mesh.normals) > 0.2).mean() > 0.99


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_has_its_class_and_few_triangles(kind: BoxKind) -> None:
    materials = Materials()
    meshes = [whole(kind, look, materials) for look in LOOKS]
    assert set(materials.semantic) == {Semantic[kind.upper()]}
    assert np.mean([len(m) for m in meshes]) < 1700
    assert max(max(image.shape) for image, _ in materials.textures.images) <= 400


@pytest.mark.parametrize("look", range(8))
def test_the_shell_of_a_car_is_closed(look: int) -> None:
    draw = Draw("car", look)
    family = family_of(draw)
    mesh = body_mesh(family.shape(draw, family.size(draw)))
    across = np.cross(mesh.corners[:, 1] - mesh.corners[:, 0], mesh.corners[:, 2] - mesh.corners[:, 0])
    # The surface of a closed body has no net direction, and its volume is positive where it faces outwards.
    np.testing.assert_allclose(across.sum(0), 0, atol=1e-9)
    volume = np.einsum("mi,mi->m", across, mesh.corners[:, 0]).sum() / 6
    length, width, height = np.ptp(mesh.corners, axis=(0, 1))
    assert 0.5 < volume / (length * width * height) < 0.9


def test_looks_kept_out_have_families_of_their_own() -> None:
    for kind in ("car", "van"):
        names: dict[bool, set[str]] = {False: set(), True: set()}
        for look in range(600):
            names[is_kept_out(look)].add(family_of(Draw(kind, look)).name)
        assert not names[False] & names[True]
        assert names[True]
    assert sum(is_kept_out(look) for look in range(100)) == 20


def test_proportions_and_options_kept_out_are_disjoint() -> None:
    options = list(range(10))
    drawn = {
        kept: [Draw("truck", look) for look in range(200) if is_kept_out(look) == kept] for kept in (0, 1)
    }
    picked = {kept: {d.option(options) for d in draws} for kept, draws in drawn.items()}
    assert picked == {0: set(range(8)), 1: {8, 9}}
    shares = {kept: [d.between(0, 1) for d in draws] for kept, draws in drawn.items()}
    assert max(shares[0]) < 0.8 <= min(shares[1])


def test_riders_are_a_half_of_the_looks() -> None:
    for kept in (False, True):
        riders = [has_rider(look) for look in range(1000) if is_kept_out(look) == kept]
        assert np.mean(riders) == pytest.approx(0.5)
    assert size_of("bicycle", 0)[2] > 1.2 > size_of("bicycle", 5)[2]
