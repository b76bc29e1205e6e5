"""The street benchmark's distances: few dimensions that the truth spans, and ratios that know their doubt."""

import numpy as np
import pytest

from dreamdrive.evaluate.clips.frechet import frechet_distance
from dreamdrive_bench.street import distances

VIEWS = ("shift_1", "shift_2", "shift_3", "raise_1", "yaw_10")
NETWORK = "frechet_efficientnet_lite0"


def world(rng: np.random.Generator, mixing: np.ndarray, noise: float) -> dict[str, np.ndarray]:
    """Features of one world: a few things vary, as in 1280 numbers of which few say something."""
    shape = (24, len(mixing))
    return {
        f"{NETWORK}/{view}": (
            rng.normal(size=shape) @ mixing + noise * rng.normal(size=(24, mixing.shape[1]))
        ).astype(np.float32)
        for view in VIEWS
    }


def test_a_basis_is_that_of_the_truth_and_keeps_its_distances() -> None:
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(400, 5)) @ rng.normal(size=(5, 200)) + 3
    basis = distances.principal(rows)
    assert basis.axes.shape == (200, distances.COMPONENTS)
    shown = basis.project(rows)
    np.testing.assert_allclose(shown.mean(axis=0), 0, atol=1e-9)
    apart = np.linalg.norm(rows[0] - rows[1])
    assert np.linalg.norm(shown[0] - shown[1]) == pytest.approx(apart)


def test_few_samples_have_fewer_components() -> None:
    rows = np.random.default_rng(0).normal(size=(40, 200))
    assert distances.principal(rows).axes.shape[1] == 40 // distances.SAMPLES_EACH


