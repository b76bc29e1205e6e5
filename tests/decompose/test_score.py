from dataclasses import replace

import numpy as np
import pytest
import torch

from dreamdrive.decompose import ScoreOptions, error_maps, score
from dreamdrive.decompose.score import _weight_of_moving
from dreamdrive.fit import FitOptions, SeedOptions, fit_static, initialise
from tests.fit.test_fit import quiet
from tests.streets import small_street, street_clip, true_geometry


@pytest.fixture(scope="module")
def fitted():
    street = small_street(size=(160, 96), frames=9)
    clip, geometry = street_clip(street, hold_out=8), true_geometry(street)
    seeds = initialise(clip, geometry, SeedOptions())
    start = fit_static(clip, geometry, seeds, FitOptions(steps=80), 0, quiet)
    errors = error_maps(clip, geometry, start.pictures(clip, geometry))
    return street, clip, geometry, seeds, errors


def test_static_gaussians_fail_where_things_move(fitted):
    street, clip, _, _, errors = fitted
    seen = ~clip.held_out
    moving = street.moving[seen]
    assert errors[seen][moving].mean() > 2 * errors[seen][~moving].mean()
    assert (errors[clip.held_out] == 0).all()


def test_scores_tell_the_moving_car_from_the_street(fitted):
    _, clip, geometry, seeds, errors = fitted
    scores = score(clip, geometry, seeds, errors, ScoreOptions(steps=120), 0, quiet)
    truth = seeds.features[:, 0] >= 0.5
    assert ((scores >= 0) & (scores <= 1)).all()
    assert scores[truth].median() > 0.6
    assert scores[~truth].quantile(0.9) < 0.45  # groups decide at 0.5


def test_errors_alone_rank_the_moving_car_above_the_street(fitted):
    """The paper's target, without the moving evidence anywhere: neither in the target nor in the features."""
    street, clip, _, seeds, errors = fitted
    truth = seeds.features[:, 0] >= 0.5
    blind = true_geometry(street, evidence=False)
    features = seeds.features.clone()
    features[:, 0] = 0
    seeds = type(seeds)(**{**seeds.tensors(), "features": features})
    scores = score(clip, blind, seeds, errors, ScoreOptions(steps=150, target="error"), 0, quiet).numpy()
    order = np.argsort(np.argsort(scores)) / len(scores)
    assert order[truth.numpy()].mean() > 0.75


def test_scores_depend_on_the_seed_alone(fitted):
    _, clip, geometry, seeds, errors = fitted
    options = ScoreOptions(steps=5)
    one = score(clip, geometry, seeds, errors, options, 0, quiet)
    assert torch.equal(one, score(clip, geometry, seeds, errors, options, 0, quiet))
    assert not torch.equal(one, score(clip, geometry, seeds, errors, options, 1, quiet))


def test_gaussians_without_features_are_refused(fitted):
    _, clip, geometry, seeds, errors = fitted
    bare = type(seeds)(**{n: v for n, v in seeds.tensors().items() if n != "features"})
    with pytest.raises(ValueError, match="carry no features"):
        score(clip, geometry, bare, errors, ScoreOptions(), 0, quiet)


def test_what_moves_counts_as_much_as_its_share_lacks():
    weight = torch.ones(10, 10)
    rare, common = torch.zeros(10, 10), torch.zeros(10, 10)
    rare[0, :5], common[:6] = 1, 1
    assert _weight_of_moving([(rare, weight)], 0.4, 10.0) == pytest.approx(8)
    assert _weight_of_moving([(rare, weight)], 0.4, 3.0) == 3
    assert _weight_of_moving([(common, weight)], 0.4, 10.0) == 1
    assert _weight_of_moving([(0 * rare, weight)], 0.4, 10.0) == 10  # where nothing moves it counts nothing
    assert _weight_of_moving([(rare, rare)], 0.4, 10.0) == 1


def test_balance_teaches_faster_what_moves(fitted):
    _, clip, geometry, seeds, errors = fitted
    truth = seeds.features[:, 0] >= 0.5
    short = ScoreOptions(steps=12)
    alike = score(clip, geometry, seeds, errors, replace(short, balance=None), 0, quiet)
    balanced = score(clip, geometry, seeds, errors, short, 0, quiet)
    assert balanced[truth].median() > alike[truth].median() + 0.2
    assert balanced[~truth].quantile(0.9) < 0.2
