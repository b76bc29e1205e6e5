"""The ablation: what its variants change, and means against all parts."""

from dataclasses import asdict, replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from dreamdrive.decompose import GroupOptions
from dreamdrive.fit import FitOptions, SeedOptions, fit_static, initialise
from dreamdrive.scene.clip import OF_GEOMETRY
from dreamdrive_bench.ablation import errors as errors_module, features, groups, main as ablation
from dreamdrive_bench.ablation.tables import FIGURES
from dreamdrive_bench.street import methods
from tests.scene.scenes import make_scene
from tests.streets import small_street, street_clip, true_geometry


def test_each_variant_changes_something_of_its_own_and_hybrid_nothing() -> None:
    everything = {
        name: (asdict(variant.change(methods.QUALITY)), dict(variant.around))
        for name, variant in ablation.VARIANTS.items()
    }
    untouched = (asdict(methods.QUALITY), {})
    assert [name for name, what in everything.items() if what == untouched] == ["hybrid"]
    assert all(list(everything.values()).count(what) == 1 for what in everything.values())


def test_all_steps_are_equal() -> None:
    steps = {variant.change(methods.QUALITY).fit.steps for variant in ablation.VARIANTS.values()}
    assert steps == {methods.QUALITY.fit.steps}


def test_every_fit_has_a_file_of_its_own() -> None:
    wanted = ablation.cuts(ablation.options_of(arguments=[]))
    assert len({cut.result for cut in wanted}) == len(wanted) == 4 * 2 * len(ablation.VARIANTS)


def test_changes_are_world_by_world() -> None:
    def record(seed: int, variant: str, value: float, fake: float | None = 0.0) -> dict[str, object]:
        figures = dict.fromkeys(FIGURES, value)
        return {"seed": seed, "references": "clean", "variant": variant, **figures, "fake_m": fake}

    records = [record(seed, "hybrid", 10.0 * seed) for seed in range(3)]
    records += [record(seed, "static", 11.0 * seed - 1, None) for seed in range(1, 3)]
    (table,) = ablation.tables(records)
    hybrid, static = table["rows"]
    # World 0 lacks static: it counts in neither mean.
    assert table["worlds"] == [1, 2]
    assert hybrid["novel_psnr"] == pytest.approx(15)
    assert static["novel_psnr_change"] == pytest.approx(0.5)
    assert static["novel_psnr_range"] == pytest.approx([0, 1])
    assert static["fake_m"] is None
    assert "(+0.50; +0.00 to +1.00)" in ablation.markdown([table])


def test_features_are_cut_as_each_variant_says() -> None:
    channels = torch.arange(1.0, 2 * (OF_GEOMETRY + 4) + 1).reshape(2, -1)
    seeds = make_scene().static.select(torch.arange(2))
    seeds = replace(seeds, features=channels)
    evidence, appearance, nothing = (
        cut({}, methods.QUALITY, lambda: seeds).features
        for cut in (features.with_evidence, features.with_appearance, features.without_features)
    )
    assert (evidence + appearance == channels).all()
    assert (evidence[:, OF_GEOMETRY:] == 0).all()
    assert (evidence[:, :OF_GEOMETRY] != 0).all()
    assert (nothing == 0).all()


def two_cars(rng: np.random.Generator, per_frame: int) -> tuple[np.ndarray, np.ndarray]:
    """Two cars of 4 m, 8 m apart, at 10 m/s in 21 training frames of 24: space-time, and whose it is."""
    frames = np.flatnonzero(np.arange(24) % 8 != 7)
    first = np.arange(len(frames) * 2 * per_frame) % (2 * per_frame) < per_frame
    number = np.repeat(np.arange(len(frames)), 2 * per_frame)
    places = rng.uniform([-0.9, -0.7, -2], [0.9, 0.7, 2], (len(number), 3))
    places[:, 2] += frames[number]  # of 0.1 s
    places[~first, 0] += 8.0
    return np.column_stack([places, number]), first


@pytest.mark.parametrize("per_frame", [40, 150])
def test_voxels_and_clusters_of_density_give_each_car_one_label(per_frame: int) -> None:
    places, first = two_cars(np.random.default_rng(0), per_frame)
    score = np.full(len(places), groups.METRES_PER_SCORE)
    for labels in (
        groups.voxel_labels(places),
        groups.density_labels(np.column_stack([places, score]), 24),
    ):
        found = [np.bincount(labels[rows] + 1)[1:] for rows in (first, ~first)]
        assert found[0].argmax() != found[1].argmax()
        assert all(counts.max() > 0.97 * counts.sum() > 0.9 * first.sum() for counts in found)