def test_ratios_of_like_and_unlike_representations(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(distances, "RESAMPLES", 40)
    monkeypatch.setattr(distances, "SPLITS", 10)
    rng = np.random.default_rng(0)
    mixing = rng.normal(size=(8, 90))
    truth = {seed: world(rng, mixing, 0.3) for seed in range(4)}

    def fitted(shift: float) -> dict[int, dict[str, np.ndarray]]:
        return {
            seed: {name: rows + np.float32(shift) for name, rows in found.items()}
            for seed, found in truth.items()
        }

    fits = {"hybrid": fitted(0.5), "static": fitted(2.0), "vibration": fitted(0.505)}
    rows = distances.distance_rows("hybrid", fits, truth, distances.bases_of(truth))
    rows = [row for row in rows if row["projected"]]
    by = {row["representation"]: row for row in rows}
    assert by["static"]["ratio_high"] < 0.3
    assert not by["static"]["undecided"]
    assert by["hybrid"]["samples"] == 4 * 5 * 24
    against = distances.compared(rows)
    assert [(row["against"], row["representation"]) for row in against] == [
        ("best other", "vibration"),
        ("static", "static"),
    ]


def test_distances_are_given_in_all_dimensions_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(distances, "RESAMPLES", 4)
    rng = np.random.default_rng(0)
    mixing = rng.normal(size=(8, 150))
    truth = {seed: world(rng, mixing, 0.3) for seed in range(2)}
    off = {seed: {name: 1.1 * rows for name, rows in found.items()} for seed, found in truth.items()}
    far = {seed: {name: 1.3 * rows for name, rows in found.items()} for seed, found in truth.items()}
    rows = distances.distance_rows("hybrid", {"hybrid": off, "static": far}, truth, distances.bases_of(truth))
    assert [(row["dimensions"], row["projected"]) for row in rows] == 2 * [(60, True)] + 2 * [(150, False)]
    real, fake = (np.concatenate([distances.pooled(s[k], NETWORK) for k in (0, 1)]) for s in (truth, off))
    assert rows[2]["distance"] == pytest.approx(frechet_distance(real, fake))
    assert rows[2]["low"] is None
    assert 0 < rows[3]["ours_over_this"] < 1
    assert rows[3]["undecided"]  # no interval, no verdict


def test_a_world_without_windows_of_a_view_still_counts_with_the_others() -> None:
    rng = np.random.default_rng(0)
    mixing = rng.normal(size=(4, 10))
    truth = {seed: world(rng, mixing, 0.3) for seed in range(3)}
    del truth[0][f"{NETWORK}/shift_3"]
    truth[1] = {}
    fits = {"hybrid": truth, "static": truth}
    rows = distances.distance_rows("hybrid", fits, truth, distances.bases_of(truth))
    assert {row["samples"] for row in rows} == {4 * 24 + 5 * 24}


def test_ratios_have_the_quantiles_that_were_drawn() -> None:
    drawn = np.linspace(0.7, 1.1, 401)
    found = distances._ratio(0.8, 1.0, drawn)
    # Moved onto the value the interval would end at 0.99.
    assert (found["ratio_low"], found["ratio_high"]) == (
        pytest.approx(0.71, abs=2e-3),
        pytest.approx(1.09, abs=2e-3),
    )
    assert found["undecided"]
    drawn[-4:] = np.inf  # the other without any excess, in a hundredth of the draws
    assert distances._ratio(0.8, 1.0, drawn)["ratio_high"] < 1.1
    drawn[-40:] = np.inf
    unbounded = distances._ratio(0.8, 1.0, drawn)
    assert unbounded["undecided"]
    assert unbounded["ratio_high"] is None


def test_intervals_of_ratios_hold_the_true_ratio(monkeypatch: pytest.MonkeyPatch) -> None:
    """Worlds that differ in how far off a fit is; the true ratio is that of very many of them."""
    monkeypatch.setattr(distances, "RESAMPLES", 100)
    monkeypatch.setattr(distances, "SPLITS", 8)

    def ratio(seed: int, worlds: int) -> dict[str, float]:
        rng = np.random.default_rng(seed)
        real = [rng.normal(size=(40, 2)) + rng.normal(size=2) for _ in range(worlds)]
        off = rng.uniform(0.6, 1.4, (worlds, 1, 1))
        fakes = {
            name: [
                clip + far * o + 0.1 * rng.normal(size=clip.shape) for clip, o in zip(real, off, strict=True)
            ]
            for name, far in (("hybrid", 0.8), ("static", 1.0))
        }
        return distances._projected("any", "hybrid", real, fakes)[1]

    truth = ratio(0, 400)["ours_over_this"]
    assert truth == pytest.approx(0.64, abs=0.02)
    found = [ratio(seed, 8) for seed in range(1, 31)]
    held = np.mean([row["ratio_low"] <= truth <= row["ratio_high"] for row in found])
    wide = np.median([row["ratio_high"] - row["ratio_low"] for row in found])
    spread = np.std([row["ours_over_this"] for row in found])
    assert held >= 0.8
    assert 2 * spread < wide < 10 * spread


def test_no_excess_of_the_other_gives_no_ratio() -> None:
    assert distances._ratio(1.0, -0.1, None)["ours_over_this"] is None
    alone = distances._ratio(1.0, 4.0, None)
    assert alone["ours_over_this"] == 0.25
    assert alone["undecided"]


def test_distances_by_moments_are_those_by_samples() -> None:
    rng = np.random.default_rng(0)
    real = [rng.normal(size=(30, 4)) for _ in range(3)]
    fake = [rng.normal(size=(30, 4)) @ rng.normal(size=(4, 4)) + 1 for _ in range(3)]
    weights = np.array([[1, 1, 1], [2, 0, 1]])
    found = distances.by_halves({"truth": real, "fake": fake}, weights, 2, rng)
    for draw, clips in enumerate(([0, 1, 2], [0, 0, 2])):
        expected = frechet_distance(
            np.concatenate([real[c] for c in clips]), np.concatenate([fake[c] for c in clips])
        )
        assert found.whole["fake"][draw] == pytest.approx(expected)
        assert found.whole["truth"][draw] == pytest.approx(0, abs=1e-6)
        assert found.half["truth"][draw] > 0
