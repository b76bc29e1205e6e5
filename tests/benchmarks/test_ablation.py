"""The ablation: what its variants change, and means against all parts."""

import importlib
from dataclasses import asdict, replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from dreamdrive.decompose import GroupOptions

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture
def ablation(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(FOLDER))
    return importlib.import_module("ablation")


def test_each_variant_changes_something_and_hybrid_nothing(ablation: ModuleType) -> None:
    def same(variant) -> bool:
        options = asdict(variant.change(ablation.QUALITY)) == asdict(ablation.QUALITY)
        options &= variant.vote is ablation.own_vote and variant.scale is ablation.own_scale
        return options and variant.features == "appearance" and variant.representation == "hybrid"

    assert [name for name, variant in ablation.VARIANTS.items() if same(variant)] == ["hybrid"]


def test_all_steps_are_equal(ablation: ModuleType) -> None:
    steps = {variant.change(ablation.QUALITY).fit.steps for variant in ablation.VARIANTS.values()}
    assert steps == {ablation.QUALITY.fit.steps}


def test_every_fit_has_a_file_of_its_own(ablation: ModuleType) -> None:
    wanted = ablation.cuts(ablation.options_of([]))
    assert len({cut.result for cut in wanted}) == len(wanted) == 4 * 2 * len(ablation.VARIANTS)


def test_changes_are_world_by_world(ablation: ModuleType) -> None:
    def record(seed: int, variant: str, value: float, fake: float | None = 0.0) -> dict[str, object]:
        figures = dict.fromkeys(ablation.FIGURES, value)
        return {"seed": seed, "references": "clean", "variant": variant, **figures, "fake_m": fake}

    records = [record(seed, "hybrid", 10.0 * seed) for seed in range(3)]
    records += [record(seed, "static", 10.0 * seed - 1, None) for seed in range(1, 3)]
    (table,) = ablation.tables(records)
    row = table["rows"][1]
    assert row["worlds"] == 2
    assert row["novel_psnr_change"] == pytest.approx(-1)
    assert row["fake_m"] is None
    assert "(-1.00)" in ablation.markdown([table])


@pytest.fixture
def groups(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(FOLDER))
    return importlib.import_module("_ablation_groups")


def two_cars(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Places and times of two cars, 40 points in each of 10 frames, one at 10 m/s and one 8 m beside it."""
    times_s = np.repeat(np.arange(10) / 10, 80)
    places_m = rng.uniform(-0.8, 0.8, (800, 3))
    places_m[:, 2] += 10 * times_s
    places_m[np.arange(800) % 80 >= 40, 0] += 8.0
    return places_m, times_s


def test_voxels_tell_two_cars_apart_and_keep_each_together(groups: ModuleType) -> None:
    places_m, times_s = two_cars(np.random.default_rng(0))
    labels = groups.voxel_labels(places_m, times_s, np.ones(800))
    first = np.arange(800) % 80 < 40
    assert len(set(labels[first].tolist())) == len(set(labels[~first].tolist())) == 1
    assert labels[0] != labels[-1]
    assert groups.voxel_labels(places_m[:0], times_s[:0], times_s[:0]).shape == (0,)


def test_clusters_of_density_do_so_too(groups: ModuleType) -> None:
    pytest.importorskip("sklearn", reason="HDBSCAN comes with scikit-learn, which is not installed")
    places_m, times_s = two_cars(np.random.default_rng(0))
    labels = groups.density_labels(places_m, times_s, np.ones(800), 24)
    first = np.arange(800) % 80 < 40
    most = [np.bincount(labels[rows][labels[rows] >= 0]).argmax() for rows in (first, ~first)]
    assert most[0] != most[1]


def test_the_vote_is_that_of_eq_10(groups: ModuleType) -> None:
    options = GroupOptions(smallest=4)
    labels = np.array([0] * 5 + [1] * 5 + [2] * 3 + [-1] * 2)
    scores = np.array([0.9, 0.9, 0.4, 0.3, 0.3, *[0.3] * 5, *[0.9] * 3, 0.9, 0.9])
    # Most of the first above tau with a core, the second below, the third too small, the last noise.
    assert groups.majority(labels, scores, options).tolist() == [0] * 5 + [-1] * 10


def test_errors_over_those_of_their_frame_do_not_depend_on_its_light(groups: ModuleType) -> None:
    errors = np.random.default_rng(0).uniform(size=(1, 50, 50)).astype(np.float32)
    both = groups.scaled_by_frame(np.concatenate([errors, 0.1 * errors]), 0.2)
    np.testing.assert_allclose(both[0], both[1], rtol=1e-5)
    assert np.percentile(both[0], 98) == pytest.approx(0.2)


def test_a_variant_of_other_options_counts_as_not_there(
    ablation: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ablation, "case_digest", lambda case: case.name)
    monkeypatch.setattr(ablation, "views_digest", lambda seed: str(seed))
    keys = {cut.key for cut in ablation.cuts(ablation.options_of([]))}
    assert len(keys) == 4 * 2 * len(ablation.VARIANTS)
    (cut,) = ablation.cuts(
        ablation.options_of(["--seeds", "0", "--variants", "tau-0.50", "--references", "clean"])
    )
    before = cut.key
    quality = ablation.QUALITY
    monkeypatch.setattr(ablation, "QUALITY", replace(quality, cast=replace(quality.cast, opacity=0.7)))
    assert cut.key != before
