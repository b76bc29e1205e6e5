"""The compiled backend against the plain-torch one on random scenes of every kind, in value and gradient."""

import pytest
from hypothesis import example, given, settings

from tests.splat.agreement import (
    Edges,
    assert_gradients_agree,
    assert_images_agree,
    assert_inspections_agree,
    edges,
    pull,
)
from tests.splat.drawn import KINDS, Case, build, cases


def check_against_the_reference(case: Case) -> Edges:
    scene = build(case)
    where = edges(case, scene)
    value, gradients = pull(case, scene, where.sure)
    expected, expected_gradients = pull(case, scene, where.sure, "reference")
    assert_images_agree(value, expected, where)
    assert_gradients_agree(gradients, expected_gradients, where)
    if case.inspect:
        assert_inspections_agree(value, expected, where)
    assert (value.visible | ~where.reaching).all()
    for name, gradient in gradients.items():
        if name != "camera_from_world":
            assert not gradient[~value.visible].any(), f"{name}: what is not visible has a gradient"
    return where


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_agrees_with_the_reference(kind: str) -> None:
    for seed in range(2):
        case = Case(seed, 40, (kind, "plain"), degree=2, stored=3, antialiased=seed == 1, inspect=True)
        where = check_against_the_reference(case)
        assert where.sure.double().mean() > 0.9


@given(cases())
@settings(max_examples=60)
@example(Case(0, n=0, absolute=True, inspect=True))
@example(Case(1, n=1, size_px=(1, 1), degree=0, stored=0, channels=0))
@example(Case(2, n=60, kinds=("opaque", "huge"), size_px=(17, 33)))
@example(Case(3, n=40, kinds=("needle",), size_px=(80, 280)))  # across more tiles than a row of lanes holds
def test_random_scenes_agree_with_the_reference(case: Case) -> None:
    check_against_the_reference(case)


@pytest.mark.slow
@given(cases(most=200))
@settings(max_examples=1500)
def test_many_random_scenes_agree_with_the_reference(case: Case) -> None:
    check_against_the_reference(case)