def test_no_candidates_have_no_labels() -> None:
    assert groups.voxel_labels(np.zeros((0, 4))).shape == (0,)
    assert (groups.density_labels(np.zeros((3, 5)), 24) == -1).all()


def test_clusters_of_density_within_reach_are_one() -> None:
    """Dense clumps a metre apart are one thing, those of another thing far away another one."""
    generator = np.random.default_rng(0)
    clumps = np.array([[0, 0], [1, 0], [2, 0], [20, 0], [21, 0]], dtype=float).repeat(60, axis=0)
    places = np.zeros((len(clumps), 5))
    places[:, :2] = clumps + generator.normal(0, 0.02, clumps.shape)
    labels = groups.density_labels(places, 24)
    first, second = (labels[clumps[:, 0] < 10], labels[clumps[:, 0] > 10])
    assert len(set(first[first >= 0])) == len(set(second[second >= 0])) == 1
    assert set(first) & set(second) <= {-1}
    assert (labels >= 0).mean() > 0.9


def test_space_time_does_not_count_held_out_frames() -> None:
    seeds = SimpleNamespace(
        means=torch.zeros(3, 3), source_frame=torch.tensor([0, 2, 3]), features=torch.ones(3, 2)
    )
    clip = SimpleNamespace(held_out=np.array([False, True, False, False]))
    found = groups.space_time(clip, seeds, np.array([0.1, 0.5, 0.9]), np.array([0, 1, 2]))
    np.testing.assert_allclose(found[:, 3], [0, 1, 2])
    np.testing.assert_allclose(found[:, 4], [0.2, 1.0, 1.8])


def test_the_vote_is_that_of_eq_10() -> None:
    options = GroupOptions(smallest=4)
    labels = np.array([0] * 5 + [1] * 5 + [2] * 3 + [-1] * 2)
    scores = np.array([0.9, 0.9, 0.4, 0.3, 0.3, *[0.3] * 5, *[0.9] * 3, 0.9, 0.9])
    # Most of the first above tau with a core, the second below, the third too small, the last noise.
    assert groups.majority(labels, scores, options).tolist() == [0] * 5 + [-1] * 10


@pytest.mark.parametrize("name", ["dssim_errors", "feature_errors"])
def test_every_error_is_largest_where_things_move(name: str) -> None:
    street = small_street(size=(160, 96), frames=9)
    clip, geometry = street_clip(street, hold_out=8), true_geometry(street)
    seeds = initialise(clip, geometry, SeedOptions())
    fitted = fit_static(clip, geometry, seeds, FitOptions(steps=40), 0, lambda *_: None)
    before = {"prior": clip, "geometry": geometry, "initialise": seeds, "static": fitted}
    errors = getattr(errors_module, name)(before, methods.QUALITY)
    seen = ~clip.held_out
    assert (errors >= 0).all()
    assert (errors <= 1).all()
    assert errors[seen][street.moving[seen]].mean() > 1.3 * errors[seen][~street.moving[seen]].mean()


def test_errors_over_those_of_their_frame_do_not_depend_on_its_light() -> None:
    errors = np.random.default_rng(0).uniform(size=(1, 50, 50)).astype(np.float32)
    both = errors_module.scaled_by_frame(np.concatenate([errors, 0.1 * errors]), 0.2)
    np.testing.assert_allclose(both[0], both[1], rtol=1e-5)
    assert np.percentile(both[0], 98) == pytest.approx(0.2)


def test_a_variant_of_other_options_counts_as_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ablation, "case_digest", lambda case: case.name)
    monkeypatch.setattr(ablation, "views_digest", lambda seed: str(seed))
    keys = {cut.key for cut in ablation.cuts(ablation.options_of(arguments=[]))}
    assert len(keys) == 4 * 2 * len(ablation.VARIANTS)
    (cut,) = ablation.cuts(
        ablation.options_of(arguments=["--seeds", "0", "--variants", "tau-0.50", "--references", "clean"])
    )
    before = cut.key
    quality = ablation.QUALITY
    monkeypatch.setattr(ablation, "QUALITY", replace(quality, cast=replace(quality.cast, opacity=0.7)))
    assert cut.key != before
